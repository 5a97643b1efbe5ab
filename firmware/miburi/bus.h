// The half-duplex bus of the servos, protocol 2.0: packets out, and the answers to them.
//
// `Io` provides the bus: bus_write(bytes, count) returns when the last bit is out; bus_read() gives
// a byte or -1; bus_speed(baud); micros(); rest() sleeps until something may have happened, and may
// look after the host meanwhile; alive() tells the watchdog that a long wait is intended.
#pragma once

#include "protocol2.h"
#include "settings.h"

namespace miburi {

const uint8_t ALL = 0xff;  // a bit per motor

template <class Io>
class Bus {
 public:
  static const uint8_t ASKS = 3;  // the most times to ask all motors after a byte was lost

  struct Answer {
    uint8_t error;
    uint8_t parameters[12];

    Answer() : error(0), parameters() {}
    explicit Answer(const protocol2::Status& status) : error(status.error), parameters() {
      for (uint8_t i = 0; i < status.count && i < sizeof parameters; i++) {
        parameters[i] = status.parameters[i];
      }
    }
  };

  explicit Bus(Io& io) : io_(io) {}

  // The latest answers: of a motor when all were asked, and of the servo that was asked alone.
  const Answer& of(uint8_t motor) const { return answers_[motor]; }
  const Answer& latest() const { return answer_; }
  bool stranger() const { return stranger_; }
  bool refused() const { return refused_; }

  uint32_t micros() { return io_.micros(); }
  void set_speed(uint32_t baud) { io_.bus_speed(baud); }
  // A servo may answer late after a write to its EEPROM.
  void wait_longer(bool longer) { patience_ = longer ? LONG_PATIENCE : PATIENCE; }

  void send(protocol2::Instruction& packet) {
    while (io_.bus_read() >= 0) {
    }
    const uint8_t* bytes = packet.finish();
    io_.bus_write(bytes, packet.count());
  }

  // Asks all motors for the same registers; returns a bit per motor that answered.
  uint8_t sync_read(const Joint* joints, uint8_t address, uint8_t width) {
    protocol2::Instruction packet(protocol2::BROADCAST, protocol2::SYNC_READ);
    packet.put(address, 2).put(width, 2);
    for (uint8_t i = 0; i < MOTORS; i++) {
      packet.put(joints[i].id, 1);
    }
    send(packet);
    listen();
    uint8_t heard = 0;
    bool more = receive(length_of_answers(MOTORS, width));
    for (;;) {
      protocol2::Status status;
      uint8_t turn = 0;
      for (uint8_t at = 0; protocol2::next_status(buffer_, received_, at, status); turn++) {
        for (uint8_t i = 0; i < MOTORS; i++) {
          // They answer in turn: of two answers with the same id, the one out of turn is from a
          // servo that has another's id.
          const bool once = !(heard & (1u << i)) || turn == i;
          if (status.id == joints[i].id && status.count == width && once) {
            answers_[i] = Answer(status);
            heard = static_cast<uint8_t>(heard | (1u << i));
          }
        }
      }
      // Stuffing or noise makes the answers longer than they should be.
      if (heard == ALL || !more) {
        return heard;
      }
      more = receive(static_cast<uint8_t>(received_ + 1));
    }
  }

  // As sync_read, for registers that do not change by themselves: asks again, up to ASKS times in
  // all, until every motor has answered.
  uint8_t ask(const Joint* joints, uint8_t address, uint8_t width) {
    uint8_t heard = 0;
    for (uint8_t asked = 0; asked < ASKS && heard != ALL; asked++) {
      heard = static_cast<uint8_t>(heard | sync_read(joints, address, width));
    }
    return heard;
  }

  // Asks one motor alone after it did not answer with the others, and keeps its answer for of().
  bool ask_again(uint8_t motor, uint8_t id, uint8_t address, uint8_t width) {
    const bool heard = read(id, address, width);
    if (heard) {
      answers_[motor] = answer_;
    }
    return heard;
  }

