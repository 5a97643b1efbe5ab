/* An Arduino Mega 2560 in virtual time: runs an ELF with libsimavr, and exchanges its UART bytes.
 *
 * Copyright: the Miburi founders. Licence of this file: GPL-3.0-or-later, as it is linked with
 * libsimavr (GPL-3). It is compiled on the user's machine. The miburi package does not contain it,
 * and needs it only to emulate a card.
 *
 * It changes libsimavr 1.6 in four points: a byte takes 10 bit times, not 11; a UART keeps three
 * unread bytes at most; the flag that there is room for a byte to send is read-only; sleep jumps to
 * the next event instead of waiting.
 */
#include <simavr/avr_eeprom.h>
#include <simavr/avr_extint.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_cycle_timers.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_io.h>
#include <simavr/sim_irq.h>
#include <stdarg.h>
#include <stdlib.h>
#include <string.h>

enum { UARTS = 2, QUEUE = 1 << 16, KEPT = 3 };

typedef struct {
  avr_t *avr;
  avr_uart_t *uart;
  avr_irq_t *in;
  uint8_t queue[QUEUE]; /* to the card, each not before its time */
  avr_cycle_count_t times[QUEUE];
  unsigned head, tail;
  uint8_t sent[QUEUE]; /* by the card */
  unsigned count;
  avr_cycle_count_t last_sent;
  unsigned dropped;
} port_t;

typedef struct {
  avr_t *avr;
  port_t ports[UARTS];
} mega_t;

static avr_cycle_count_t byte_time(port_t *p) {
  const uint8_t *data = p->avr->data;
  const unsigned ubrr = data[p->uart->ubrrl.reg] | ((data[p->uart->ubrrh.reg] & 15u) << 8);
  const unsigned bit = avr_regbit_get(p->avr, p->uart->u2x) ? 8 : 16;
  return p->uart->cycles_per_byte = 10 * bit * (ubrr + 1);
}

static avr_cycle_count_t deliver(avr_t *avr, avr_cycle_count_t when, void *param) {
  port_t *p = param;
  (void)when;
  const avr_cycle_count_t pace = byte_time(p);
  const unsigned unread = (p->uart->input.write - p->uart->input.read) & 63u;
  if (unread < KEPT) {
    avr_raise_irq(p->in, p->queue[p->tail]);
  } else {
    p->dropped++;
  }
  p->tail = (p->tail + 1) % QUEUE;
  if (p->tail == p->head) return 0;
  const avr_cycle_count_t next = avr->cycle + pace;
  return p->times[p->tail] > next ? p->times[p->tail] : next;
}

static void on_output(avr_irq_t *irq, uint32_t value, void *param) {
  port_t *p = param;
  (void)irq;
  byte_time(p);
  if (p->count < QUEUE) p->sent[p->count++] = (uint8_t)value;
  p->last_sent = p->avr->cycle;
}

static void on_status(avr_t *avr, avr_io_addr_t address, uint8_t value, void *param) {
  port_t *p = param;
  (void)address, (void)value;
  if (p->uart->tx_cnt < 2) avr_regbit_set(avr, p->uart->udrc.raised);
}

static void no_sleep(avr_t *avr, avr_cycle_count_t how_long) { (void)avr, (void)how_long; }

static void no_log(avr_t *avr, const int level, const char *format, va_list list) {
  (void)avr, (void)level, (void)format, (void)list;
}

static avr_cycle_count_t halt(avr_t *avr, avr_cycle_count_t when, void *param) {
  (void)avr, (void)when, (void)param;
  return 0;
}

mega_t *mega_new(const char *elf) {
  avr_global_logger_set(no_log);
  elf_firmware_t firmware;
  memset(&firmware, 0, sizeof firmware);
  if (elf_read_firmware(elf, &firmware) != 0) return NULL;
  mega_t *m = calloc(1, sizeof *m);
  avr_t *avr = m ? avr_make_mcu_by_name("atmega2560") : NULL;
  if (!avr) return NULL;
  m->avr = avr;
  avr->log = LOG_NONE;
  avr_init(avr);
  avr_load_firmware(avr, &firmware);
  free(firmware.flash);
  avr->log = LOG_NONE;
  avr->frequency = 16000000;
  avr->sleep = no_sleep;
  avr->gdb_port = 0;
  for (int i = 0; i < UARTS; i++) {
    port_t *p = &m->ports[i];
    const char name = (char)('0' + i);
    uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS(name), &flags);
    p->avr = avr;
    for (avr_io_t *io = avr->io_port; io; io = io->next)
      if (!strcmp(io->kind, "uart") && ((avr_uart_t *)io)->name == name) p->uart = (avr_uart_t *)io;
    p->in = avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(name), UART_IRQ_INPUT);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ(name), UART_IRQ_OUTPUT),
                            on_output, p);
    avr_register_io_write(avr, p->uart->r_ucsra, on_status, p);
  }
  return m;
}

