// What the card must be told before anything moves: the rule's figures, limits, and each joint's
// servo. Every value has a safe range; a value outside is refused, so none can switch the rule off.
#pragma once

#include "bytes.h"
#include "contact.h"
#include "crc.h"

namespace miburi {

struct Joint {
  uint8_t id;
  int8_t direction;  // +1 or -1: whether joint angle and servo angle rise together
  uint16_t zero;     // the servo's position at joint angle 0
  int16_t min;
  int16_t max;
  int16_t neutral;
  Guards guards;
  FreeServo servo;
  uint16_t sag;  // 1/256: as in Rule
};

struct Settings {
  int32_t period;
  uint16_t ratio;
  uint16_t acceleration;  // steps/s²
  uint16_t max_speed;     // steps/s
  uint16_t return_speed;  // steps/s
  uint16_t hold_pwm;      // the greatest duty of a stopped body; FULL_PWM is 100 %
  uint16_t p_gain;        // of the servos' position control
  uint16_t d_gain;
  uint16_t error_per_pwm;  // 1/65536 steps of error for each unit of duty
  uint8_t hottest;         // °C
  uint8_t lowest;          // 0.1 V
};

const uint8_t SETTINGS_SIZE = 22;
const uint8_t GUARDS_SIZE = 14;
const uint8_t FREE_SERVO_SIZE = 7;
const uint8_t JOINT_SIZE = 10 + GUARDS_SIZE + FREE_SERVO_SIZE + 2;
const uint16_t FULL_PWM = 885;
const uint16_t STEPS_PER_TURN = 4096;
const int32_t SEAM = 100;  // steps between a joint's range and the servo's wrap at 0
const uint8_t IN_RANGE = 0xff;

inline bool within(int32_t value, int32_t least, int32_t most) {
  return least <= value && value <= most;
}

// The index of the first value that is out of its safe range, or IN_RANGE.
inline uint8_t out_of_range(const Settings& s) {
  const bool good[] = {
      within(s.period, 20000, 200000),  within(s.ratio, 8000, 10000),
      within(s.acceleration, 244, 40000), within(s.max_speed, 16, 6957),
      within(s.return_speed, 16, 1304), within(s.hold_pwm, 0, 400),
      within(s.p_gain, 100, 16383),     within(s.d_gain, 0, 16383),
      within(s.error_per_pwm, 256, 32000), within(s.hottest, 40, 75),
      within(s.lowest, 35, 60),
  };
  for (uint8_t i = 0; i < sizeof good; i++) {
    if (!good[i]) {
      return i;
    }
  }
  return IN_RANGE;
}

inline uint8_t out_of_range(const Joint& j) {
  // After power-on a servo knows its angle within one turn only: no joint may come to the seam, not
  // even when it is pushed beyond a limit.
  const int32_t one_end = static_cast<int32_t>(j.zero) + j.direction * j.min;
  const int32_t other_end = static_cast<int32_t>(j.zero) + j.direction * j.max;
  const int32_t last = STEPS_PER_TURN - 1;
  const bool good[] = {
      within(j.id, 0, 252),
      j.direction == 1 || j.direction == -1,
      within(j.zero, 0, last),
      within(j.min, -last, j.max) && within(one_end, SEAM, last - SEAM),
      within(j.max, j.min, last) && within(other_end, SEAM, last - SEAM),
      within(j.neutral, j.min, j.max),
      within(j.guards.lag, 0, 100000),
      within(j.guards.slack, 0, 40),
      within(j.guards.least, 1, 100),
      within(j.guards.behind, 1, 300),
      within(j.guards.ahead, 1, 300),
      within(j.guards.arrival, 1, 150),
      within(j.servo.pull, 1, 16383),  // times the largest error: less than 31 bits
      true,                            // brake
      within(j.servo.friction, 0, 32767),
      true,  // lost
      within(j.sag, 0, 768),
  };
  for (uint8_t i = 0; i < sizeof good; i++) {
    if (!good[i]) {
      return i;
    }
  }
  return IN_RANGE;
}

// A servo's position as its joint's angle.
inline int16_t to_joint(const Joint& joint, int32_t position) {
  const int32_t angle = (position - joint.zero) * joint.direction;
  return static_cast<int16_t>(angle > 32000 ? 32000 : angle < -32000 ? -32000 : angle);
}

// The angle within a joint's range that is nearest to `angle`.
inline int16_t inside(const Joint& joint, int16_t angle) {
  return angle > joint.max ? joint.max : angle < joint.min ? joint.min : angle;
}

// The last check: no goal outside its joint's limits leaves the card.
inline int32_t to_servo(const Joint& joint, int16_t angle) {
  return static_cast<int32_t>(joint.zero) +
         static_cast<int32_t>(inside(joint, angle)) * joint.direction;
}

inline Settings read_settings(Reader& in) {
  Settings s;
  s.period = in.i32();
  s.ratio = in.u16();
  s.acceleration = in.u16();
  s.max_speed = in.u16();
  s.return_speed = in.u16();
  s.hold_pwm = in.u16();
  s.p_gain = in.u16();
  s.d_gain = in.u16();
  s.error_per_pwm = in.u16();
  s.hottest = in.u8();
  s.lowest = in.u8();
  return s;
}

inline void write_settings(const Settings& s, Writer& out) {
  out.put(static_cast<uint32_t>(s.period), 4).put(s.ratio, 2).put(s.acceleration, 2);
  out.put(s.max_speed, 2).put(s.return_speed, 2).put(s.hold_pwm, 2);
  out.put(s.p_gain, 2).put(s.d_gain, 2).put(s.error_per_pwm, 2);
  out.put(s.hottest, 1).put(s.lowest, 1);
}

template <class In>
Guards read_guards(In& in) {
  Guards guards;
  guards.lag = in.i32();
  guards.slack = in.i16();
  guards.least = in.i16();
  guards.behind = in.i16();
  guards.ahead = in.i16();
  guards.arrival = in.i16();
  return guards;
}

template <class In>
FreeServo read_free_servo(In& in) {
  FreeServo servo;
  servo.pull = in.u16();
  servo.brake = in.u16();
  servo.friction = in.u16();
  servo.lost = in.u8();
  return servo;
}

inline Joint read_joint(Reader& in) {
  Joint j;
  j.id = in.u8();
  j.direction = in.i8();
  j.zero = in.u16();
  j.min = in.i16();
  j.max = in.i16();
  j.neutral = in.i16();
  j.guards = read_guards(in);
  j.servo = read_free_servo(in);
  j.sag = in.u16();
  return j;
}

inline void write_joint(const Joint& j, Writer& out) {
  out.put(j.id, 1).put(static_cast<uint8_t>(j.direction), 1).put(j.zero, 2);
  out.put(static_cast<uint16_t>(j.min), 2).put(static_cast<uint16_t>(j.max), 2);
  out.put(static_cast<uint16_t>(j.neutral), 2);
  out.put(static_cast<uint32_t>(j.guards.lag), 4);
  out.put(static_cast<uint16_t>(j.guards.slack), 2).put(static_cast<uint16_t>(j.guards.least), 2);
  out.put(static_cast<uint16_t>(j.guards.behind), 2).put(static_cast<uint16_t>(j.guards.ahead), 2);
  out.put(static_cast<uint16_t>(j.guards.arrival), 2);
  out.put(j.servo.pull, 2).put(j.servo.brake, 2).put(j.servo.friction, 2).put(j.servo.lost, 1);
  out.put(j.sag, 2);
}

// Settings and joints as they are stored in EEPROM, and sent over the link piece by piece.
const uint16_t TABLE_SIZE = SETTINGS_SIZE + MOTORS * JOINT_SIZE;
const uint8_t TABLE_WHOLE = 9;  // pieces: eight joints, then the settings

struct Table {
  Settings settings;
  Joint joints[MOTORS];
  uint16_t given;  // bit per piece

