// The link between host and card: frames of
//
//   COBS( version | kind | sequence | payload … | CRC-16 ) 00
//
// Numbers are little-endian. The card answers every frame: kind + 0x80 with the same sequence
// number and a result; what cannot be read at all is answered as `refused`.
#pragma once

#include "bytes.h"
#include "crc.h"

namespace miburi {

const uint8_t LINK_VERSION = 8;
const uint8_t MAX_PAYLOAD = 96;

enum class Kind : uint8_t {
  hello = 1,       // → link version, 3 bytes of firmware version, motors, 2 flags, CRC of settings
  settings = 2,    // Settings, without the joints
  joint = 3,       // index, Joint
  read = 4,        // index of a joint, or 8 for the settings → a Joint, or Settings
  save = 5,        // settings and joints to EEPROM
  move = 6,        // 8 positions, 8 speeds → time at which the move began; uses up the loads
  stop = 7,
  release = 8,     // → time at which the return began; uses up the loads
  status = 9,      // ms between reports, 0 for none
  relax = 10,      // torque off; only while stopped
  identify = 11,   // old id, new id: the only servo on the bus gets a new id and our bus speed
  loads = 12,      // 8 loads of the next move or release; a frame of its own, as a UART holds 63 bytes
  peek = 13,       // motor, address, count → registers; not in motion
  refused = 0x7f,  // answer to a frame that could not be read
  report = 0x40    // the status, sent unasked
};
const uint8_t ANSWER = 0x80;

enum class Result : uint8_t {
  ok,
  damaged,   // framing or CRC
  version,   // another link version; detail: ours
  unknown,   // no such kind
  length,    // payload of the wrong length
  range,     // a value is out of range; detail: its index
  phase,     // not in this phase; detail: the phase
  servo,     // a servo is not ready; detail: motor, reason, and for `outside` where the joint is
  settings,  // settings or joints have not all been given, or contradict each other
  loads      // the loads of this move have not been given
};

struct Frame {
  Kind kind;
  uint8_t sequence;
  uint8_t count;
  uint8_t payload[MAX_PAYLOAD];
};

// Collects bytes up to a delimiter; then `take` decodes them.
class Decoder {
 public:
  // True when a frame is complete; no byte may be added until it is taken.
  bool add(uint8_t byte) {
    if (byte != 0) {
      if (count_ < sizeof bytes_) {
        bytes_[count_++] = byte;
      } else {
        overrun_ = true;
      }
      return false;
    }
    complete_ = count_ > 0;
    return complete_;
  }
  bool complete() const { return complete_; }

  // Reads the complete frame into `frame` and makes room for the next.
  Result take(Frame& frame) {
    const uint8_t encoded = count_;
    const bool overrun = overrun_;
    count_ = 0;
    overrun_ = false;
    complete_ = false;
    if (overrun) {
      return Result::damaged;
    }
    uint8_t count = 0;
    for (uint8_t at = 0; at < encoded;) {
      const uint8_t code = bytes_[at];
      const uint8_t end = static_cast<uint8_t>(at + code);
      if (end > encoded || end < at) {
        return Result::damaged;
      }
      for (at++; at < end; at++) {
        bytes_[count++] = bytes_[at];
      }
      if (at < encoded && code < 0xff) {
        bytes_[count++] = 0;
      }
    }
    if (count < 5 ||
        crc16(bytes_, static_cast<uint16_t>(count - 2)) != u16_at(bytes_ + count - 2)) {
      return Result::damaged;
    }
    frame.kind = static_cast<Kind>(bytes_[1]);
    frame.sequence = bytes_[2];
    frame.count = static_cast<uint8_t>(count - 5);
    for (uint8_t i = 0; i < frame.count; i++) {
      frame.payload[i] = bytes_[3 + i];
    }
    return bytes_[0] == LINK_VERSION ? Result::ok : Result::version;
  }

 private:
  uint8_t bytes_[MAX_PAYLOAD + 6];
  uint8_t count_ = 0;
  bool overrun_ = false;
  bool complete_ = false;
};

const uint8_t MAX_ENCODED = MAX_PAYLOAD + 7;

// Writes the frame with its delimiter into `out` (MAX_ENCODED bytes); returns its length.
inline uint8_t encode(uint8_t kind, uint8_t sequence, const uint8_t* payload, uint8_t count,
                      uint8_t* out) {
  const uint8_t head[] = {LINK_VERSION, kind, sequence};
  uint16_t crc = 0;
  uint8_t code_at = 0;
  uint8_t at = 1;
  const uint8_t whole = static_cast<uint8_t>(count + 5);
  for (uint8_t i = 0; i < whole; i++) {
    uint8_t byte;
    if (i < 3) {
      byte = head[i];
    } else if (i < whole - 2) {
      byte = payload[i - 3];
    } else {
      byte = static_cast<uint8_t>(i == whole - 2 ? crc : crc >> 8);
    }
    if (i < whole - 2) {
      crc = crc16(crc, byte);
    }
    if (byte == 0) {
      out[code_at] = static_cast<uint8_t>(at - code_at);
      code_at = at++;
    } else {
      out[at++] = byte;
    }
  }
  out[code_at] = static_cast<uint8_t>(at - code_at);
  out[at++] = 0;
  return at;
}

}  // namespace miburi