void mega_free(mega_t *m) {
  avr_terminate(m->avr);
  free(m);
}

uint64_t mega_cycle(mega_t *m) { return m->avr->cycle; }

/* Runs until a cycle, or until the card has sent a burst on UART 1 and fallen silent.
 * Returns 0: time reached, 1: burst, 2: the processor has crashed. */
int mega_run(mega_t *m, uint64_t until) {
  avr_t *avr = m->avr;
  port_t *bus = &m->ports[1];
  /* Two things for speed, needed after each reset: long runs, no polling of unused pins. */
  avr->run_cycle_limit = 1000;
  for (int i = 0; i < 8; i++) avr_extint_set_strict_lvl_trig(avr, i, 0);
  avr_cycle_timer_register(avr, until > avr->cycle ? until - avr->cycle : 1, halt, m);
  while (avr->cycle < until) {
    const int state = avr_run(avr);
    if (state == cpu_Done || state == cpu_Crashed) return 2;
    /* Coinciding interrupts can delay a byte within a packet by more than three bytes' time. */
    if (bus->count && avr->cycle - bus->last_sent > 5 * byte_time(bus)) {
      avr_cycle_timer_cancel(avr, halt, m);
      return 1;
    }
  }
  return 0;
}

/* Sends bytes to a UART, back to back, the first no earlier than `at`. */
void mega_input(mega_t *m, int port, const uint8_t *bytes, unsigned count, uint64_t at) {
  port_t *p = &m->ports[port];
  const int idle = p->head == p->tail;
  for (unsigned i = 0; i < count && (p->head + 1) % QUEUE != p->tail; i++) {
    p->queue[p->head] = bytes[i];
    p->times[p->head] = at;
    p->head = (p->head + 1) % QUEUE;
  }
  if (idle && count) {
    const uint64_t now = m->avr->cycle;
    avr_cycle_timer_register(m->avr, at > now + 1 ? at - now : 1, deliver, p);
  }
}

/* Takes what the card has sent on a UART. */
unsigned mega_output(mega_t *m, int port, uint8_t *bytes, unsigned room) {
  port_t *p = &m->ports[port];
  const unsigned n = p->count < room ? p->count : room;
  memcpy(bytes, p->sent, n);
  memmove(p->sent, p->sent + n, p->count - n);
  p->count -= n;
  return n;
}

/* Bytes on their way to a UART, and bytes lost because it was not read in time. */
unsigned mega_waiting(mega_t *m, int port) {
  return (m->ports[port].head - m->ports[port].tail) % QUEUE;
}
unsigned mega_dropped(mega_t *m, int port) { return m->ports[port].dropped; }

/* A UART's baud rate. */
unsigned mega_baud(mega_t *m, int port) {
  return (unsigned)(m->avr->frequency * 10 / byte_time(&m->ports[port]));
}

/* The reset button. */
void mega_reset(mega_t *m) {
  for (int i = 0; i < UARTS; i++) {
    avr_cycle_timer_cancel(m->avr, deliver, &m->ports[i]);
    m->ports[i].head = m->ports[i].tail = 0;
  }
  avr_reset(m->avr);
}

void mega_eeprom(mega_t *m, uint8_t *bytes, unsigned count, int write) {
  avr_eeprom_desc_t d = {.ee = bytes, .offset = 0, .size = count};
  if (write) {
    avr_ioctl(m->avr, AVR_IOCTL_EEPROM_SET, &d);
  } else {
    d.ee = NULL;
    avr_ioctl(m->avr, AVR_IOCTL_EEPROM_GET, &d);
    memcpy(bytes, d.ee, count);
  }
}


/* For tests: writes and reads data memory, and sets the program counter. */
void mega_poke(mega_t *m, unsigned address, uint8_t byte) { m->avr->data[address] = byte; }
unsigned mega_peek(mega_t *m, unsigned address) { return m->avr->data[address]; }
void mega_jump(mega_t *m, unsigned pc) { m->avr->pc = pc; }
