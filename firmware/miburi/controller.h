// One body's states and rule: idle → moving → stopped (latched) → returning → idle. A move may
// replace one that is still running. A body at rest also becomes stopped if somebody pushes it.
//
// The twin of miburi/safety/controller.py. It knows joint positions in encoder steps and a clock
// in µs; the caller commands the servos.
#pragma once

#include "contact.h"

namespace miburi {

enum class Phase : uint8_t { idle, moving, stopped, returning };

enum class Reason : uint8_t {
  none,
  started,     // the card has just been switched on or reset
  asked,       // by the host
  contact,     // the rule saw one: motor, sign, measured, expected, length
  // For the reasons from here on, except `alone`, the stop's contact holds the motor concerned.
  silent,      // a servo does not answer
  deaf,        // a servo does not take its commands
  faulty,      // a servo reports a hardware error
  hot,         // a servo is too warm
  low_voltage,  // the servos' supply is too low
  astray,      // a servo reports a place where it cannot be
  misnamed,    // a servo answers with another's id
  restarted,   // a servo has restarted, and has no torque
  outside,     // at a release, a joint is outside its limits
  alone,       // idle, and the host has been silent for too long
  touched      // idle, and pushed from where it rested
};

const uint8_t NO_MOTOR = 0xff;

// Held where it stopped, a robot would go on pressing. So after a contact all motors go back the
// way they came, until the one that met something has given way by GIVE_WAY steps; no motor goes
// back further than FURTHEST steps.
const int32_t GIVE_WAY = 16;
const int32_t FURTHEST = 48;  // below 2^6

// A motor yields by holding the position to which it was pushed, instead of pushing back. A motor
// yields if somebody still keeps it from its place this many µs after a contact; it does so once
// per contact, so that no load can pull it further and further. If a motor of a body at rest is
// pushed away for the same time, the body becomes stopped and yields again and again: a person
// guides it (leads it).
const int64_t YIELD_AFTER = 150000;
// How often a led body yields in a row, at most. Without a limit, a motor that turns backwards or
// reports a wrong place would go on for ever.
const uint8_t YIELDS = 20;
// A led motor yields to a displacement of more than this many steps, because an encoder's last
// digit flickers.
const int32_t NOTICED = 1;

// A motor that goes further than MOVES steps between two readings is moving. Two readings give its
// speed if they are at most TELLS µs apart, and the later one is at most TELLS µs old. An apparent
// speed above SWINGS steps/s is not a motion but a correction of the assumed position.
const int32_t MOVES = 2;
const int32_t TELLS = 60000;
const int32_t SWINGS = 4000;

// For this many µs after the longest ramp, motors keep the duty limit of their acceleration: they
// lag behind their profiles, and what they carry swings.
const int64_t EASES_AFTER = 60000;

struct Stop {
  Reason reason;
  int64_t time;
  Contact contact;  // contact.motor is set whenever the reason concerns a motor
};

struct Controller {
  Phase phase;
  Stop latched;  // meaningful while stopped
  int64_t yields_at;  // when it yields next, while stopped by a contact or a touch; 0: never
  uint8_t yields;      // how many yields are left; back to YIELDS once no motor is kept away
  int64_t kept_since;  // when a motor at rest was first kept from its place; 0: none is
  int16_t rest[MOTORS];  // where the motors came to rest
  int16_t origin[MOTORS];
  int16_t goal[MOTORS];
  int16_t sag[MOTORS];  // how far the motors hung from their goals when last at rest
  int64_t began;
  int32_t late[MOTORS];  // µs from `began` until each motor heard of the move
  int16_t seen[MOTORS];   // the latest reading
  int16_t moved[MOTORS];  // its change since the reading before
  int64_t seen_at;        // its time
  int32_t gap;            // µs since the reading before
  Watch watch;
};

// Notes a reading without judging it: two in a row tell how fast the motors are.
inline void note(Controller& c, const int16_t* positions, int64_t time) {
  const int64_t gap = time - c.seen_at;
  if (gap <= 0) {
    return;
  }
  c.gap = static_cast<int32_t>(gap > TELLS ? TELLS + 1 : gap);
  c.seen_at = time;
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    const int32_t moved = static_cast<int32_t>(positions[motor]) - c.seen[motor];
    c.moved[motor] = static_cast<int16_t>(clamped(moved, 0x7FFF));
    c.seen[motor] = positions[motor];
  }
}

