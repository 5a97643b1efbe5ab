// The settings in EEPROM: a magic number and the layout's number, the CRC of the table, then the
// table.
//
// `Io` provides eeprom_ready(), eeprom_read(address), eeprom_write(address, byte).
#pragma once

#include "settings.h"

namespace miburi {

enum class Stored : uint8_t { no, yes, other_layout };

template <class Io>
class Memory {
 public:
  explicit Memory(Io& io) : io_(io) {}

  // Reads what was saved; a blank or torn EEPROM has no valid CRC, and changes nothing.
  void recall(Table& table) {
    uint8_t bytes[SIZE];
    for (uint16_t i = 0; i < SIZE; i++) {
      bytes[i] = io_.eeprom_read(i);
    }
    if (bytes[0] == MARK && bytes[1] == LAYOUT &&
        u16_at(bytes + 2) == (crc16(bytes + HEAD, TABLE_SIZE) ^ SALT)) {
      table.read(bytes + HEAD);
    }
  }

  void save() { next_ = 0; }

  // Saves a byte at a time: each takes the EEPROM 3 ms.
  void work(const Table& table) {
    if (next_ < SIZE && io_.eeprom_ready()) {
      uint8_t bytes[SIZE];
      image(table, bytes);
      io_.eeprom_write(next_, bytes[next_]);
      next_++;
    }
  }

  // Whether no save is needed: the EEPROM holds this table already, or a table by another version
  // of the firmware, which must not be overwritten.
  Stored has(const Table& table) {
    uint8_t bytes[SIZE];
    image(table, bytes);
    if (io_.eeprom_read(0) == MARK && io_.eeprom_read(1) != LAYOUT) {
      return Stored::other_layout;
    }
    for (uint16_t i = 0; i < SIZE; i++) {
      if (io_.eeprom_read(i) != bytes[i]) {
        return Stored::no;
      }
    }
    return Stored::yes;
  }

 private:
  static const uint8_t MARK = 0x4d;
  static const uint8_t LAYOUT = 4;  // of the table; increased at every change to it
  static const uint8_t HEAD = 4;
  static const uint16_t SIZE = TABLE_SIZE + HEAD;
  static const uint16_t SALT = 0x4d31;

  static void image(const Table& table, uint8_t* bytes) {
    table.write(bytes + HEAD);
    const uint16_t crc = crc16(bytes + HEAD, TABLE_SIZE) ^ SALT;
    bytes[0] = MARK;
    bytes[1] = LAYOUT;
    bytes[2] = static_cast<uint8_t>(crc);
    bytes[3] = static_cast<uint8_t>(crc >> 8);
  }

  Io& io_;
  uint16_t next_ = SIZE;  // the address to write next
};

}  // namespace miburi
