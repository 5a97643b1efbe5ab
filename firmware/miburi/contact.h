// The contact rule of the paper's Section 2. It is always on, and a contact of one motor stops all.
//
// The twin of miburi/safety/contact.py and free.py, decision for decision: each motor's speed is
// compared with that of a free servo under the same load. Positions are encoder steps, travels
// 1/256 steps, times µs.
#pragma once

#include "free.h"
#include "profile.h"

namespace miburi {

const int64_t WHOLE_RATIO = 10000;  // what stands for a ratio of 1
const int64_t LAG_DOUBT = 2000;     // µs by which a servo's lag may differ from move to move
const int64_t SETTLES = 200000;     // µs after which swinging at the start has died down
const int32_t FAST = 512 * FINE;    // 1/256 steps/s: at this speed or above, Guards apply in full

// The tolerances that the rule allows a motor, found by calibration.
struct Guards {
  int32_t lag;       // µs by which it lags its profile
  int16_t slack;     // steps of missing travel that are always tolerated
  int16_t least;     // steps expected before it is judged
  int16_t behind;    // steps that it may be behind its profile
  int16_t ahead;     // steps that it may be ahead of it
  int16_t arrival;   // steps that it may be off its goal at the end
};

struct Rule {
  Guards guards[MOTORS];
  FreeServo servos[MOTORS];
  uint16_t sag[MOTORS];  // 1/256: calibrated factor on the error that a load causes
  uint16_t error_per_pwm;  // 1/65536 steps of error for each unit of duty
  int32_t period;  // Eq. 1
  int32_t ratio;   // Eq. 2
};

enum class Sign : uint8_t { none, speed, tracking, arrival };

struct Contact {
  Sign sign;
  uint8_t motor;
  int32_t measured;
  int32_t expected;
  int64_t length;  // µs over which the motor was judged
};

inline int32_t distance_between(int32_t a, int32_t b) { return a < b ? b - a : a - b; }

inline int32_t lag_doubt(const Profile& profile) {
  return static_cast<int32_t>(fastest(profile) * LAG_DOUBT / SECOND);
}

// Returns the share of its guards that applies to a motor, in 1/256: half at rest, all if its
// profile or its own speed reaches FAST.
inline int16_t granted(const Profile& profile, int32_t velocity) {
  const int32_t fine = static_cast<int32_t>(FINE);
  const int32_t own = distance_between(velocity, 0);
  const int32_t top = fastest(profile) < own ? own : fastest(profile);
  return static_cast<int16_t>((fine + fine * (top < FAST ? top : FAST) / FAST) / 2);
}

// The rule's view of one move.
struct Watch {
  int64_t period_ends;
  Profile profile[MOTORS];
  int16_t start[MOTORS];
  int8_t direction[MOTORS];  // +1 or -1
  int32_t expected[MOTORS];  // at the end of the last period in which the motor was judged
  int32_t measured[MOTORS];
  int64_t since[MOTORS];  // when that was
  int32_t doubt[MOTORS];  // distance in LAG_DOUBT µs at the move's top speed
  int32_t early_doubt[MOTORS];  // the same until SETTLES
  int16_t early[MOTORS];  // the share until SETTLES: a motor that swings is granted more
  int16_t share[MOTORS];  // in 1/256, of slack, behind and ahead: less at low speeds
  int64_t modelled;       // time of the model of the free servos, µs into the move
  Loading loading[MOTORS];
  FreeMotion free[MOTORS];
  int32_t profile_then[MOTORS];  // the profiles' distance from the start at that time
  int16_t came[MOTORS];  // steps already made in this direction, in moves that this one replaced
  uint8_t turned;        // motors that went the other way in the replaced move
};

// Sets a motor's guards for a move whose profile and loading are known.
inline void grant(Watch& watch, uint8_t motor) {
  watch.doubt[motor] = watch.early_doubt[motor] = lag_doubt(watch.profile[motor]);
  watch.early[motor] = granted(watch.profile[motor], watch.loading[motor].velocity);
  watch.share[motor] = granted(watch.profile[motor], 0);
}

// Begins a watch over motors that set off now; the caller has set profile, start, direction, load.
inline void begin(Watch& watch, const Rule& rule) {
  watch.period_ends = rule.period;
  watch.modelled = 0;
  watch.turned = 0;
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    watch.expected[motor] = watch.measured[motor] = 0;
    watch.since[motor] = 0;
    grant(watch, motor);
    watch.free[motor] = set_off(watch.loading[motor]);
    watch.profile_then[motor] = watch.loading[motor].offset;
    watch.came[motor] = 0;
  }
}

