// Traces from UART 0 to decisions on UART 0, on the card's processor, without the Arduino core.
#include <avr/io.h>

#include "trace.h"

const uint8_t OF_MOTOR = miburi::GUARDS_SIZE + miburi::FREE_SERVO_SIZE + 2 * 40;
const uint16_t TRACE = 8 + miburi::MOTORS * OF_MOTOR + 12 + 4 * 24;  // bytes

// A trace is taken in whole before it is judged: nobody listens meanwhile.
struct Uart {
  uint8_t trace[TRACE];
  uint16_t at;

  void listen() {
    for (at = 0; at < TRACE; at++) {
      while (!(UCSR0A & (1 << RXC0))) {
      }
      trace[at] = UDR0;
    }
    at = 0;
  }
  uint8_t get() { return trace[at++]; }
  void put(uint8_t byte) {
    while (!(UCSR0A & (1 << UDRE0))) {
    }
    UDR0 = byte;
  }
};

int main() {
  UCSR0A = 1 << U2X0;
  UBRR0 = 1;  // 1 Mbit/s
  UCSR0B = (1 << RXEN0) | (1 << TXEN0);
  Uart uart;
  Numbers<Uart> in{uart};
  for (;;) {
    uart.put('>');
    uart.listen();
    run_trace(in, uart);
  }
}
