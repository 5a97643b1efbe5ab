// Holds a stopped body softly where it is, and knows whether all servos have confirmed that.
//
// A motor whose place is not known gets no goal. A motor that was silent too long is held where it
// is found again, since nobody knows how far it went meanwhile.
#pragma once

#include "controller.h"
#include "readings.h"
#include "settings.h"

namespace miburi {

template <class Servos>
class Hold {
 public:
  Hold(Servos& servos, const Readings<Servos>& readings, Controller& controller)
      : servos_(servos), readings_(readings), controller_(controller) {}

  // Whether the servos are known to have their orders, and torque.
  bool holds() const { return told_ && loose_ == 0; }
  // Whether they are known to have their orders.
  bool told() const { return told_; }
  // Whether torque was taken off on purpose.
  bool limp() const { return limp_; }
  // The motors that are not known to have torque.
  uint8_t loose() const { return loose_; }

  void set_loose(uint8_t motors) { loose_ = motors; }
  void renew() { told_ = false; }
  // These motors are to be held where they are found, not where they were.
  void unpin(uint8_t motors) { pinned_ = static_cast<uint8_t>(pinned_ & ~motors); }
  void move_on() {
    told_ = false;
    creeps_ = 0;
  }
  void let_go() {
    limp_ = true;
    told_ = false;
    loose_ = ALL;
  }
  // Prepares a release. The servos' own watchdogs may have stopped them, which is cleared first.
  void take_up() {
    limp_ = told_ = false;
    stopped_themselves_ = true;
  }
  // Under new settings, known positions and the positions to hold mean something else, so they are
  // discarded.
  void forget() {
    told_ = false;
    pinned_ = 0;
    loose_ = ALL;
  }

  // Keeps a stopped body held; called at every reading.
  void stay(const Table& table, Order* orders) {
    if (pinned_ & ~readings_.known()) {
      told_ = false;
      stopped_themselves_ = doubted_ = true;
    }
    tell(table, orders, table.settings.max_speed);
  }

  // Tells the servos where to hold, until they are known to do so. They go there at no more than
  // `speed`, and without a ramp: with one they would overshoot.
  void tell(const Table& table, Order* orders, uint16_t speed) {
    if (told_ || limp_) {
      return;
    }
    const uint8_t found = readings_.known() & ~pinned_;
    pinned_ = readings_.known();
    for (uint8_t i = 0; i < MOTORS; i++) {
      orders[i].pwm = table.settings.hold_pwm;
    }
    if (stopped_themselves_) {
      servos_.set_bus_watchdog(table.joints, false);
    }
    // A motor that gets no goal finishes its motion, with little force if it received the new duty
    // limit.
    if (pinned_ != ALL) {
      servos_.set_pwm(table.joints, orders);
    }
    adopt_places(table, found);
    for (uint8_t i = 0; i < MOTORS; i++) {
      const bool creeps = (creeps_ & (1u << i)) && speed > CREEP;
      orders[i] = Order{table.settings.hold_pwm, creeps ? CREEP : speed, 0,
                        to_servo(table.joints[i], controller_.origin[i])};
    }
    servos_.hold(table.joints, orders, pinned_);
    told_ = pinned_ == ALL && servos_.taken(table.joints, orders).by == ALL &&
            servos_.limited(table.joints, orders);
    servos_.set_bus_watchdog(table.joints, true);
    told_ = told_ && servos_.watched(table.joints);
    // A motor that was silent may have been without power, too.
    told_ = told_ && !(doubted_ && loose_ == 0 && servos_.limp(table.joints) != 0);
    doubted_ = doubted_ && !told_;
    stopped_themselves_ = !told_;
    if (told_) {
      for (uint8_t i = 0; i < MOTORS; i++) {
        controller_.goal[i] = controller_.origin[i];
      }
      // After a card was reset, its servos may still have torque, so they are asked.
      loose_ = loose_ != 0 ? servos_.limp(table.joints) : 0;
    }
  }

 private:
  static const uint16_t CREEP = 187;  // steps/s (0.29 rad/s) to where a motor was found again

  // Chooses where to hold the motors that were `found` again. A motor with torque sags from the
  // setpoint of its servo's own profile, or is on its way there, so it is held nearer to that
  // setpoint than its angle is.
  void adopt_places(const Table& table, uint8_t found) {
    if (found == 0) {
      return;
    }
    int32_t setpoints[MOTORS];
    const uint8_t known = servos_.read_setpoints(table.joints, setpoints) & ~loose_;
    for (uint8_t i = 0; i < MOTORS; i++) {
      if (!(found & (1u << i))) {
        continue;
      }
      const Joint& joint = table.joints[i];
      int32_t here = readings_.angles()[i];
      if (known & (1u << i)) {
        // The motor's lag and the age of the reading come to 1/16 s together. If a motor is further
        // from its setpoint than it travels in that time, something blocks it, and it must not
        // push.
        const int16_t speed = readings_.speed(i);
        const int32_t most = GIVE_WAY + (speed < 0 ? -speed : speed) / 16;
        here += clamped(to_joint(joint, setpoints[i]) - here, most);
      }
      controller_.origin[i] = inside(joint, static_cast<int16_t>(here));
    }
    creeps_ = static_cast<uint8_t>(creeps_ | found);
  }

  Servos& servos_;
  const Readings<Servos>& readings_;
  Controller& controller_;

  bool told_ = false;
  bool limp_ = false;
  bool stopped_themselves_ = false;  // the servos' watchdogs have, or may have, stopped them
  bool doubted_ = false;             // the servos were silent, so their torque is in doubt
  uint8_t pinned_ = 0;               // motors for which controller.origin says where to hold
  uint8_t creeps_ = 0;               // motors that were found again since the latest motion
  uint8_t loose_ = ALL;
};

}  // namespace miburi
