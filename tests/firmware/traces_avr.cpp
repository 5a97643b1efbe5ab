// Traces from UART 0 to decisions on UART 0, on the card's processor, without the Arduino core.
#include <avr/io.h>

#include "trace.h"

struct Uart {
  uint8_t get() {
    while (!(UCSR0A & (1 << RXC0))) {
    }
    return UDR0;
  }
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
  uart.put('>');
  for (;;) {
    run_trace(in, uart);
    uart.put('>');
  }
}
