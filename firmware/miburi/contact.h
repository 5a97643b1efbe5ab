// The contact rule of Section 2 of the paper: always on, one motor stops all.
//
// The twin of miburi/contact.py, decision for decision. Positions are encoder steps, travels
// 1/256 steps, times µs.
#pragma once

#include "profile.h"

namespace miburi {

const int64_t WHOLE_RATIO = 10000;  // ratio is counted in parts of this
const int64_t LAG_DOUBT = 2000;     // µs by which a servo's lag may differ from move to move

// What the rule grants a motor; found by calibration.
struct Guards {
  int32_t lag;       // µs that it follows behind its profile
  int16_t slack;     // steps that may always be missing
  int16_t least;     // steps expected before it is judged
  int16_t behind;    // steps that it may be behind its profile
  int16_t ahead;     // steps that it may be ahead of it
  int16_t arrival;   // steps that it may be off its goal at the end
};

struct Rule {
  Guards guards[MOTORS];
  int32_t period;  // Eq. 1
  int32_t ratio;   // Eq. 2
};

enum class Sign : uint8_t { none, speed, tracking, arrival };

struct Contact {
  Sign sign;
  uint8_t motor;
  int32_t measured;
  int32_t expected;
  int64_t length;  // µs in which the motor travelled so
};

// The rule's view of one move.
struct Watch {
  int64_t period_ends;
  Profile profile[MOTORS];
  int16_t start[MOTORS];
  int8_t direction[MOTORS];  // +1 or -1
  int32_t expected[MOTORS];  // at the end of the last period in which the motor was judged
  int32_t measured[MOTORS];
  int64_t since[MOTORS];  // when that was
  int32_t doubt[MOTORS];  // what LAG_DOUBT is at the move's top speed
};

inline int32_t distance_between(int32_t a, int32_t b) { return a < b ? b - a : a - b; }

inline int32_t lag_doubt(const Profile& profile) {
  return static_cast<int32_t>(fastest(profile) * LAG_DOUBT / SECOND);
}

inline int32_t travelled(const Watch& watch, uint8_t motor, const int16_t* positions) {
  return (static_cast<int32_t>(positions[motor]) - watch.start[motor]) * watch.direction[motor] *
         static_cast<int32_t>(FINE);
}

// Keeps the suspect that fell furthest behind; of equals, the first.
inline void suspect(Contact& worst, const Contact& met) {
  if (worst.sign == Sign::none || distance_between(met.measured, met.expected) >
                                      distance_between(worst.measured, worst.expected)) {
    worst = met;
  }
}

// Judge the motors' positions `time` µs after the move began; at every reading.
inline Contact look(Watch& watch, const Rule& rule, const int16_t* positions, int64_t time) {
  const int32_t fine = static_cast<int32_t>(FINE);
  Contact slow = {Sign::none, 0, 0, 0, 0};
  Contact astray = slow;
  Contact missing = slow;
  const bool due = time >= watch.period_ends;
  if (due) {
    watch.period_ends += rule.period;
  }
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    const Guards& guards = rule.guards[motor];
    const Profile& profile = watch.profile[motor];
    const int32_t expected = static_cast<int32_t>(travel(profile, time - guards.lag));
    const int32_t measured = travelled(watch, motor, positions);
    const int32_t should = expected - watch.expected[motor];
    const int32_t did = measured - watch.measured[motor];
    const int64_t length = time - watch.since[motor];
    if (should >= guards.least * fine) {
      if (due) {
        watch.expected[motor] = expected;
        watch.measured[motor] = measured;
        watch.since[motor] = time;
      }
      if ((did + guards.slack * fine) * WHOLE_RATIO < static_cast<int64_t>(should) * rule.ratio) {
        suspect(slow, Contact{Sign::speed, motor, did, should, length});
      }
    }
    const int32_t behind = expected - measured;
    const int32_t doubt = watch.doubt[motor];
    if (behind > guards.behind * fine + doubt || -behind > guards.ahead * fine + doubt) {
      suspect(astray, Contact{Sign::tracking, motor, measured, expected, time});
    }
    const int32_t goal = profile.distance * fine;
    if (time >= profile.total + guards.lag + rule.period &&
        distance_between(goal, measured) > guards.arrival * fine) {
      suspect(missing, Contact{Sign::arrival, motor, measured, goal, time});
    }
  }
  if (slow.sign != Sign::none) {
    return slow;
  }
  if (astray.sign != Sign::none) {
    return astray;
  }
  return missing;
}

// Whether every profile has ended and every motor is at its goal.
inline bool arrived(const Watch& watch, const Rule& rule, const int16_t* positions, int64_t time) {
  const int32_t fine = static_cast<int32_t>(FINE);
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    const Guards& guards = rule.guards[motor];
    const Profile& profile = watch.profile[motor];
    if (time < profile.total + guards.lag ||
        distance_between(profile.distance * fine, travelled(watch, motor, positions)) >
            guards.arrival * fine) {
      return false;
    }
  }
  return true;
}

}  // namespace miburi
