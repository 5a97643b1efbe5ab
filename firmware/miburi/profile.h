// Ramped motion of one motor until it rests: speed up, cruise, slow down.
//
// The twin of miburi/safety/profile.py: integer arithmetic throughout, equal to the last bit.
// Distances are encoder steps, speeds 1/256 steps/s, accelerations steps/s², times µs. State and
// time are arguments; nothing here knows of Arduino.
#pragma once

#include <stdint.h>

namespace miburi {

const uint8_t MOTORS = 8;
const int64_t FINE = 256;  // parts of a step, in which positions are counted
const int64_t SECOND = 1000000;

struct Profile {
  int32_t distance;
  int32_t speed;
  int32_t acceleration;
  int32_t initial;  // speed at the start, if the move replaced another
  int8_t slows;     // -1 if the first ramp slows down from that speed, else 1
  int64_t ramp;     // to the cruising speed
  int64_t fall;     // from there to rest
  int64_t shift;    // twice the delay against a move that begins at cruising speed
  int64_t total;
};

// Largest whole number whose square is not above n.
inline uint64_t square_root(uint64_t n) {
  uint64_t root = 0;
  for (uint64_t bit = 1ULL << 62; bit != 0; bit >>= 2) {
    const uint64_t trial = root + bit;
    root >>= 1;
    if (n >= trial) {
      n -= trial;
      root += bit;
    }
  }
  return root;
}

// The top speed, 1/256 steps/s. A short move has no cruise: its profile is a triangle, and this is
// the speed at its tip.
inline int32_t tip_of(const Profile& p) {
  const int32_t tip = static_cast<int32_t>(p.acceleration * p.fall * FINE / SECOND);
  return tip < p.speed ? tip : p.speed;
}

inline int32_t size_of(int32_t speed) { return speed < 0 ? -speed : speed; }

// The largest speed during the move.
inline int32_t fastest(const Profile& p) {
  const int32_t tip = tip_of(p);
  const int32_t initial = size_of(p.initial);
  return tip < initial ? initial : tip;
}

// Stopping distance of a motor at a speed, 1/256 steps.
inline int32_t stopping(int32_t speed, int32_t acceleration) {
  const int64_t square = static_cast<int64_t>(speed) * size_of(speed);
  return static_cast<int32_t>(square / (2 * FINE * acceleration));
}

// Speed and acceleration are at least 1. If a motor with an initial speed cannot stop within the
// distance, the caller negates both, and the motor overshoots and comes back.
inline Profile plan(int32_t distance, int32_t speed, int32_t acceleration, int32_t initial = 0) {
  const int64_t full = speed * SECOND / (acceleration * FINE);
  const int64_t halt = initial * SECOND / (acceleration * FINE);  // from that speed to rest
  // A triangle's last ramp is √(d/a + halt²/2); if that is below the full ramp, the profile is a
  // triangle.
  const int64_t square = distance * SECOND * SECOND / acceleration + halt * halt / 2;
  const int64_t tip =
      square > 0 ? static_cast<int64_t>(square_root(static_cast<uint64_t>(square))) : 0;
  Profile p = Profile();
  p.distance = distance;
  p.speed = speed;
  p.acceleration = acceleration;
  p.initial = initial;
  if (tip < full) {
    p.fall = tip;
    p.ramp = tip > halt ? tip - halt : 0;
    p.total = p.ramp + p.fall;
  } else {
    p.fall = full;
    p.ramp = full > halt ? full - halt : halt - full;
    p.shift = p.ramp * (speed - initial) / speed;
    p.total = distance * FINE * SECOND / speed + (p.shift + full) / 2;
  }
  p.slows = initial > tip_of(p) ? -1 : 1;
  return p;
}

// The motor's speed after `time` µs, 1/256 steps/s.
inline int32_t speed_at(const Profile& p, int64_t time) {
  const int64_t left = p.total - time;
  if (left < 0) {
    return 0;
  }
  if (time < p.ramp) {
    return p.initial + p.slows * static_cast<int32_t>(p.acceleration * time * FINE / SECOND);
  }
  return left <= p.fall ? static_cast<int32_t>(p.acceleration * left * FINE / SECOND) : p.speed;
}

// a / b, bit by bit, for a quotient of at most `bits` bits; 16 bits take a third of a division's time.
inline int32_t small_quotient(int32_t a, int32_t b, uint8_t bits) {
  uint16_t quotient = 0;
  for (b <<= bits; bits != 0; bits--) {
    b >>= 1;
    quotient = static_cast<uint16_t>(quotient << 1);
    if (a >= b) {
      a -= b;
      quotient = static_cast<uint16_t>(quotient | 1u);
    }
  }
  return quotient;
}

// n / (2 · SECOND) for n below 2^45, which holds because no motor goes as far as 2^16 steps. A
// 64-bit division takes the card longer than all the rest of a motor's model.
inline int32_t over_two_seconds(uint64_t n) {
  const int32_t odd = 15625;  // 2 · SECOND is 128 times that
  n >>= 7;
  const int32_t high = static_cast<int32_t>(n >> 16);
  const int32_t digit = small_quotient(high, odd, 8);
  const int32_t rest = high - digit * odd;
  return (digit << 16) + small_quotient((rest << 16) | static_cast<uint16_t>(n), odd, 16);
}

// How far a motor at `speed` goes in half of `twice` µs, in 1/256 steps, rounded towards zero.
inline int64_t way_of(int32_t speed, int64_t twice) {
  const int64_t way = speed * twice;
  return way < 0 ? -over_two_seconds(static_cast<uint64_t>(-way))
                 : over_two_seconds(static_cast<uint64_t>(way));
}

// Travel in 1/256 steps after `time` µs. Before the start, the motor is assumed to have moved at
// its initial speed.
inline int64_t travel(const Profile& p, int64_t time) {
  if (time < 0) {
    return way_of(p.initial, 2 * time);
  }
  const int64_t left = p.total - time;
  if (left < 0) {
    return p.distance * FINE;
  }
  if (time < p.ramp) {
    const int64_t risen = p.acceleration * time * time * (FINE / 2) / (SECOND * SECOND);
    return way_of(p.initial, 2 * time) + p.slows * risen;
  }
  if (left <= p.fall) {
    return p.distance * FINE - p.acceleration * left * left * (FINE / 2) / (SECOND * SECOND);
  }
  return way_of(p.speed, 2 * time - p.shift);
}

}  // namespace miburi
