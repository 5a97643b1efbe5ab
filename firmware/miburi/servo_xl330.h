// The servo layer: eight DYNAMIXEL XL330s on one bus. bus.h says what `Io` must provide.
//
// Another servo family gets its own header with the same public functions. Positions here are the
// servo's own, in steps; registers and units are those of the XL330-M288-T's control table.
#pragma once

#include "bus.h"
#include "settings.h"

namespace miburi {

struct Motion {
  int32_t position;
  int16_t speed;  // steps/s
  bool alert;     // the servo reports a hardware error
};

struct Health {
  uint8_t voltage;      // 0.1 V
  uint8_t temperature;  // °C
};

// What one servo is to do; acceleration 0 means: without a ramp.
struct Order {
  uint16_t pwm;           // the limit of the duty; FULL_PWM is 100 %
  uint16_t speed;         // steps/s
  uint16_t acceleration;  // steps/s²
  int32_t goal;
};

// The position control's gains on an error and on its change; integral and feed-forward are 0.
struct Gains {
  uint16_t d;
  uint16_t p;
};

template <class Io>
class Xl330 {
 public:
  static const uint32_t BUS_SPEED = 1000000;
  static const uint32_t FACTORY_SPEED = 57600;
  static const uint8_t MOST_PEEKED = 12;  // registers at a time

  // What the servo really does when asked for so many steps/s or steps/s²: it counts in units of
  // 0.229 turns/min and 214.577 turns/min² (at least 1 unit; 0 would mean no limit). The speed is
  // returned in 1/256 steps/s: with whole steps/s a slow move's computed place would drift away.
  static uint32_t real_speed(uint16_t speed) {
    return (speed_units(speed) * 400207UL + 50) / 100;
  }
  static uint16_t real_acceleration(uint16_t acceleration) {
    return static_cast<uint16_t>((acceleration_units(acceleration) * 244141L + 500) / 1000);
  }

  explicit Xl330(Io& io) : bus_(io) {}

  // This and read_health return a bit per motor that answered. `late` becomes the µs from the
  // call to the moment at which the motions were read.
  uint8_t read_motion(const Joint* joints, Motion* motion, uint32_t& late) {
    const uint32_t began = bus_.micros();
    uint8_t heard = 0;
    // A byte is lost now and then. Then all are asked again, because a motor that is asked
    // separately has moved further meanwhile, and would seem to be ahead of the others. If a servo
    // was missing last time, all are asked only once: waiting for it costs the others time.
    const uint8_t asks = missing_ ? 1 : Bus<Io>::ASKS;
    for (uint8_t asked = 0; asked < asks && heard != ALL; asked++) {
      late = bus_.micros() - began;
      heard = bus_.sync_read(joints, SPEED_AND_POSITION, 8);
    }
    misnamed_ = 0;
    for (uint8_t i = 0; i < MOTORS; i++) {
      // Servos after a missing one in the order of answers never get their turn, so they are asked
      // one by one.
      if (!(heard & (1u << i))) {
        if (bus_.ask_again(i, joints[i].id, SPEED_AND_POSITION, 8)) {
          heard = static_cast<uint8_t>(heard | (1u << i));
        } else if (bus_.stranger()) {
          misnamed_ = static_cast<uint8_t>(misnamed_ | (1u << i));
        }
      }
      if (heard & (1u << i)) {
        Reader in(bus_.of(i).parameters, 8);
        motion[i].speed = static_cast<int16_t>((clamped(in.i32(), FASTEST) * 16005L) >> 10);  // × 15.63
        motion[i].position = in.i32();
        motion[i].alert = (bus_.of(i).error & protocol2::ALERT) != 0;
      }
    }
    missing_ = heard != ALL;
    return heard;
  }

  // The motors that answered with another's id when asked alone in the latest reading.
  uint8_t misnamed() const { return misnamed_; }

  uint8_t read_health(const Joint* joints, Health* health) {
    const uint8_t heard = bus_.ask(joints, VOLTAGE_AND_TEMPERATURE, 3);
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (heard & (1u << i)) {
        Reader in(bus_.of(i).parameters, 3);
        health[i].voltage = static_cast<uint8_t>(in.u16());
        health[i].temperature = in.u8();
      }
    }
    return heard;
  }