  bool complete() const { return given == (1u << TABLE_WHOLE) - 1; }

  void write(uint8_t* bytes) const {
    Writer out(bytes, TABLE_SIZE);
    write_settings(settings, out);
    for (uint8_t i = 0; i < MOTORS; i++) {
      write_joint(joints[i], out);
    }
  }

  // Stored settings are applied as a whole, or not at all.
  void read(const uint8_t* bytes) {
    Reader in(bytes, TABLE_SIZE);
    Table stored;
    stored.settings = read_settings(in);
    bool good = out_of_range(stored.settings) == IN_RANGE;
    for (uint8_t i = 0; i < MOTORS; i++) {
      stored.joints[i] = read_joint(in);
      good = good && out_of_range(stored.joints[i]) == IN_RANGE;
    }
    stored.given = (1u << TABLE_WHOLE) - 1;
    if (good && stored.ids_differ()) {
      *this = stored;
    }
  }

  bool ids_differ() const {
    for (uint8_t i = 0; i < MOTORS; i++) {
      for (uint8_t j = 0; j < i; j++) {
        if (joints[i].id == joints[j].id) {
          return false;
        }
      }
    }
    return true;
  }

  Rule rule() const {
    Rule rule;
    rule.period = settings.period;
    rule.ratio = settings.ratio;
    rule.error_per_pwm = settings.error_per_pwm;
    for (uint8_t i = 0; i < MOTORS; i++) {
      rule.guards[i] = joints[i].guards;
      rule.servos[i] = joints[i].servo;
      rule.sag[i] = joints[i].sag;
    }
    return rule;
  }
};

}  // namespace miburi
