// CRC-16 with the polynomial 0x8005 from 0: DYNAMIXEL protocol 2.0's, and our link's.
#pragma once

#include <stdint.h>

namespace miburi {

// The remainders of the sixteen half bytes.
static const uint16_t CRC_OF_NIBBLE[16] = {
    0x0000, 0x8005, 0x800f, 0x000a, 0x801b, 0x001e, 0x0014, 0x8011,
    0x8033, 0x0036, 0x003c, 0x8039, 0x0028, 0x802d, 0x8027, 0x0022,
};

inline uint16_t crc16(uint16_t crc, uint8_t byte) {
  crc = static_cast<uint16_t>(crc << 4) ^ CRC_OF_NIBBLE[(crc >> 12) ^ (byte >> 4)];
  return static_cast<uint16_t>(crc << 4) ^ CRC_OF_NIBBLE[(crc >> 12) ^ (byte & 15)];
}

inline uint16_t crc16(const uint8_t* bytes, uint16_t count) {
  uint16_t crc = 0;
  for (uint16_t i = 0; i < count; i++) {
    crc = crc16(crc, bytes[i]);
  }
  return crc;
}

}  // namespace miburi