inline int32_t travelled(const Watch& watch, uint8_t motor, const int16_t* positions) {
  return (static_cast<int32_t>(positions[motor]) - watch.start[motor]) * watch.direction[motor] *
         static_cast<int32_t>(FINE);
}

// Where a loaded motor comes to rest, but for friction.
inline int32_t goal_of(const Watch& watch, uint8_t motor) {
  const Loading& loading = watch.loading[motor];
  return watch.profile[motor].distance * static_cast<int32_t>(FINE) + loading.offset - loading.end;
}

// Advances the model of a free motor by `steps` steps, up to watch.modelled.
inline void follow(Watch& watch, const Rule& rule, uint8_t motor, int32_t steps) {
  const Loading& loading = watch.loading[motor];
  const Profile& profile = watch.profile[motor];
  const int32_t went =
      static_cast<int32_t>(travel(profile, watch.modelled - rule.guards[motor].lag));
  // The load changes linearly along the motor's path; `share` is the fraction covered, in 1/256.
  int32_t sag = loading.begin;
  if (loading.end != loading.begin && profile.distance > 0) {
    // A motor outside the ends of its path would have a fraction below 0 or above 1.
    const int32_t fine = static_cast<int32_t>(FINE);
    const int32_t gone = clipped(went, profile.distance * fine);
    const int32_t share = small_quotient(gone, profile.distance, 9);
    sag += ((loading.end - loading.begin) * share) >> 8;
  }
  const int32_t now = loading.offset + went;
  advance(watch.free[motor], rule.servos[motor], watch.profile_then[motor], now, steps, sag,
          loading.most);
  watch.profile_then[motor] = now;
}

// How far a reading is into the model's next step, in 1/256.
inline int32_t into_step(const Watch& watch, int64_t time) {
  return static_cast<int32_t>(time - watch.modelled) * static_cast<int32_t>(FINE) / MODEL_STEP;
}
// How far a motor should have travelled when `into`/256 of the model's next step have passed.
inline int32_t expected_of(const FreeMotion& free, int32_t into) {
  return (free.x >> 8) + (((free.v >> 8) * into) >> 8);
}

// Carries one motor's watch into a move that replaces the present one, from a new start and perhaps
// in the other direction. Nothing is forgotten, so a hand that holds a motor back is seen however
// often moves replace one another. Only the window of a motor that turns round starts again, at its
// turning point: otherwise it would add up travel in both directions. `seen` is the time from the
// earlier start to the latest reading, and `elapsed` the time from the earlier to the new start;
// both in µs.
inline void go_on(Watch& watch, uint8_t motor, int16_t start, int8_t direction, int64_t seen,
                  int64_t elapsed) {
  const int32_t fine = static_cast<int32_t>(FINE);
  const bool turned = direction != watch.direction[motor];
  const int32_t steps = (static_cast<int32_t>(watch.start[motor]) - start) * direction;
  const int32_t moved = steps * fine;
  const int64_t carried = static_cast<int64_t>(watch.free[motor].x) * (turned ? -1 : 1) +
                          static_cast<int64_t>(moved) * fine;
  const uint8_t bit = static_cast<uint8_t>(1u << motor);
  watch.turned = static_cast<uint8_t>(turned ? watch.turned | bit : watch.turned & ~bit);
  if (turned) {
    watch.expected[motor] = moved - expected_of(watch.free[motor], into_step(watch, seen));
    watch.measured[motor] = 0;
    watch.since[motor] = seen - elapsed;
    watch.came[motor] = 0;
    watch.free[motor].v = -watch.free[motor].v;
    watch.profile_then[motor] = moved - watch.profile_then[motor];
  } else {
    const int32_t came = watch.came[motor] - steps;
    watch.expected[motor] += moved;
    watch.measured[motor] += moved;
    watch.since[motor] -= elapsed;
    watch.came[motor] = static_cast<int16_t>(clipped(came, 0x7FFF));
    watch.profile_then[motor] += moved;
  }
  watch.free[motor].x = static_cast<int32_t>(carried);
  watch.start[motor] = start;
  watch.direction[motor] = direction;
}

