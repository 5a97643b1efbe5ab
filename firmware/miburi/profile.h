// Ramped motion of one motor from rest to rest: speed up, cruise, slow down.
//
// The twin of miburi/motion.py: integer arithmetic throughout, equal to the last bit. Distances
// are encoder steps, speeds 1/256 steps/s, accelerations steps/s², times µs. State and time are
// arguments; nothing here knows of Arduino.
#pragma once

#include <stdint.h>

namespace miburi {

const uint8_t MOTORS = 8;
const int64_t FINE = 256;  // parts of a step in which a position is counted
const int64_t SECOND = 1000000;

struct Profile {
  int32_t distance;
  int32_t speed;
  int32_t acceleration;
  int64_t ramp;
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

// A distance is not negative; a speed and an acceleration are at least 1.
inline Profile plan(int32_t distance, int32_t speed, int32_t acceleration) {
  const int64_t full_ramp = speed * SECOND / (acceleration * FINE);
  // A triangle's ramp is √(d/a); it is one where that is less than the full ramp.
  const int64_t short_ramp =
      static_cast<int64_t>(square_root(static_cast<uint64_t>(distance * SECOND * SECOND / acceleration)));
  if (short_ramp < full_ramp) {
    return Profile{distance, speed, acceleration, short_ramp, 2 * short_ramp};
  }
  return Profile{distance, speed, acceleration, full_ramp, distance * FINE * SECOND / speed + full_ramp};
}

// The largest speed that the motor comes to, 1/256 steps/s; a triangle's is its tip.
inline int32_t fastest(const Profile& p) {
  const int32_t tip = static_cast<int32_t>(p.acceleration * p.ramp * FINE / SECOND);
  return tip < p.speed ? tip : p.speed;
}

// n / (2 · SECOND) for n below 2^55, digit by digit: the card takes a division of 64 bits for longer
// than all the rest of a motor's model.
inline int64_t over_two_seconds(uint64_t n) {
  const uint16_t odd = 15625;  // 2 · SECOND is 128 times that
  n >>= 7;
  const uint32_t high = static_cast<uint32_t>(n >> 16);
  const uint32_t low = ((high % odd) << 16) | static_cast<uint16_t>(n);
  return (static_cast<int64_t>(high / odd) << 16) + low / odd;
}

// Travel in 1/256 steps after `time` µs.
inline int64_t travel(const Profile& p, int64_t time) {
  if (time < 0) {
    return 0;
  }
  const int64_t left = p.total - time;
  if (left < 0) {
    return p.distance * FINE;
  }
  if (time < p.ramp) {
    return p.acceleration * time * time * (FINE / 2) / (SECOND * SECOND);
  }
  if (left <= p.ramp) {
    return p.distance * FINE - p.acceleration * left * left * (FINE / 2) / (SECOND * SECOND);
  }
  return over_two_seconds(static_cast<uint64_t>(p.speed * (2 * time - p.ramp)));
}

}  // namespace miburi
