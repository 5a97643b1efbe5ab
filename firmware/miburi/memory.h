// The settings in EEPROM: the CRC of the table first, then the table.
//
// `Io` gives eeprom_ready(), eeprom_read(address), eeprom_write(address, byte).
#pragma once

#include "settings.h"

namespace miburi {

template <class Io>
class Memory {
 public:
  explicit Memory(Io& io) : io_(io) {}

  // Reads what was saved; a blank or torn EEPROM has no valid CRC, and changes nothing.
  void recall(Table& table) {
    uint8_t bytes[SIZE];
    for (uint8_t i = 0; i < SIZE; i++) {
      bytes[i] = io_.eeprom_read(i);
    }
    if (u16_at(bytes) == (crc16(bytes + 2, TABLE_SIZE) ^ SALT)) {
      table.read(bytes + 2);
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

  bool has(const Table& table) {
    uint8_t bytes[SIZE];
    image(table, bytes);
    for (uint8_t i = 0; i < SIZE; i++) {
      if (io_.eeprom_read(i) != bytes[i]) {
        return false;
      }
    }
    return true;
  }

 private:
  static const uint8_t SIZE = TABLE_SIZE + 2;
  static const uint16_t SALT = 0x4d31;

  static void image(const Table& table, uint8_t* bytes) {
    table.write(bytes + 2);
    const uint16_t crc = crc16(bytes + 2, TABLE_SIZE) ^ SALT;
    bytes[0] = static_cast<uint8_t>(crc);
    bytes[1] = static_cast<uint8_t>(crc >> 8);
  }

  Io& io_;
  uint8_t next_ = 0xff;  // the address to write next
};

}  // namespace miburi
