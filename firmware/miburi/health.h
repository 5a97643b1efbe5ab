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
  // gains of its own: one is looked at after each reading, in every phase. `motor` may name one that
  // is to be looked at now. Motors that are `loose` have no torque to lose; `gains` are those that
  // were written.
  Reason look(const Table& table, const Gains& gains, uint8_t loose, uint8_t& motor) {
    if (motor == NO_MOTOR) {
      polls_++;
      if (polls_ % HEALTH_POLLS == 0) {
        return measure(table, motor);
      }
      // No motor's turn falls to a look at the health.
      motor = static_cast<uint8_t>((polls_ - polls_ / HEALTH_POLLS) % MOTORS);
    }
    if ((loose & (1u << motor)) || !servos_.restarted(table.joints[motor].id, gains)) {
      return Reason::none;
    }
    return servos_.alarmed() ? Reason::faulty : Reason::restarted;
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
  static const int32_t HEALTH_POLLS = 20;  // readings from one look at the health to the next

  Servos& servos_;
  Health health_[MOTORS] = {};
  uint16_t polls_ = 0;
};

}  // namespace miburi
