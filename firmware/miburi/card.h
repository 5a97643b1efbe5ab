// The card: answers the host, and reports the body's state to it.
//
// Besides what the body needs, `Io` gives host_read(), a byte or -1; host_write(bytes, count); and
// host_is_quiet().
#pragma once

#include "body.h"
#include "link.h"

namespace miburi {

const uint8_t FIRMWARE[3] = {0, 2, 0};
const uint8_t LOAD_SIZE = 6;

template <class Io>
class Card {
 public:
  explicit Card(Io& io) : io_(io), body_(*this) {}

  void begin() { body_.begin(); }

  // Called again and again; returns after a few milliseconds at most.
  void work() {
    if (decoder_.complete()) {
      serve();
    }
    if (body_.work()) {
      // A host that is never quiet must not keep the card from its checks.
      if (++waits_ > LONGEST_WAIT) {
        look_after();
      }
      if (report_period_ != 0 && body_.time() >= next_report_) {
        next_report_ = body_.time() + report_period_;
        report();
      }
    } else if (waits_ != 0 && io_.host_is_quiet()) {
      // While the card sends to the host, a byte from a servo gets lost now and then: one interrupt
      // delays another.
      look_after();
    } else {
      rest();
    }
  }

  // The card is the body's `Io`.
  uint32_t micros() { return io_.micros(); }
  int bus_read() { return io_.bus_read(); }
  void bus_write(const uint8_t* bytes, uint8_t count) { io_.bus_write(bytes, count); }
  void bus_speed(uint32_t baud) { io_.bus_speed(baud); }
  void alive() { io_.alive(); }
  bool eeprom_ready() { return io_.eeprom_ready(); }
  uint8_t eeprom_read(uint16_t address) { return io_.eeprom_read(address); }
  void eeprom_write(uint16_t address, uint8_t byte) { io_.eeprom_write(address, byte); }
  void rest() {
    int byte;
    while (!decoder_.complete() && (byte = io_.host_read()) >= 0) {
      decoder_.add(static_cast<uint8_t>(byte));
    }
    if (!decoder_.complete()) {
      io_.rest();
    }
  }

 private:
  static const uint8_t LONGEST_WAIT = 1;  // readings

  void look_after() {
    waits_ = 0;
    body_.look_after();
  }

  void serve() {
    Frame frame;
    const Result result = decoder_.take(frame);
    if (result != Result::ok) {
      const uint8_t detail = result == Result::version ? LINK_VERSION : 0;
      const uint8_t payload[] = {static_cast<uint8_t>(result), detail};
      send(static_cast<uint8_t>(Kind::refused) | ANSWER,
           result == Result::version ? frame.sequence : 0, payload, sizeof payload);
      return;
    }
    body_.host_spoke();
    // If a frame is repeated because its answer was lost, the answer is sent again; the frame is
    // not obeyed again.
    const uint16_t crc = crc16(frame.payload, frame.count);
    const bool again = answered_ && frame.sequence == last_sequence_ && frame.kind == last_kind_ &&
                       crc == last_crc_ && frame.kind != Kind::hello;
    if (!again) {
      Writer out(answer_, sizeof answer_);
      out.put(0, 1);
      Reader in(frame.payload, frame.count);
      answer_[0] = static_cast<uint8_t>(obey(frame, in, out));
      answer_count_ = static_cast<uint8_t>(out.count());
      answered_ = true;
      last_sequence_ = frame.sequence;
      last_kind_ = frame.kind;
      last_crc_ = crc;
    }
    send(static_cast<uint8_t>(frame.kind) | ANSWER, frame.sequence, answer_, answer_count_);
  }

