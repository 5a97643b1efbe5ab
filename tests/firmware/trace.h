// Runs one trace through the rule: the same for the native build and for the AVR.
// The format is that of traces.py.
#pragma once

#include "settings.h"

template <class In>
void read_loading(In& in, miburi::Loading& loading) {
  loading.offset = in.i32();
  loading.begin = in.i32();
  loading.end = in.i32();
  loading.most = in.i32();
  loading.velocity = in.i32();
  loading.gone = in.i32();
}

// A move that replaces the one that is watched, as controller.h starts it.
struct Next {
  int32_t way;
  int32_t speed;
  int32_t acceleration;
  int16_t start;
  miburi::Loading loading;
};

inline void replace(miburi::Watch& watch, const Next* next, int64_t seen, int64_t elapsed) {
  for (uint8_t i = 0; i < miburi::MOTORS; i++) {
    const Next& n = next[i];
    const int32_t velocity = miburi::speed_at(watch.profile[i], elapsed) * watch.direction[i];
    int8_t direction = n.way * 256 < miburi::stopping(velocity, n.acceleration) ? -1 : 1;
    if (n.way == 0 && velocity == 0) {
      direction = watch.direction[i];
    }
    miburi::go_on(watch, i, n.start, direction, seen, elapsed);
    watch.profile[i] =
        miburi::plan(n.way * direction, n.speed, n.acceleration, velocity * direction);
    watch.loading[i] = n.loading;
    miburi::grant_on(watch, i, seen);
  }
  miburi::restart(watch, elapsed);
}

template <class In, class Out>
void run_trace(In& in, Out& out) {
  miburi::Rule rule = miburi::Rule();
  miburi::Watch watch;
  rule.period = in.i32();
  rule.ratio = in.i32();
  for (uint8_t i = 0; i < miburi::MOTORS; i++) {
    rule.guards[i] = miburi::read_guards(in);
    rule.servos[i] = miburi::read_free_servo(in);
  }
  for (uint8_t i = 0; i < miburi::MOTORS; i++) {
    const int32_t distance = in.i32();
    const int32_t speed = in.i32();
    const int32_t acceleration = in.i32();
    watch.profile[i] = miburi::plan(distance, speed, acceleration);
    watch.start[i] = in.i16();
    watch.direction[i] = static_cast<int8_t>(in.i16());
    read_loading(in, watch.loading[i]);
  }
  Next next[miburi::MOTORS];
  for (uint8_t i = 0; i < miburi::MOTORS; i++) {
    next[i].way = in.i32();
    next[i].speed = in.i32();
    next[i].acceleration = in.i32();
    next[i].start = in.i16();
    in.i16();
    read_loading(in, next[i].loading);
  }
  const int16_t again = in.i16();
  const int64_t elapsed = in.i64();
  int64_t seen = 0;
  miburi::begin(watch, rule);
  const int16_t looks = in.i16();
  for (int16_t n = 0; n < looks; n++) {
    if (n == again) {
      replace(watch, next, seen, elapsed);
    }
    const int64_t time = in.i64();
    seen = time;
    int16_t positions[miburi::MOTORS];
    for (uint8_t i = 0; i < miburi::MOTORS; i++) {
      positions[i] = in.i16();
    }
    const miburi::Contact contact = miburi::look(watch, rule, positions, time);
    out.put(static_cast<uint8_t>(contact.sign));
    out.put(contact.motor);
    out.put(miburi::arrived(watch, rule, positions, time));
    // What a retreat goes back by, and where each profile is in the seam of its first ramp.
    uint32_t kept = 0;
    for (uint8_t i = 0; i < miburi::MOTORS; i++) {
      kept = kept * 31 + static_cast<uint16_t>(watch.came[i]);
      if (n == 0 || n == again) {
        const miburi::Profile& p = watch.profile[i];
        kept = kept * 31 + static_cast<uint32_t>(miburi::travel(p, p.ramp));
      }
    }
    for (uint8_t i = 0; i < 4; i++) {
      out.put(static_cast<uint8_t>(kept >> (8 * i)));
    }
    for (uint8_t i = 0; i < 4; i++) {
      out.put(static_cast<uint8_t>(static_cast<uint32_t>(contact.measured) >> (8 * i)));
    }
    for (uint8_t i = 0; i < 4; i++) {
      out.put(static_cast<uint8_t>(static_cast<uint32_t>(contact.expected) >> (8 * i)));
    }
    for (uint8_t i = 0; i < 8; i++) {
      out.put(static_cast<uint8_t>(static_cast<uint64_t>(contact.length) >> (8 * i)));
    }
  }
}

// Little-endian numbers out of any source of bytes.
template <class Source>
struct Numbers {
  Source& source;

  uint64_t take(uint8_t width) {
    uint64_t value = 0;
    for (uint8_t i = 0; i < width; i++) {
      value |= static_cast<uint64_t>(source.get()) << (8 * i);
    }
    return value;
  }
  uint8_t u8() { return static_cast<uint8_t>(take(1)); }
  uint16_t u16() { return static_cast<uint16_t>(take(2)); }
  int16_t i16() { return static_cast<int16_t>(take(2)); }
  int32_t i32() { return static_cast<int32_t>(take(4)); }
  int64_t i64() { return static_cast<int64_t>(take(8)); }
};
