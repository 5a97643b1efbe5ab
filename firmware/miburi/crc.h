// CRC-16 with polynomial 0x8005 and initial value 0, for DYNAMIXEL protocol 2.0 and for our link.
#pragma once

#include <stdint.h>

namespace miburi {

// The remainders of all bytes, computed once when the card starts, because each look at the servos
// checks 300 bytes.
struct Remainders {
  uint16_t of[256];

  Remainders() {
    for (uint16_t byte = 0; byte < 256; byte++) {
      uint16_t crc = static_cast<uint16_t>(byte << 8);
      for (uint8_t bit = 0; bit < 8; bit++) {
        crc = static_cast<uint16_t>(crc & 0x8000 ? crc << 1 ^ 0x8005 : crc << 1);
      }
      of[byte] = crc;
    }
  }
};
static const Remainders REMAINDERS;

inline uint16_t crc16(uint16_t crc, uint8_t byte) {
  return static_cast<uint16_t>(crc << 8) ^ REMAINDERS.of[(crc >> 8) ^ byte];
}

inline uint16_t crc16(const uint8_t* bytes, uint16_t count) {
  uint16_t crc = 0;
  for (uint16_t i = 0; i < count; i++) {
    crc = crc16(crc, bytes[i]);
  }
  return crc;
}

}  // namespace miburi