// Notes in `loading` a motor's speed along its way, and how far it has gone since the last reading.
// Both are 0 if the readings cannot tell, or if the move does not start where the reading was.
inline void note_drift(const Controller& c, uint8_t motor, int16_t position, int64_t time,
                       Loading& loading) {
  const int64_t age = time - c.seen_at;
  const int32_t moved = static_cast<int32_t>(c.moved[motor]) * c.watch.direction[motor];
  loading.velocity = loading.gone = 0;
  if (age > TELLS || c.gap > TELLS || position != c.seen[motor] ||
      distance_between(moved, 0) <= MOVES) {
    return;
  }
  const int64_t fast = static_cast<int64_t>(moved) * FINE * SECOND / c.gap;
  if (fast <= SWINGS * FINE && fast >= -SWINGS * FINE) {
    loading.velocity = static_cast<int32_t>(fast);
    loading.gone = static_cast<int32_t>(fast * age / SECOND);
  }
}

// Notes how far a motor hangs from its goal. When it is stopped, its goal stays that far above it:
// otherwise it would sink under its load, onto the person that it touches.
inline void note_sag(Controller& c, uint8_t motor, const int16_t* positions) {
  const int32_t sag = static_cast<int32_t>(c.origin[motor]) - positions[motor];
  c.sag[motor] = static_cast<int16_t>(sag > GIVE_WAY ? GIVE_WAY : sag < -GIVE_WAY ? -GIVE_WAY : sag);
}

// The goal that holds a motor where it is, under its load.
inline int16_t goal_here(const Controller& c, uint8_t motor, const int16_t* positions) {
  return static_cast<int16_t>(positions[motor] + c.sag[motor]);
}

inline void latch(Controller& c, Reason reason, const Contact& contact, const int16_t* positions,
                  int64_t time) {
  c.phase = Phase::stopped;
  c.latched = Stop{reason, time, contact};
  c.yields_at = c.kept_since = 0;
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    c.origin[motor] = goal_here(c, motor, positions);
  }
}

// Replaces a stop's reason. The first one usually stays, but not once motors are no longer held.
inline void lose(Controller& c, Reason reason, uint8_t motor, int64_t time) {
  c.latched = Stop{reason, time, Contact{Sign::none, motor, 0, 0, 0}};
  c.yields_at = 0;
}

// Whether the latest stop is a touch: a hand leads the body, or has led it.
inline bool led(const Controller& c) { return c.latched.reason == Reason::touched; }

// Stops, and holds the motors where they are. A latched stop keeps its reason. Any other reason
// replaces a touch, because the host releases a touch without a person.
inline void stop(Controller& c, Reason reason, uint8_t motor, const int16_t* positions,
                 int64_t time) {
  if (c.phase != Phase::stopped) {
    latch(c, reason, Contact{Sign::none, motor, 0, 0, 0}, positions, time);
  } else if (led(c)) {
    lose(c, reason, motor, time);
  }
}

// The position error that a motor's load causes at a move's beginning and end, in quarters of a
// step; and how much duty the motor may use: `pwm` until all have sped up, `cruise` after that.
struct Load {
  int8_t begin;
  int8_t end;
  uint16_t pwm;
  uint16_t cruise;
};
const int16_t QUARTER = 64;  // 1/256 steps

// The error that produces the duty `pwm`, in 1/256 steps.
inline int32_t error_of(const Rule& rule, uint16_t pwm) {
  return static_cast<int32_t>((static_cast<uint32_t>(pwm) * rule.error_per_pwm) >> 8);
}

