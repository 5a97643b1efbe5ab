// One body's states and rule: idle → moving → stopped (latched) → returning → idle.
//
// The twin of miburi/bodies/controller.py. It knows joint positions in encoder steps and a clock
// in µs; the servos are told by the caller.
#pragma once

#include "contact.h"

namespace miburi {

enum class Phase : uint8_t { idle, moving, stopped, returning };

enum class Reason : uint8_t {
  none,
  started,     // the card has just been switched on or reset
  asked,       // by the host
  contact,     // the rule saw one: motor, sign, measured, expected
  silent,      // a servo does not answer: motor
  deaf,        // a servo does not take its commands: motor
  faulty,      // a servo reports a hardware error: motor
  hot,         // a servo is too warm: motor
  low_voltage  // the servos' supply is too low: motor
};

const uint8_t NO_MOTOR = 0xff;

// Steps by which each motor goes back the way it came after a contact, and not further than the
// move had brought it: where it stopped, it would go on pressing.
const int32_t GIVE_WAY = 16;

struct Stop {
  Reason reason;
  int64_t time;
  Contact contact;  // contact.motor is the motor of every reason that has one
};

struct Controller {
  Phase phase;
  Stop latched;  // meaningful while stopped
  int16_t origin[MOTORS];
  int16_t goal[MOTORS];
  int64_t began;
  Watch watch;
};

inline void latch(Controller& c, Reason reason, const Contact& contact, const int16_t* positions,
                  int64_t time) {
  c.phase = Phase::stopped;
  c.latched = Stop{reason, time, contact};
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    c.origin[motor] = positions[motor];
  }
}

// Stop and hold where the motors are; a stop that holds already keeps its reason.
inline void stop(Controller& c, Reason reason, uint8_t motor, const int16_t* positions,
                 int64_t time) {
  if (c.phase != Phase::stopped) {
    latch(c, reason, Contact{Sign::none, motor, 0, 0}, positions, time);
  }
}

// Start a motion that the caller has found to be allowed; speeds of 0 count as 1.
inline void start(Controller& c, const Rule& rule, Phase phase, const int16_t* goal,
                  const uint16_t* speeds, uint16_t acceleration, const int16_t* positions,
                  int64_t time) {
  c.phase = phase;
  c.began = time;
  c.watch.period_ends = rule.period;
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    const int32_t way = static_cast<int32_t>(goal[motor]) - c.origin[motor];
    c.goal[motor] = goal[motor];
    c.watch.profile[motor] =
        plan(way < 0 ? -way : way, speeds[motor] > 1 ? speeds[motor] : 1, acceleration);
    c.watch.direction[motor] = way < 0 ? -1 : 1;
    c.watch.start[motor] = positions[motor];
    c.watch.expected[motor] = 0;
    c.watch.measured[motor] = 0;
  }
}

// Speeds of the slow return from `origin` to `goal`, arriving together: the motor with the
// longest way goes at `fastest` steps/s.
inline void return_speeds(const int16_t* origin, const int16_t* goal, uint16_t fastest,
                          uint16_t* speeds) {
  int32_t longest = 1;
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    const int32_t way = distance_between(goal[motor], origin[motor]);
    longest = way > longest ? way : longest;
  }
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    const int32_t way = distance_between(goal[motor], origin[motor]);
    speeds[motor] = static_cast<uint16_t>(static_cast<int64_t>(way) * fastest / longest);
  }
}

// The position to hold after a contact.
inline int16_t given_way(const Watch& watch, uint8_t motor, const int16_t* positions) {
  const int32_t way = travelled(watch, motor, positions) / static_cast<int32_t>(FINE);
  const int32_t back = way < 0 ? 0 : way > GIVE_WAY ? GIVE_WAY : way;
  return static_cast<int16_t>(positions[motor] - watch.direction[motor] * back);
}

// Look at the motors: judge them, and notice when the goal is reached.
inline void update(Controller& c, const Rule& rule, const int16_t* positions, int64_t time) {
  if (c.phase != Phase::moving && c.phase != Phase::returning) {
    return;
  }
  const int64_t elapsed = time - c.began;
  const Contact contact = look(c.watch, rule, positions, elapsed);
  if (contact.sign != Sign::none) {
    latch(c, Reason::contact, contact, positions, time);
    for (uint8_t motor = 0; motor < MOTORS; motor++) {
      c.origin[motor] = given_way(c.watch, motor, positions);
    }
    return;
  }
  if (arrived(c.watch, rule, positions, elapsed)) {
    for (uint8_t motor = 0; motor < MOTORS; motor++) {
      c.origin[motor] = c.goal[motor];
    }
    c.phase = Phase::idle;
  }
}

}  // namespace miburi
