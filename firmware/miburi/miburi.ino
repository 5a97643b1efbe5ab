// Miburi's card: an Arduino Mega 2560 with eight DYNAMIXEL XL330 servos.
//
// Serial (USB, or a Bluetooth serial module): the host, 115200 baud.
// Serial1: the servo bus, 1 Mbit/s, half duplex; pin 2 is high while the card sends.
//
// docs/card.md has the parts, the wiring and the first move.
#include <avr/eeprom.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "card.h"

namespace {

const uint8_t SENDING = 2;

struct Board {
  uint32_t micros() { return ::micros(); }

  void bus_speed(uint32_t baud) {
    UCSR1B = 0;  // Serial1.end() would wait like flush()
    Serial1.begin(baud);
  }
  void bus_write(const uint8_t* bytes, uint8_t count) {
    // Serial1.write() takes 220 cycles for a byte, but the bus sends one every 160.
    digitalWrite(SENDING, HIGH);
    for (uint8_t i = 0; i < count && comes(1 << UDRE1); i++) {
      noInterrupts();  // else the bus could fall silent between these two, and the flag be lost
      UDR1 = bytes[i];
      UCSR1A = (UCSR1A & (1 << U2X1)) | (1 << TXC1);  // a 1 clears it: this byte is not sent yet
      interrupts();
    }
    comes(1 << TXC1);
    digitalWrite(SENDING, LOW);
  }
  // Waits for a flag of the bus, but gives up after some 50 ms.
  static bool comes(uint8_t flag) {
    for (uint16_t turns = 1; turns != 0; turns++) {
      if (UCSR1A & flag) {
        return true;
      }
    }
    return false;
  }
  int bus_read() { return Serial1.read(); }

  int host_read() { return Serial.read(); }
  void host_write(const uint8_t* bytes, uint8_t count) {
    while (count != 0) {
      for (int room = Serial.availableForWrite(); count != 0 && room > 0; count--, room--) {
        Serial.write(*bytes++);
      }
      // Serial.write() would wait for room without sleeping: a byte takes 1,390 cycles.
      sleep_while([] { return Serial.availableForWrite() == 0; });
    }
  }

  void alive() { wdt_reset(); }
  static bool host_is_quiet() { return Serial.availableForWrite() == SERIAL_TX_BUFFER_SIZE - 1; }
  bool eeprom_ready() { return eeprom_is_ready(); }
  uint8_t eeprom_read(uint16_t address) {
    return eeprom_read_byte(reinterpret_cast<const uint8_t*>(address));
  }
  void eeprom_write(uint16_t address, uint8_t byte) {
    eeprom_update_byte(reinterpret_cast<uint8_t*>(address), byte);
  }

  // Sleeps until a byte comes, all has been sent to the host, or the clock ticks (every 1.024 ms).
  // Each byte that is sent to the host wakes the processor, too, which then goes back to sleep.
  void rest() {
    const uint32_t tick = millis();
    const bool quiet = host_is_quiet();
    sleep_while([=] {
      return Serial.available() == 0 && Serial1.available() == 0 && host_is_quiet() == quiet &&
             millis() == tick;
    });
  }

  // Sleeps while the condition holds, which is checked again after each interrupt.
  template <class Condition>
  static void sleep_while(Condition holds) {
    set_sleep_mode(SLEEP_MODE_IDLE);
    noInterrupts();  // else what comes before the sleep would be noticed only at the next tick
    while (holds()) {
      sleep_enable();
      interrupts();
      sleep_cpu();
      sleep_disable();
      noInterrupts();
    }
    interrupts();
  }
};

Board board;
miburi::Card<Board> card(board);

}  // namespace

void setup() {
  MCUSR = 0;
  wdt_enable(WDTO_500MS);
  // The core starts every timer for PWM, which nothing here uses; timer 0 is the clock.
  TCCR1B = TCCR2B = TCCR3B = TCCR4B = TCCR5B = 0;
  pinMode(SENDING, OUTPUT);
  Serial.begin(115200);
  board.bus_speed(miburi::Xl330<Board>::BUS_SPEED);
  card.begin();
}

void loop() {
  wdt_reset();
  card.work();
}
