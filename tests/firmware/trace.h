// Runs one trace through the rule: the same for the native build and for the AVR.
// The format is that of traces.py.
#pragma once

#include "settings.h"

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
    watch.loading[i].offset = in.i32();
    watch.loading[i].begin = in.i32();
    watch.loading[i].end = in.i32();
    watch.loading[i].most = in.i32();
    watch.loading[i].velocity = in.i32();
    watch.loading[i].gone = in.i32();
  }
  miburi::begin(watch, rule);
  const int16_t looks = in.i16();
  for (int16_t n = 0; n < looks; n++) {
    const int64_t time = in.i64();
    int16_t positions[miburi::MOTORS];
    for (uint8_t i = 0; i < miburi::MOTORS; i++) {
      positions[i] = in.i16();
    }
    const miburi::Contact contact = miburi::look(watch, rule, positions, time);
    out.put(static_cast<uint8_t>(contact.sign));
    out.put(contact.motor);
    out.put(miburi::arrived(watch, rule, positions, time));
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
