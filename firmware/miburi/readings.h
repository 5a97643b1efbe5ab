// What the servos say: where the joints are, as far as believable, and which servos are missing.
//
// Angles are those of the joints, in encoder steps.
#pragma once

#include "places.h"
#include "servo_xl330.h"
#include "settings.h"

namespace miburi {

template <class Servos>
class Readings {
 public:
  explicit Readings(Servos& servos) : servos_(servos) {}

  // Reads all motors; returns true if every one answered and is believed. `limp`: the motors that
  // somebody may have turned; `held`: the angles at which the others are held; `goals`: those to
  // which they were last sent.
  bool take(const Table& table, int64_t time, uint8_t limp, const int16_t* held,
            const int16_t* goals) {
    uint32_t late;
    heard_ = answered_ = servos_.read_motion(table.joints, motion_, late);
    time += late;
    time_ = time;
    for (uint8_t i = 0; i < MOTORS; i++) {
      const uint8_t bit = static_cast<uint8_t>(1u << i);
      if (time - last_heard_[i] > SILENCE) {
        known_ = static_cast<uint8_t>(known_ & ~bit);
      }
      if (!(answered_ & bit)) {
        continue;
      }
      last_heard_[i] = time;
      const Joint& joint = table.joints[i];
      const bool lost = !(known_ & bit);
      const Elsewhere elsewhere = {(limp & bit) != 0, lost,
                                   to_servo(joint, lost ? goals[i] : held[i])};
      if (believe(places_[i], motion_[i].position, time, table.settings.max_speed, elsewhere)) {
        known_ = static_cast<uint8_t>(known_ | bit);
        angles_[i] = to_joint(joint, places_[i].steps);
      } else {
        heard_ = static_cast<uint8_t>(heard_ & ~bit);
      }
    }
    if (heard_ == ALL) {
      whole_ = time;
    }
    return whole_ == time;
  }

  // Starts over: the same readings mean other angles now.
  void forget(int64_t time) {
    known_ = 0;
    whole_ = time;
    for (uint8_t i = 0; i < MOTORS; i++) {
      places_[i] = Place();
      last_heard_[i] = time;
    }
  }

  void pass(int64_t time) { time_ = time; }  // no servo could be asked

  // The fault that a motor's readings show, or Reason::none.
  Reason fault(uint8_t motor) const {
    if (time_ - last_heard_[motor] > SILENCE) {
      return missing(motor);
    }
    // The rule needs readings of all motors, so one that is missing every now and then blinds it.
    if (time_ - whole_ > SILENCE && !(heard_ & (1u << motor))) {
      return fault_now(motor);
    }
    if ((answered_ & (1u << motor)) && motion_[motor].alert) {
      return Reason::faulty;
    }
    return places_[motor].doubt >= TOO_DOUBTFUL ? Reason::astray : Reason::none;
  }

  // The same, for a motor that must have answered this very reading and be believed.
  Reason fault_now(uint8_t motor) const {
    if (!(heard_ & (1u << motor))) {
      return answered_ & (1u << motor) ? Reason::astray : missing(motor);
    }
    return motion_[motor].alert ? Reason::faulty : Reason::none;
  }

  int64_t time() const { return time_; }
  const int16_t* angles() const { return angles_; }
  int16_t speed(uint8_t motor) const { return motion_[motor].speed; }  // as the servo reports it
  uint8_t heard() const { return heard_; }
  uint8_t known() const { return known_; }

 private:
  static const int32_t SILENCE = 60000;  // µs without an answer: the servo is lost

  // Why a motor does not answer.
  Reason missing(uint8_t motor) const {
    return servos_.misnamed() & (1u << motor) ? Reason::misnamed : Reason::silent;
  }

  Servos& servos_;
  Motion motion_[MOTORS] = {};
  Place places_[MOTORS] = {};
  int16_t angles_[MOTORS] = {};
  int64_t last_heard_[MOTORS] = {};
  int64_t time_ = 0;      // of the latest reading
  int64_t whole_ = 0;     // of the latest in which all were believed
  uint8_t answered_ = 0;  // motors that answered it
  uint8_t heard_ = 0;     // those of them that are believed
  uint8_t known_ = 0;     // motors that have been believed, and have not been silent since
};

}  // namespace miburi
