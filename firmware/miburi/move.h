// The move that the servos carry out: its orders, its loads, and the limits of its duty.
#pragma once

#include "clock.h"
#include "controller.h"
#include "link.h"
#include "servo_xl330.h"
#include "settings.h"

namespace miburi {

const uint8_t COPIES = 3;  // how often an order is sent, at most, if bytes are lost

template <class Io>
class Move {
 public:
  Move(Xl330<Io>& servos, Clock<Io>& clock, Rule& rule, Controller& controller)
      : servos_(servos), clock_(clock), rule_(rule), controller_(controller) {}

  // The present order of each servo.
  Order* orders() { return orders_; }
  // Whether the loads of the next move have been set.
  bool loaded() const { return loaded_; }

  // Sets the loads on the motors in the next move or release, and the limits of their duty: one
  // during the ramp, and one after it. The second must be no higher than the first, and enough to
  // hold the load at the end. The loads that a host sends shift the positions that the contact rule
  // expects by less than 32 steps times the calibrated factor `sag`, so no host can switch the rule
  // off.
  Result set_loads(const Load* loads, Writer& out) {
    for (uint8_t i = 0; i < MOTORS; i++) {
      const Load& load = loads[i];
      const int32_t first = error_of(rule_, load.pwm) / QUARTER;
      const int32_t last = error_of(rule_, load.cruise) / QUARTER;
      if (!within(load.begin, -first, first) || !within(load.end, -last, last) ||
          !within(load.pwm, 1, FULL_PWM) || !within(load.cruise, 1, load.pwm)) {
        out.put(i, 1);
        return Result::range;
      }
      loads_[i] = load;
    }
    loaded_ = true;
    return Result::ok;
  }

  // Starts a move or a return. Returns a bit per motor that answers but does not obey.
  uint8_t go(const Table& table, Phase phase, const int16_t* goal, const uint16_t* speeds,
             const int16_t* angles) {
    const uint16_t acceleration = Xl330<Io>::real_acceleration(table.settings.acceleration);
    uint32_t real[MOTORS];
    for (uint8_t i = 0; i < MOTORS; i++) {
      real[i] = Xl330<Io>::real_speed(speeds[i]);
      cruise_[i] = loads_[i].cruise;
      orders_[i] = Order{loads_[i].pwm, speeds[i], acceleration,
                         to_servo(table.joints[i], goal[i])};
    }
    loaded_ = eased_ = false;
    unlimited_ = 0;
    // An order may be sent again: the rule's clock starts with the first copy that a servo obeyed.
    int64_t began = 0;
    uint8_t waiting = ALL;
    uint8_t deaf = 0;
    int32_t late[MOTORS] = {};
    for (uint8_t copies = 0; copies < COPIES && waiting != 0; copies++) {
      servos_.command(table.joints, orders_, waiting);
      const int64_t sent = clock_.now();
      began = waiting == ALL ? sent : began;
      for (uint8_t i = 0; i < MOTORS; i++) {
        if (waiting & (1u << i)) {
          // A motor that missed a copy that others obeyed starts later than they do.
          late[i] = static_cast<int32_t>(sent - began);
          rule_.guards[i].lag = table.joints[i].guards.lag + late[i];
        }
      }
      const typename Xl330<Io>::Taken taken = servos_.taken(table.joints, orders_);
      waiting = static_cast<uint8_t>(waiting & ~taken.by);
      deaf = waiting & taken.not_by;
    }
    start(controller_, rule_, phase, goal, real, loads_, acceleration, angles, began, late);
    return deaf;
  }

  // After the ramp, limits the duty of each motor to what the rest of the move needs.
  void ease(const Table& table) {
    if (eased_ || !cruises(controller_, clock_.now())) {
      return;
    }
    eased_ = true;
    for (uint8_t i = 0; i < MOTORS; i++) {
      orders_[i].pwm = cruise_[i];
    }
    servos_.set_pwm(table.joints, orders_);
  }

  // Checks whether a servo has accepted its duty limit, and sends the limit again if not. Returns
  // false if the servo has not accepted that either.
  bool limits(const Table& table, uint8_t motor) {
    const uint8_t bit = static_cast<uint8_t>(1u << motor);
    if (!servos_.has_other_pwm(table.joints[motor].id, orders_[motor].pwm)) {
      unlimited_ = static_cast<uint8_t>(unlimited_ & ~bit);
    } else if (unlimited_ & bit) {
      return false;
    } else {
      unlimited_ = static_cast<uint8_t>(unlimited_ | bit);
      servos_.set_pwm(table.joints, orders_);
    }
    return true;
  }

 private:
  Xl330<Io>& servos_;
  Clock<Io>& clock_;
  Rule& rule_;
  Controller& controller_;

  Order orders_[MOTORS] = {};
  Load loads_[MOTORS] = {};
  uint16_t cruise_[MOTORS] = {};  // of this move: the next one's loads may arrive during it
  bool loaded_ = false;           // loads_ has been set for the next move
  bool eased_ = false;            // the motors have their duty limits for the time after the ramp
  uint8_t unlimited_ = 0;         // motors that were without their limit at their latest check
};

}  // namespace miburi
