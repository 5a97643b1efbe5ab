// CRC-16 with the polynomial 0x8005 from 0: DYNAMIXEL protocol 2.0's, and our link's.
#pragma once

#include <stdint.h>

namespace miburi {

inline uint16_t crc16(uint16_t crc, uint8_t byte) {
  crc = static_cast<uint16_t>(crc ^ static_cast<uint16_t>(byte << 8));
  for (uint8_t bit = 0; bit < 8; bit++) {
    const bool carry = (crc & 0x8000u) != 0;
    crc = static_cast<uint16_t>(crc << 1);
    if (carry) {
      crc = static_cast<uint16_t>(crc ^ 0x8005u);
    }
  }
  return crc;
}

inline uint16_t crc16(const uint8_t* bytes, uint16_t count) {
  uint16_t crc = 0;
  for (uint16_t i = 0; i < count; i++) {
    crc = crc16(crc, bytes[i]);
  }
  return crc;
}

}  // namespace miburi