// Starts a motion that the caller has checked; speeds are in 1/256 steps/s, above 0. If it replaces
// another, the motors go on from their present speeds, and the rule keeps what it knows. `late`
// says by how many µs each motor heard of the new move after the others; it followed the old move
// until then.
inline void start(Controller& c, const Rule& rule, Phase phase, const int16_t* goal,
                  const uint32_t* speeds, const Load* loads, uint16_t acceleration,
                  const int16_t* positions, int64_t time, const int32_t* late) {
  const bool goes_on = c.phase == Phase::moving;
  const int64_t elapsed = time - c.began;
  const int32_t fine = static_cast<int32_t>(FINE);
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    int32_t velocity = 0;
    if (goes_on) {
      const Profile& before = c.watch.profile[motor];
      const int64_t until = elapsed + late[motor] - c.late[motor];
      velocity = speed_at(before, until) * c.watch.direction[motor];
      const int32_t went = static_cast<int32_t>(travel(before, until)) * c.watch.direction[motor];
      c.origin[motor] = static_cast<int16_t>((c.origin[motor] * fine + went + fine / 2) >> 8);
    } else {
      note_sag(c, motor, positions);
    }
    c.late[motor] = late[motor];
    c.goal[motor] = goal[motor];
    const int32_t way = static_cast<int32_t>(goal[motor]) - c.origin[motor];
    // A motor's direction depends on where it would stop if it braked now.
    int8_t direction = way * fine < stopping(velocity, acceleration) ? -1 : 1;
    if (goes_on && way == 0 && velocity == 0) {
      direction = c.watch.direction[motor];
    }
    c.watch.profile[motor] = plan(way * direction, static_cast<int32_t>(speeds[motor]), acceleration,
                                  velocity * direction);
    const Load& load = loads[motor];
    if (goes_on) {
      go_on(c.watch, motor, positions[motor], direction, c.seen_at - c.began, elapsed);
    }
    c.watch.direction[motor] = direction;
    c.watch.start[motor] = positions[motor];
    c.watch.loading[motor].offset = (static_cast<int32_t>(c.origin[motor]) - positions[motor]) *
                                    direction * static_cast<int32_t>(FINE);
    const int32_t weight = static_cast<int32_t>(rule.sag[motor]) * QUARTER * direction;
    c.watch.loading[motor].begin = (load.begin * weight) >> 8;
    c.watch.loading[motor].end = (load.end * weight) >> 8;
    c.watch.loading[motor].most = error_of(rule, load.pwm);
    if (goes_on) {
      c.watch.loading[motor].velocity = c.watch.loading[motor].gone = 0;
      grant_on(c.watch, motor, c.seen_at - c.began);
    } else {
      note_drift(c, motor, positions[motor], time, c.watch.loading[motor]);
    }
  }
  c.phase = phase;
  c.began = time;
  c.kept_since = 0;
  if (goes_on) {
    restart(c.watch, elapsed);
  } else {
    begin(c.watch, rule);
  }
}

// Whether all motors have sped up since the latest start: then they need less duty.
inline bool cruises(const Controller& c, int64_t time) {
  int64_t longest = 0;
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    const int64_t ramp = c.watch.profile[motor].ramp;
    longest = ramp > longest ? ramp : longest;
  }
  return time - c.began >= longest + EASES_AFTER;
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

// Moves the goals of stopped motors back after one of them met something.
inline void give_way(const Watch& watch, const Contact& contact, const int16_t* positions,
                     int16_t* goals) {
  const uint8_t met = contact.motor;
  int32_t way[MOTORS];
  int32_t longest = 0;
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    const int32_t came =
        travelled(watch, motor, positions) / static_cast<int32_t>(FINE) + watch.came[motor];
    way[motor] = came > 0 ? came : 0;
    longest = way[motor] > longest ? way[motor] : longest;
  }
  if ((watch.turned & (1u << met)) && way[met] < GIVE_WAY) {
    // The motor has turned round, and has retraced only a little of the replaced move's path. The
    // obstacle is on the side where the modelled servo would be by now.
    const int32_t back = contact.measured < contact.expected ? GIVE_WAY : -GIVE_WAY;
    goals[met] = static_cast<int16_t>(goals[met] - watch.direction[met] * back);
    return;
  }
  // Each motor goes back the same share of its way, so that the body goes back along its path.
  int32_t part = 1;
  int32_t whole = 1;
  if (GIVE_WAY < way[met]) {
    part = GIVE_WAY;
    whole = way[met];
  }
  if (FURTHEST * whole < part * longest) {
    part = FURTHEST;
    whole = longest;
  }
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    if (way[motor] > 0) {
      const int32_t back = small_quotient(way[motor] * part, whole, 6);
      goals[motor] = static_cast<int16_t>(goals[motor] - watch.direction[motor] * back);
    }
  }
}