  Result obey(const Frame& frame, Reader& in, Writer& out) {
    switch (frame.kind) {
      case Kind::hello:
        return frame.count == 0 ? hello(out) : Result::length;
      case Kind::settings:
        return frame.count == SETTINGS_SIZE ? body_.set_settings(read_settings(in), out)
                                            : Result::length;
      case Kind::joint:
        return frame.count == 1 + JOINT_SIZE ? set_joint(in, out) : Result::length;
      case Kind::read:
        return frame.count == 1 ? body_.read(in.u8(), out) : Result::length;
      case Kind::save:
        return frame.count == 0 ? body_.save(out) : Result::length;
      case Kind::move:
        return frame.count == 4 * MOTORS ? move(in, out) : Result::length;
      case Kind::stop:
        return frame.count == 0 ? body_.ask_stop() : Result::length;
      case Kind::release:
        return frame.count == 0 ? body_.release(out) : Result::length;
      case Kind::status:
        return frame.count == 2 ? set_reports(in.u16()) : Result::length;
      case Kind::relax:
        return frame.count == 0 ? body_.relax(out) : Result::length;
      case Kind::identify:
        return frame.count == 2 ? identify(in, out) : Result::length;
      case Kind::loads:
        return frame.count == LOAD_SIZE * MOTORS ? set_loads(in, out) : Result::length;
      case Kind::peek:
        return frame.count == 3 ? peek(in, out) : Result::length;
      default:
        return Result::unknown;
    }
  }

  Result hello(Writer& out) {
    uint8_t bytes[TABLE_SIZE];
    body_.table().write(bytes);
    out.put(LINK_VERSION, 1).put(FIRMWARE[0], 1).put(FIRMWARE[1], 1).put(FIRMWARE[2], 1);
    out.put(MOTORS, 1).put(body_.table().complete(), 1);
    out.put(static_cast<uint8_t>(body_.stored()), 1);
    out.put(crc16(bytes, TABLE_SIZE), 2);
    return Result::ok;
  }

  Result set_joint(Reader& in, Writer& out) {
    const uint8_t index = in.u8();
    return body_.set_joint(index, read_joint(in), out);
  }

  Result move(Reader& in, Writer& out) {
    int16_t goal[MOTORS];
    uint16_t speeds[MOTORS];
    for (uint8_t i = 0; i < MOTORS; i++) {
      goal[i] = in.i16();
    }
    for (uint8_t i = 0; i < MOTORS; i++) {
      speeds[i] = in.u16();
    }
    return body_.move(goal, speeds, out);
  }

  Result set_loads(Reader& in, Writer& out) {
    Load loads[MOTORS];
    for (uint8_t i = 0; i < MOTORS; i++) {
      loads[i].begin = in.i8();
      loads[i].end = in.i8();
      loads[i].pwm = in.u16();
      loads[i].cruise = in.u16();
    }
    return body_.set_loads(loads, out);
  }

  Result identify(Reader& in, Writer& out) {
    const uint8_t old_id = in.u8();
    return body_.identify(old_id, in.u8(), out);
  }

  Result peek(Reader& in, Writer& out) {
    const uint8_t motor = in.u8();
    const uint8_t address = in.u8();
    return body_.peek(motor, address, in.u8(), out);
  }

  Result set_reports(uint16_t period_ms) {
    report_period_ = period_ms * 1000L;
    next_report_ = 0;
    return Result::ok;
  }

  void report() {
    uint8_t bytes[MAX_PAYLOAD];
    Writer out(bytes, sizeof bytes);
    body_.report(out);
    send(static_cast<uint8_t>(Kind::report), reports_++, bytes, static_cast<uint8_t>(out.count()));
  }

  void send(uint8_t kind, uint8_t sequence, const uint8_t* payload, uint8_t count) {
    uint8_t bytes[MAX_ENCODED];
    io_.host_write(bytes, encode(kind, sequence, payload, count, bytes));
  }

  Io& io_;
  Body<Card> body_;
  Decoder decoder_;

  uint8_t answer_[48];
  uint8_t answer_count_ = 0;
  bool answered_ = false;
  uint8_t last_sequence_ = 0;
  Kind last_kind_ = Kind::hello;
  uint16_t last_crc_ = 0;

  int32_t report_period_ = 0;
  int64_t next_report_ = 0;
  uint8_t waits_ = 0;  // readings since the latest look_after()
  uint8_t reports_ = 0;
};

}  // namespace miburi