  // Sends `motors` their orders in one packet, so that they set off together.
  void command(const Joint* joints, const Order* orders, uint8_t motors = ALL) {
    protocol2::Instruction packet(protocol2::BROADCAST, protocol2::SYNC_WRITE);
    packet.put(GOAL_PWM, 2).put(20, 2);
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (!(motors & (1u << i))) {
        continue;
      }
      const Order& o = orders[i];
      packet.put(joints[i].id, 1).put(o.pwm, 2).put(0, 2).put(0, 4);
      packet.put(o.acceleration ? acceleration_units(o.acceleration) : 0, 4);
      packet.put(speed_units(o.speed), 4).put(static_cast<uint32_t>(o.goal), 4);
    }
    bus_.send(packet);
  }

  // Sets the positions that `motors` hold, without a ramp, and then sends all motors their duty
  // limits. The places go first, in a short packet, because the robot may be pressing on somebody.
  void hold(const Joint* joints, const Order* orders, uint8_t motors) {
    protocol2::Instruction packet(protocol2::BROADCAST, protocol2::SYNC_WRITE);
    packet.put(PROFILE_AND_GOAL, 2).put(12, 2);
    uint16_t speed = 0;
    uint16_t units = speed_units(speed);  // most are the same, and a division is slow
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (!(motors & (1u << i))) {
        continue;
      }
      if (orders[i].speed != speed) {
        speed = orders[i].speed;
        units = speed_units(speed);
      }
      packet.put(joints[i].id, 1).put(0, 4).put(units, 4);
      packet.put(static_cast<uint32_t>(orders[i].goal), 4);
    }
    bus_.send(packet);
    set_pwm(joints, orders);
  }

  // Whether all servos report these duty limits.
  bool limited(const Joint* joints, const Order* orders) {
    bool all = bus_.ask(joints, GOAL_PWM, 2) == ALL;
    for (uint8_t i = 0; i < MOTORS; i++) {
      all = all && u16_at(bus_.of(i).parameters) == orders[i].pwm;
    }
    return all;
  }

  // Changes only the duty limits.
  void set_pwm(const Joint* joints, const Order* orders) {
    protocol2::Instruction packet(protocol2::BROADCAST, protocol2::SYNC_WRITE);
    packet.put(GOAL_PWM, 2).put(2, 2);
    for (uint8_t i = 0; i < MOTORS; i++) {
      packet.put(joints[i].id, 1).put(orders[i].pwm, 2);
    }
    bus_.send(packet);
  }

  // The motors that report these orders, and those that answer but report other ones.
  struct Taken {
    uint8_t by;
    uint8_t not_by;
  };
  Taken taken(const Joint* joints, const Order* orders) {
    const uint8_t heard = bus_.ask(joints, PROFILE_AND_GOAL, 12);
    Taken taken = {heard, 0};
    for (uint8_t i = 0; i < MOTORS; i++) {
      const Order& o = orders[i];
      Reader in(bus_.of(i).parameters, 12);
      const uint32_t acceleration = in.u32();
      const uint32_t speed = in.u32();
      if (in.i32() != o.goal || speed != speed_units(o.speed) ||
          acceleration != (o.acceleration ? acceleration_units(o.acceleration) : 0)) {
        taken.by = static_cast<uint8_t>(taken.by & ~(1u << i));
      }
    }
    taken.not_by = static_cast<uint8_t>(heard & ~taken.by);
    return taken;
  }

  // While its watchdog is on, a servo stops by itself after 0.2 s without a packet. Switching it
  // off also ends such a stop.
  void set_bus_watchdog(const Joint* joints, bool on) {
    bus_.write_all(joints, BUS_WATCHDOG, on ? PATIENCE_OF_SERVOS : 0, 1);
  }

  // Whether all servos report that their watchdogs are on.
  bool watched(const Joint* joints) {
    bool all = bus_.ask(joints, BUS_WATCHDOG, 1) == ALL;
    for (uint8_t i = 0; i < MOTORS; i++) {
      all = all && bus_.of(i).parameters[0] == PATIENCE_OF_SERVOS;
    }
    return all;
  }

  void set_torque(const Joint* joints, bool on) { bus_.write_all(joints, TORQUE_ENABLE, on, 1); }

  // The motors that do not confirm that their torque is on.
  uint8_t limp(const Joint* joints) {
    uint8_t limp = static_cast<uint8_t>(~bus_.ask(joints, TORQUE_ENABLE, 1));
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (bus_.of(i).parameters[0] != 1) {
        limp = static_cast<uint8_t>(limp | (1u << i));
      }
    }
    return limp;
  }

  // Gains are lost with the power, and the factory's gains turn the servo into a soft spring.
  void set_gains(const Joint* joints, const Gains& gains) {
    protocol2::Instruction packet(protocol2::BROADCAST, protocol2::SYNC_WRITE);
    packet.put(POSITION_GAINS, 2).put(GAINS_SIZE, 2);
    for (uint8_t i = 0; i < MOTORS; i++) {
      packet.put(joints[i].id, 1).put(gains.d, 2).put(0, 2).put(gains.p, 2);
    }
    bus_.send(packet);
    bus_.write_all(joints, FEED_FORWARD, 0, FEED_SIZE);
  }

  // The motors that do not confirm that they have these gains.
  uint8_t detuned(const Joint* joints, const Gains& gains) {
    uint8_t detuned = static_cast<uint8_t>(~bus_.ask(joints, POSITION_GAINS, GAINS_SIZE));
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (!are(bus_.of(i).parameters, gains)) {
        detuned = static_cast<uint8_t>(detuned | (1u << i));
      }
    }
    detuned = static_cast<uint8_t>(detuned | ~bus_.ask(joints, FEED_FORWARD, FEED_SIZE));
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (!are_nothing(bus_.of(i).parameters)) {
        detuned = static_cast<uint8_t>(detuned | (1u << i));
      }
    }
    return detuned;
  }

  // Whether a servo answers that its torque is off or, if the body `rests`, that it has other gains
  // or a feed-forward; that comes back only together with the factory's gains. With gains.p = 0 the
  // gains are not checked.
  bool restarted(uint8_t id, const Gains& gains, bool rests) {
    if (!bus_.read(id, TORQUE_ENABLE, 1)) {
      return false;
    }
    if (bus_.latest().parameters[0] == 0 || gains.p == 0 || !rests) {
      return bus_.latest().parameters[0] == 0;
    }
    if (bus_.read(id, POSITION_GAINS, GAINS_SIZE) && !are(bus_.latest().parameters, gains)) {
      return true;
    }
    return bus_.read(id, FEED_FORWARD, FEED_SIZE) && !are_nothing(bus_.latest().parameters);
  }

  // Whether a servo answers that its duty limit is not `pwm`.
  bool has_other_pwm(uint8_t id, uint16_t pwm) {
    return bus_.read(id, GOAL_PWM, 2) && u16_at(bus_.latest().parameters) != pwm;
  }

  // Whether the servo that was asked last reports a hardware error.
  bool alarmed() const { return (bus_.latest().error & protocol2::ALERT) != 0; }

  // Where the servos' own profiles are now; a bit per motor that answered.
  uint8_t read_setpoints(const Joint* joints, int32_t* setpoints) {
    const uint8_t heard = bus_.sync_read(joints, POSITION_TRAJECTORY, 4);
    for (uint8_t i = 0; i < MOTORS; i++) {
      setpoints[i] = Reader(bus_.of(i).parameters, 4).i32();
    }
    return heard;
  }

  // Makes sure that a servo works in the mode that this layer needs, and is limp after a loss of
  // power. To change either, its torque is switched off first.
  bool set_mode(uint8_t id) {
    // A byte is lost now and then: a silent servo is asked, or told, once more.
    if (!bus_.read(id, RETURN_DELAY, 3) && !bus_.read(id, RETURN_DELAY, 3)) {
      return false;
    }
    const uint8_t* mode = bus_.latest().parameters;
    const bool right = mode[0] == DELAY && mode[1] == SPEED_PROFILES && mode[2] == POSITION;
    if (!right && !(bus_.write(id, TORQUE_ENABLE, 0) && bus_.write(id, RETURN_DELAY, DELAY) &&
                    bus_.write(id, DRIVE_MODE, SPEED_PROFILES) &&
                    bus_.write(id, OPERATING_MODE, POSITION))) {
      return false;
    }
    if (!bus_.read(id, STARTUP, 1) && !bus_.read(id, STARTUP, 1)) {
      return bus_.refused();  // firmware older than 46 has no such register, and starts limp
    }
    return bus_.latest().parameters[0] == START_LIMP ||
           (bus_.write(id, TORQUE_ENABLE, 0) && bus_.write(id, STARTUP, START_LIMP));
  }

  // Reboots a servo: once it has switched itself off after an error, nothing else restarts it.
  void reboot(uint8_t id) { bus_.reboot(id); }

  // Some of a servo's registers; null where it does not answer, or has none there.
  const uint8_t* peek(uint8_t id, uint8_t address, uint8_t count) {
    return bus_.read(id, address, count) ? bus_.latest().parameters : nullptr;
  }

  // Gives the only servo on the bus, new or not, an id and our bus speed. The servo may have the
  // new id or speed already: an attempt that was interrupted is completed.
  bool identify(uint8_t old_id, uint8_t new_id) {
    // Servos from other projects may be set to 2 Mbit/s, 115,200 or 9,600 bit/s. At 2 Mbit/s the
    // card may miss answers, so it switches such a servo to the card's speed without waiting for
    // any.
    bus_.wait_longer(true);
    bus_.set_speed(2000000);
    bus_.tell_all(TORQUE_ENABLE, 0);
    bus_.tell_all(BAUD_RATE, ONE_MBPS);
    const uint32_t speeds[] = {FACTORY_SPEED, BUS_SPEED, 115200, 9600};
    const uint8_t ids[] = {old_id, new_id};
    for (uint8_t i = 0; i < 8; i++) {
      const uint8_t id = ids[i % 2];
      bus_.set_speed(speeds[i / 2]);
      if (bus_.read(id, ID, 1) || (i < 4 && bus_.read(id, ID, 1))) {
        // A servo may answer an EEPROM write late or never: what counts is that it then answers
        // with the new id at our speed.
        bus_.write(id, TORQUE_ENABLE, 0);
        if (id != new_id && !bus_.write(id, ID, new_id)) {
          bus_.write(id, ID, new_id);
        }
        if (!bus_.write(new_id, BAUD_RATE, ONE_MBPS)) {
          bus_.write(new_id, BAUD_RATE, ONE_MBPS);
        }
        break;
      }
    }
    bus_.set_speed(BUS_SPEED);
    const bool done = set_mode(new_id);
    bus_.wait_longer(false);
    return done;
  }

 private:
  static const uint8_t ID = 7;
  static const uint8_t BAUD_RATE = 8;
  static const uint8_t RETURN_DELAY = 9;  // followed by drive mode and operating mode
  static const uint8_t DRIVE_MODE = 10;
  static const uint8_t OPERATING_MODE = 11;
  static const uint8_t STARTUP = 60;  // may bring back torque, and a goal from a backup, by itself
  static const uint8_t TORQUE_ENABLE = 64;
  static const uint8_t BUS_WATCHDOG = 98;
  static const uint8_t POSITION_GAINS = 80;  // D, I, P, 2 bytes each; nothing is defined after them
  static const uint8_t GAINS_SIZE = 6;
  static const uint8_t FEED_FORWARD = 88;  // of acceleration and speed, 2 bytes each
  static const uint8_t FEED_SIZE = 4;
  static const uint8_t GOAL_PWM = 100;  // followed by goal current, goal speed, PROFILE_AND_GOAL
  static const uint8_t PROFILE_AND_GOAL = 108;
  static const uint8_t SPEED_AND_POSITION = 128;
  static const uint8_t POSITION_TRAJECTORY = 140;
  static const uint8_t VOLTAGE_AND_TEMPERATURE = 144;

  static const int32_t FASTEST = 2000;  // units of speed: more does not fit a Motion
  static const uint8_t PATIENCE_OF_SERVOS = 10;  // in units of 20 ms
  static const uint8_t ONE_MBPS = 3;
  static const uint8_t DELAY = 25;  // in units of 2 µs: for us to turn from sending to listening
  static const uint8_t SPEED_PROFILES = 0;
  static const uint8_t POSITION = 3;
  static const uint8_t START_LIMP = 0;

  static uint16_t speed_units(uint16_t speed) {
    const uint32_t units = (speed * 1000UL + 7816) / 15633;
    return static_cast<uint16_t>(units ? units : 1);
  }
  static uint16_t acceleration_units(uint16_t acceleration) {
    const uint32_t units = (acceleration * 1000UL + 122070) / 244141UL;
    return static_cast<uint16_t>(units ? units : 1);
  }

  static bool are(const uint8_t* registers, const Gains& gains) {
    Reader in(registers, GAINS_SIZE);
    return in.u16() == gains.d && in.u16() == 0 && in.u16() == gains.p;
  }

  static bool are_nothing(const uint8_t* feed_forward) {
    return Reader(feed_forward, FEED_SIZE).u32() == 0;
  }

  Bus<Io> bus_;
  bool missing_ = false;  // a servo did not answer the latest reading
  uint8_t misnamed_ = 0;
};

}  // namespace miburi
