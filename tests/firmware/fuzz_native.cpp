// The whole card, natively, under the sanitizers: bytes for the host's side and for the bus on
// standard input, what the card says to the host on standard output.
//
// Input: pairs of a byte (0: to the host's side, 1: to the bus) and a byte.
#include <cstdint>
#include <cstdio>
#include <deque>

#include "card.h"

struct FakeIo {
  std::deque<uint8_t> host, bus;
  uint32_t time = 0xfff00000u;  // soon wraps
  uint8_t eeprom[4096];

  FakeIo() {
    for (uint8_t& byte : eeprom) byte = 0xff;
  }
  static int take(std::deque<uint8_t>& from) {
    if (from.empty()) return -1;
    const uint8_t byte = from.front();
    from.pop_front();
    return byte;
  }
  uint32_t micros() { return time += 3; }
  int host_read() { return take(host); }
  int bus_read() { return take(bus); }
  void bus_write(const uint8_t*, uint8_t) { time += 1000; }
  void bus_speed(uint32_t) {}
  void host_write(const uint8_t* bytes, uint8_t count) { std::fwrite(bytes, 1, count, stdout); }
  bool eeprom_ready() { return true; }
  uint8_t eeprom_read(uint16_t address) { return eeprom[address]; }
  void eeprom_write(uint16_t address, uint8_t byte) { eeprom[address] = byte; }
  void rest() { time += 500; }
  void alive() {}
  bool host_is_quiet() { return true; }
};

int main() {
  static FakeIo io;
  static miburi::Card<FakeIo> card(io);
  card.begin();
  for (int to, byte; (to = std::getchar()) != EOF && (byte = std::getchar()) != EOF;) {
    (to ? io.bus : io.host).push_back(static_cast<uint8_t>(byte));
    if (io.host.size() + io.bus.size() > 64) {
      card.work();
    }
  }
  for (int i = 0; i < 2000; i++) {
    card.work();
  }
  return 0;
}
