// CRC-16 with the polynomial 0x8005 from 0: DYNAMIXEL protocol 2.0's, and our link's.
#pragma once

#include <stdint.h>

namespace miburi {

// The remainders of all bytes, worked out when the card starts: 300 bytes are checked in each look
// at the servos.
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
