// How the servos are, apart from where: hot, short of voltage, or restarted and limp.
//
// One look at a time, between two readings, so that the rule's next look is not late.
#pragma once

#include "controller.h"
#include "servo_xl330.h"
#include "settings.h"

namespace miburi {

inline Gains gains_of(const Table& table) {
  return Gains{table.settings.d_gain, table.settings.p_gain};
}

template <class Servos>
class HealthWatch {
 public:
  explicit HealthWatch(Servos& servos) : servos_(servos) {}

  // Looks, after a reading of the motors, at what has its turn; what speaks against going on, with
  // the motor. A servo that lost its power for a moment answers as before, but is limp, and has
  // gains of its own: the rule sees it in motion, and this at rest (`idle`), one servo at each
  // reading, so that the report is out before the next.
  Reason look(const Table& table, bool idle, uint8_t& motor) {
    polls_++;
    if (polls_ % HEALTH_POLLS == 0) {
      return measure(table, motor);
    }
    if (idle) {
      // No motor's turn falls to a look at the health.
      motor = static_cast<uint8_t>((polls_ - polls_ / HEALTH_POLLS) % MOTORS);
      if (servos_.restarted(table.joints[motor].id, gains_of(table))) {
        return Reason::restarted;
      }
    }
    return Reason::none;
  }

  // Reads all temperatures and voltages; what speaks against moving, with the motor.
  Reason measure(const Table& table, uint8_t& motor) {
    const uint8_t measured = servos_.read_health(table.joints, health_);
    for (uint8_t i = 0; i < MOTORS; i++) {
      motor = i;
      if (measured & (1u << i)) {
        if (health_[i].temperature >= table.settings.hottest) {
          return Reason::hot;
        }
        if (health_[i].voltage < table.settings.lowest) {
          return Reason::low_voltage;
        }
      }
    }
    return Reason::none;
  }

  const Health& of(uint8_t motor) const { return health_[motor]; }

 private:
  static const int32_t HEALTH_POLLS = 25;  // readings between two looks at the health

  Servos& servos_;
  Health health_[MOTORS] = {};
  uint16_t polls_ = 0;
};

}  // namespace miburi
