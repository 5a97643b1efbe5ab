// Puts little-endian numbers one after another into a byte array, or takes them out. Excess bytes
// are dropped; missing ones read as 0.
#pragma once

#include <stdint.h>

namespace miburi {

inline uint16_t u16_at(const uint8_t* bytes) {
  return static_cast<uint16_t>(bytes[0] | static_cast<uint16_t>(bytes[1]) << 8);
}

class Writer {
 public:
  Writer(uint8_t* bytes, uint16_t room) : bytes_(bytes), room_(room) {}

  Writer& put(uint64_t value, uint8_t width) {
    for (uint8_t i = 0; i < width && count_ < room_; i++, value >>= 8) {
      bytes_[count_++] = static_cast<uint8_t>(value);
    }
    return *this;
  }
  uint16_t count() const { return count_; }

 private:
  uint8_t* bytes_;
  uint16_t room_;
  uint16_t count_ = 0;
};

class Reader {
 public:
  Reader(const uint8_t* bytes, uint16_t count) : bytes_(bytes), count_(count) {}

  uint8_t u8() { return static_cast<uint8_t>(take(1)); }
  uint16_t u16() { return static_cast<uint16_t>(take(2)); }
  uint32_t u32() { return static_cast<uint32_t>(take(4)); }
  int8_t i8() { return static_cast<int8_t>(u8()); }
  int16_t i16() { return static_cast<int16_t>(u16()); }
  int32_t i32() { return static_cast<int32_t>(u32()); }

 private:
  uint32_t take(uint8_t width) {
    // Shifts by a byte are quick; a shift by a variable number of bits is a loop on an AVR.
    uint32_t value = 0;
    for (uint8_t i = width; i-- > 0;) {
      const uint16_t at = static_cast<uint16_t>(at_ + i);
      value = value << 8 | (at < count_ ? bytes_[at] : 0u);
    }
    at_ = static_cast<uint16_t>(at_ + width);
    return value;
  }

  const uint8_t* bytes_;
  uint16_t count_;
  uint16_t at_ = 0;
};

}  // namespace miburi