  bool read(uint8_t id, uint8_t address, uint8_t width) {
    protocol2::Instruction packet(id, protocol2::READ);
    packet.put(address, 2).put(width, 2);
    send(packet);
    return answered(id, width);
  }

  bool write(uint8_t id, uint8_t address, uint8_t value) {
    protocol2::Instruction packet(id, protocol2::WRITE);
    packet.put(address, 2).put(value, 1);
    send(packet);
    return answered(id, 0) && (answer_.error & ~protocol2::ALERT) == 0;
  }

  void reboot(uint8_t id) {
    protocol2::Instruction packet(id, protocol2::REBOOT);
    send(packet);
    answered(id, 0);
  }

  // A broadcast: every servo obeys, and none answers.
  void tell_all(uint8_t address, uint8_t value) {
    protocol2::Instruction packet(protocol2::BROADCAST, protocol2::WRITE);
    packet.put(address, 2).put(value, 1);
    send(packet);
    io_.alive();
    listen();
    while (io_.micros() - since_ < LONG_PATIENCE) {
      io_.rest();  // the servo needs this time to write to its EEPROM
    }
  }

  void write_all(const Joint* joints, uint8_t address, uint8_t value, uint8_t width) {
    protocol2::Instruction packet(protocol2::BROADCAST, protocol2::SYNC_WRITE);
    packet.put(address, 2).put(width, 2);
    for (uint8_t i = 0; i < MOTORS; i++) {
      packet.put(joints[i].id, 1).put(value, width);
    }
    send(packet);
  }

 private:
  static const uint16_t PATIENCE = 2000;  // µs of silence after which no answer will come
  static const uint16_t LONGEST = 12000;  // µs that listening may take on a noisy bus
  static const uint16_t LONG_PATIENCE = 36000;  // as PATIENCE, after a write to EEPROM

  static uint8_t length_of_answers(uint8_t packets, uint8_t width) {
    return static_cast<uint8_t>(packets * (protocol2::OVERHEAD + 1 + width));
  }

  void listen() {
    received_ = 0;
    since_ = heard_at_ = io_.micros();
  }

  // Collects what the servos say; returns false if they fall silent before `enough` bytes.
  bool receive(uint8_t enough) {
    while (received_ < enough) {
      // A byte comes every 160 cycles, and Serial1 keeps 63 of up to 184: there is no time to look
      // at the clock for each.
      const uint8_t before = received_;
      int byte;
      while (received_ < sizeof buffer_ && (byte = io_.bus_read()) >= 0) {
        buffer_[received_++] = static_cast<uint8_t>(byte);
      }
      const uint32_t time = io_.micros();
      if (received_ != before) {
        heard_at_ = time;
      }
      if (received_ == sizeof buffer_ || time - heard_at_ > patience_ ||
          time - since_ > static_cast<uint32_t>(LONGEST) + patience_) {
        return false;
      }
      if (received_ < enough) {
        io_.rest();
      }
    }
    return true;
  }

  bool answered(uint8_t id, uint8_t width) {
    listen();
    stranger_ = refused_ = false;
    if (patience_ == LONG_PATIENCE) {
      io_.alive();
    }
    bool more = receive(length_of_answers(1, width));
    for (;;) {
      protocol2::Status status;
      for (uint8_t at = 0; protocol2::next_status(buffer_, received_, at, status);) {
        if (status.id == id && status.count == width) {
          answer_ = Answer(status);
          return true;
        }
        stranger_ = status.id != id;
        refused_ = !stranger_ && (status.error & ~protocol2::ALERT) != 0;
      }
      if (!more) {
        return false;
      }
      more = receive(static_cast<uint8_t>(received_ + 1));
    }
  }

  Io& io_;
  uint8_t buffer_[224];
  uint8_t received_ = 0;
  uint32_t since_ = 0;     // when listening began
  uint32_t heard_at_ = 0;  // when the latest byte came
  Answer answers_[MOTORS];
  Answer answer_;
  uint16_t patience_ = PATIENCE;
  bool stranger_ = false;  // the servo asked last answered with another id
  bool refused_ = false;   // it answered with an error
};

}  // namespace miburi