// The speed of the return, in steps/s: lower after a touch at rest.
inline uint16_t return_speed(const Controller& c, uint16_t usual) {
  return led(c) ? static_cast<uint16_t>(usual * 2u / 5u) : usual;
}

// Stops a body at rest if something keeps a motor from its place.
inline void feel(Controller& c, const Rule& rule, const int16_t* positions, int64_t time) {
  int32_t most = 0;
  uint8_t motor = NO_MOTOR;
  for (uint8_t i = 0; i < MOTORS; i++) {
    const Guards& guards = rule.guards[i];
    const int32_t beyond = distance_between(positions[i], c.rest[i]) -
                           (guards.slack > guards.arrival ? guards.slack : guards.arrival);
    if (beyond > most) {
      most = beyond;
      motor = i;
    }
  }
  if (motor == NO_MOTOR) {
    c.kept_since = 0;
  } else if (c.kept_since == 0) {
    c.kept_since = time;
  } else if (time - c.kept_since >= YIELD_AFTER) {
    latch(c, Reason::touched, Contact{Sign::none, motor, 0, 0, 0}, positions, time);
    c.yields_at = time + YIELD_AFTER;
    c.yields = YIELDS;
  }
}

// Lets displaced motors hold where they are; returns true if any motor does.
inline bool yield(Controller& c, const Rule& rule, const int16_t* positions, int64_t time) {
  if (c.phase != Phase::stopped || c.yields_at == 0 || time < c.yields_at) {
    return false;
  }
  c.yields_at = led(c) ? time + YIELD_AFTER : 0;
  bool kept = false;
  for (uint8_t motor = 0; motor < MOTORS; motor++) {
    const int16_t here = goal_here(c, motor, positions);
    // At rest a motor may stray by half its slack. While a hand guides it the tolerance is small,
    // because the hand would feel it push.
    const int32_t away = distance_between(here, c.origin[motor]);
    if (led(c) ? away > NOTICED : 2 * away > rule.guards[motor].slack) {
      c.origin[motor] = c.yields > 0 ? here : c.origin[motor];
      kept = true;
    }
  }
  const bool yielded = kept && c.yields > 0;
  c.yields = !kept ? YIELDS : yielded ? static_cast<uint8_t>(c.yields - 1) : 0;
  return yielded;
}

// Look at the motors: judge them, and notice when the goal is reached.
inline void update(Controller& c, const Rule& rule, const int16_t* positions, int64_t time) {
  note(c, positions, time);
  if (c.phase == Phase::idle) {
    feel(c, rule, positions, time);
  }
  if (c.phase != Phase::moving && c.phase != Phase::returning) {
    return;
  }
  const int64_t elapsed = time - c.began;
  const Contact contact = look(c.watch, rule, positions, elapsed);
  if (contact.sign != Sign::none) {
    latch(c, Reason::contact, contact, positions, time);
    give_way(c.watch, contact, positions, c.origin);
    c.yields_at = time + YIELD_AFTER;
    c.yields = 1;
    return;
  }
  if (arrived(c.watch, rule, positions, elapsed)) {
    for (uint8_t motor = 0; motor < MOTORS; motor++) {
      c.origin[motor] = c.goal[motor];
      c.rest[motor] = positions[motor];
      note_sag(c, motor, positions);
    }
    c.phase = Phase::idle;
  }
}

}  // namespace miburi
