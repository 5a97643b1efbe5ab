// How a free servo would move with nobody in its way: what the contact rule compares motors with.
//
// The twin of miburi/servos/free.py, to the last bit. Errors and loads are 1/256 encoder steps;
// positions are 1/65536 steps, and speeds 1/65536 steps per 5 ms.
#pragma once

#include <stdint.h>

namespace miburi {

const int32_t MODEL_STEP = 5000;  // µs

// The model's limits, so that nothing overflows: 128 steps in 5 ms (six turns a second), and four
// turns from the start. No free servo reaches them; one without friction would, at full duty.
const int32_t MODEL_FASTEST = 0x7FFFFF;
const int32_t MODEL_FARTHEST = 0x40000000;

// The model of a motor with its joint; its constants are found by calibration.
struct FreeServo {
  uint16_t pull;      // 1/65536: how much an error changes the speed in a MODEL_STEP
  uint16_t brake;     // 1/65536: by how much damping reduces the speed in a MODEL_STEP
  uint16_t friction;  // by how much dry friction reduces the speed in a MODEL_STEP
  uint8_t lost;       // 1/256: the share of the motor's torque that the gears take
};

// One motor's conditions during a move: its start, the load along its path, its duty cycle's limit.
struct Loading {
  int32_t offset;  // from where the motor is at the start to the origin of its profile
  int32_t begin;   // the error that the load causes at the beginning …
  int32_t end;     // … and at the end
  int32_t most;    // the error at which the duty reaches its limit
  int32_t velocity;  // of the motor at the start, 1/256 steps/s: it may still swing
  int32_t gone;      // 1/256 steps travelled since the reading of its position
};

struct FreeMotion {
  int32_t x;
  int32_t v;
};

inline int32_t clamped(int32_t value, int32_t most) {
  return value > most ? most : value < -most ? -most : value;
}

inline int32_t clipped(int32_t value, int32_t most) {
  if (value < 0) {
    return 0;
  }
  return value > most ? most : value;
}

// A free motor at the start of a move; it is no faster than 4000 steps/s.
inline FreeMotion set_off(const Loading& loading) {
  return FreeMotion{loading.gone * 256, loading.velocity * 32 / 25};
}

// Advances the model by `steps` MODEL_STEPs, while the profile goes from `before` to `now`.
inline void advance(FreeMotion& motion, const FreeServo& servo, int32_t before, int32_t now,
                    int32_t steps, int32_t sag, int32_t most) {
  const int32_t weight = (servo.pull * sag) >> 8;
  // After k steps the profile has gone (now - before) · k / steps. A division for each step would
  // take the card as long as everything else, so additions are used. The usual four steps need none
  // at all. Where the profile runs backwards, the remainder is made positive.
  int32_t part = steps == 4 ? (now - before) >> 2 : (now - before) / steps;
  int32_t left = now - before - part * steps;
  if (left < 0) {
    left += steps;
    part--;
  }
  int32_t way = before;
  int32_t more = 0;
  for (int32_t k = 1; k <= steps; k++) {
    way += part;
    more += left;
    if (more >= steps) {
      more -= steps;
      way++;
    }
    const int32_t error = clamped(way - (motion.x >> 8), most);
    const int32_t motor = ((servo.pull * error) >> 8) - ((servo.brake * (motion.v >> 8)) >> 8);
    const int32_t speed = motion.v + motor - weight;
    const int32_t lost = (servo.lost * (motor < 0 ? -motor : motor)) >> 8;
    const int32_t taken = servo.friction + lost;
    if (speed > 0) {
      motion.v = speed > taken ? speed - taken : 0;
    } else {
      motion.v = speed < -taken ? speed + taken : 0;
    }
    motion.v = clamped(motion.v, MODEL_FASTEST);
    motion.x = clamped(motion.x + motion.v, MODEL_FARTHEST);
  }
}

}  // namespace miburi
