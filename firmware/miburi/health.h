// The servos' health: whether one is hot, short of voltage, or restarted and limp.
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

  void count_reading() { readings_++; }

  // After a reading of the motors, checks whatever is due; returns the reason why the body must
  // stop, if any, and sets `motor`. A servo that lost its power for a moment answers as before, but
  // is limp and has its default gains, so the servos are checked in turn, in every phase. The
  // caller may set `motor` to one that is to be checked now. Motors that are `loose` have no torque
  // to lose; `gains` are those that were written.
  Reason look(const Table& table, const Gains& gains, uint8_t loose, bool rests,
              uint8_t& motor) {
    if (motor == NO_MOTOR) {
      if (readings_ >= HEALTH_READINGS) {
        return measure(table, motor);
      }
      motor = turn_++ % MOTORS;
    }
    if ((loose & (1u << motor)) || !servos_.restarted(table.joints[motor].id, gains, rests)) {
      return Reason::none;
    }
    return servos_.alarmed() ? Reason::faulty : Reason::restarted;
  }

  // Reads all temperatures and voltages; returns the reason why the body must not move, if any, and
  // sets `motor`.
  Reason measure(const Table& table, uint8_t& motor) {
    readings_ = 0;
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
  static const uint8_t HEALTH_READINGS = 25;  // from one check of the temperatures to the next

  Servos& servos_;
  Health health_[MOTORS] = {};
  uint8_t readings_ = 0;
  uint8_t turn_ = 0;
};

}  // namespace miburi