// At first allows a motor at least what the replaced move allowed it at its end, `elapsed` µs after
// that move's start: the motor may still be as far behind its profile.
inline void grant_on(Watch& watch, uint8_t motor, int64_t elapsed) {
  const bool early = elapsed < SETTLES;
  const int16_t share = early ? watch.early[motor] : watch.share[motor];
  const int32_t doubt = early ? watch.early_doubt[motor] : watch.doubt[motor];
  grant(watch, motor);
  watch.early[motor] = share > watch.early[motor] ? share : watch.early[motor];
  watch.early_doubt[motor] = doubt > watch.early_doubt[motor] ? doubt : watch.early_doubt[motor];
}

// Restarts the clock of a watch whose move was replaced.
inline void restart(Watch& watch, int64_t elapsed) {
  watch.period_ends -= elapsed;
  watch.modelled -= elapsed;
}

// Keeps the contact that deviates most from what was expected; on a tie, the first.
inline void suspect(Contact& worst, const Contact& met) {
  if (worst.sign == Sign::none || distance_between(met.measured, met.expected) >
                                      distance_between(worst.measured, worst.expected)) {
    worst = met;
  }
}

// Called at every reading: judges the positions `time` µs after the move began, and returns a
// contact, if any.
inline Contact look(Watch& watch, const Rule& rule, const int16_t* positions, int64_t time) {
  const int32_t fine = static_cast<int32_t>(FINE);
  Contact slow = {Sign::none, 0, 0, 0, 0};
  Contact astray = slow;
  Contact missing = slow;
  const bool due = time >= watch.period_ends;
  if (due) {
    watch.period_ends += rule.period;
  }
  const int32_t steps = static_cast<int32_t>(time - watch.modelled) / MODEL_STEP;
  watch.modelled += static_cast<int64_t>(steps) * MODEL_STEP;
  const int32_t into = into_step(watch, time);
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    const Guards& guards = rule.guards[motor];
    if (steps > 0) {
      follow(watch, rule, motor, steps);
    }
    const int32_t expected = expected_of(watch.free[motor], into);
    const int32_t measured = travelled(watch, motor, positions);
    const int32_t share = time < SETTLES ? watch.early[motor] : watch.share[motor];
    if ((watch.turned & (1u << motor)) && expected < watch.expected[motor]) {
      watch.expected[motor] = expected;  // the motor is still on its way to the turning point
      watch.measured[motor] = measured;
      watch.since[motor] = time;
    }
    const int32_t should = expected - watch.expected[motor];
    const int32_t did = measured - watch.measured[motor];
    const int64_t length = time - watch.since[motor];
    if (should >= guards.least * fine) {
      if (due) {
        watch.expected[motor] = expected;
        watch.measured[motor] = measured;
        watch.since[motor] = time;
      }
      if ((did + guards.slack * share) * WHOLE_RATIO < static_cast<int64_t>(should) * rule.ratio) {
        suspect(slow, Contact{Sign::speed, motor, did, should, length});
      }
    }
    const int32_t behind = expected - measured;
    const int32_t doubt = time < SETTLES ? watch.early_doubt[motor] : watch.doubt[motor];
    if (behind > guards.behind * share + doubt || -behind > guards.ahead * share + doubt) {
      suspect(astray, Contact{Sign::tracking, motor, measured, expected, time});
    }
    const int32_t goal = goal_of(watch, motor);
    if (time >= watch.profile[motor].total + guards.lag + rule.period &&
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
    if (time < watch.profile[motor].total + guards.lag ||
        distance_between(goal_of(watch, motor), travelled(watch, motor, positions)) >
            guards.arrival * fine) {
      return false;
    }
  }
  return true;
}

}  // namespace miburi
