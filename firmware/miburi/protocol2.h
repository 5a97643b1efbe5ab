// DYNAMIXEL protocol 2.0: packets built and found in byte arrays.
//
//   FF FF FD 00 | id | length (2) | instruction | parameters … | CRC-16 (2)
//
// Inside instruction and parameters, FF FF FD is followed by a stuffed FD.
#pragma once

#include "bytes.h"
#include "crc.h"

namespace miburi {
namespace protocol2 {

const uint8_t BROADCAST = 0xfe;
const uint8_t READ = 0x02;
const uint8_t WRITE = 0x03;
const uint8_t REBOOT = 0x08;
const uint8_t STATUS = 0x55;
const uint8_t SYNC_READ = 0x82;
const uint8_t SYNC_WRITE = 0x83;
const uint8_t OVERHEAD = 10;  // bytes of a packet without parameters
const uint8_t ALERT = 0x80;   // in a status packet's error: the servo reports a hardware error

// One instruction packet, put together byte by byte.
class Instruction {
 public:
  Instruction(uint8_t id, uint8_t instruction) {
    const uint8_t head[] = {0xff, 0xff, 0xfd, 0x00, id, 0, 0};
    for (uint8_t i = 0; i < sizeof head; i++) {
      bytes_[count_++] = head[i];
    }
    put(instruction, 1);
  }

  Instruction& put(uint32_t value, uint8_t width) {
    // Shifts by a byte are quick; a shift by a variable number of bits is a loop on an AVR.
    for (uint8_t i = 0; i < width && count_ < ROOM - 3; i++, value >>= 8) {
      const uint8_t byte = static_cast<uint8_t>(value);
      bytes_[count_++] = byte;
      if (count_ >= 10 && byte == 0xfd && bytes_[count_ - 2] == 0xff && bytes_[count_ - 3] == 0xff) {
        bytes_[count_++] = 0xfd;
      }
    }
    return *this;
  }

  // Completes the packet; nothing can be put after that.
  const uint8_t* finish() {
    const uint8_t length = static_cast<uint8_t>(count_ - 5);
    bytes_[5] = length;
    const uint16_t crc = crc16(bytes_, count_);
    bytes_[count_++] = static_cast<uint8_t>(crc);
    bytes_[count_++] = static_cast<uint8_t>(crc >> 8);
    return bytes_;
  }
  uint8_t count() const { return count_; }

 private:
  static const uint8_t ROOM = 240;
  uint8_t bytes_[ROOM];
  uint8_t count_ = 0;
};

struct Status {
  uint8_t id;
  uint8_t error;
  uint8_t parameters[32];
  uint8_t count;
};

// Finds the next whole status packet in bytes[at…]; moves `at` past it. Anything else, such as
// noise, our own echo and damaged packets, is passed over.
inline bool next_status(const uint8_t* bytes, uint8_t count, uint8_t& at, Status& status) {
  for (; static_cast<uint8_t>(count - at) > OVERHEAD; at++) {
    const uint8_t* p = bytes + at;
    if (p[0] != 0xff || p[1] != 0xff || p[2] != 0xfd || p[3] != 0x00 || p[7] != STATUS) {
      continue;
    }
    // The length counts instruction, error, parameters and CRC.
    const uint16_t length = u16_at(p + 5);
    const uint16_t room = static_cast<uint16_t>(count - at - 7);
    if (length < 4 || length > room) {
      continue;
    }
    const uint8_t crc_at = static_cast<uint8_t>(5 + length);
    if (crc16(p, crc_at) != u16_at(p + crc_at)) {
      continue;
    }
    status.id = p[4];
    status.error = p[8];
    status.count = 0;
    for (uint8_t i = 9; i < crc_at && status.count < sizeof status.parameters; i++) {
      status.parameters[status.count++] = p[i];
      if (i >= 10 && p[i] == 0xfd && p[i - 1] == 0xff && p[i - 2] == 0xff) {
        i++;  // the stuffed byte
      }
    }
    at = static_cast<uint8_t>(at + crc_at + 2);
    return true;
  }
  return false;
}

}  // namespace protocol2
}  // namespace miburi
