/* Device side of rtctl's serial frame, for any microcontroller with a C99 compiler. No heap, no operating system.
 *
 *   static rtctl_board board;
 *   rtctl_begin(&board, 1, 0, 1, 0, "my board");        outputs, inputs, counters, writable lines (bits)
 *   for (;;) {
 *     board.counter[0] = encoder_counts;                 before rtctl_byte: values of the next sample
 *     while (a byte is available)
 *       if (rtctl_byte(&board, byte, millis())) send(board.reply, board.reply_length);
 *     rtctl_watch(&board, millis());                     sets outputs to zero where the computer is silent
 *     set_motor(board.on ? board.output[0] : 0.0f);      V, A or Nm: the unit of the drive in the config
 *   }
 *
 * The frame is described in docs/hardware.md. Its floats are IEEE 754 and little-endian, as on every Cortex-M, AVR,
 * RISC-V and Xtensa.
 */
#ifndef RTCTL_BOARD_H
#define RTCTL_BOARD_H

#include <stdint.h>
#include <string.h>

#define RTCTL_VERSION 1
#define RTCTL_MOST 16 /* outputs, inputs and counters, each */

typedef struct {
  /* what the program reads */
  float output[RTCTL_MOST]; /* in the units of the machine's config; zero without commands */
  uint8_t on;               /* 1 while the machine is switched on: power the drives only then */
  uint8_t lines_out;        /* digital lines, one bit each */
  /* what the program writes */
  uint32_t counter[RTCTL_MOST]; /* encoder counts; they may wrap */
  float input[RTCTL_MOST];      /* in the units of the machine's config */
  uint8_t lines_in;
  uint8_t fault; /* 0, or a fault number of your choice that ends the run: over-temperature, emergency stop */
  /* answer to send when rtctl_byte returns 1 */
  uint8_t reply[260];
  uint16_t reply_length;
  /* internal */
  uint8_t outputs, inputs, counters, lines;
  char name[17];
  uint8_t frame[260];
  uint16_t at;
  uint32_t heard, patience;
} rtctl_board;

static inline void rtctl_begin(rtctl_board *b, uint8_t outputs, uint8_t inputs, uint8_t counters, uint8_t lines,
                               const char *name) {
  memset(b, 0, sizeof *b);
  b->outputs = outputs, b->inputs = inputs, b->counters = counters, b->lines = lines;
  strncpy(b->name, name, sizeof b->name - 1);
  b->patience = 50;
}

static inline uint16_t rtctl_crc(const uint8_t *data, uint16_t length) {
  uint16_t crc = 0xFFFF;
  for (uint16_t i = 0; i < length; i++) {
    crc ^= (uint16_t)(data[i] << 8);
    for (int k = 0; k < 8; k++) crc = (uint16_t)(crc & 0x8000 ? (crc << 1) ^ 0x1021 : crc << 1);
  }
  return crc;
}

static inline void rtctl_off(rtctl_board *b) {
  memset(b->output, 0, sizeof b->output);
  b->on = 0, b->lines_out = 0;
}

/* Call in every loop: sets outputs to zero where the computer is silent for longer than its time-out. */
static inline void rtctl_watch(rtctl_board *b, uint32_t now_ms) {
  if (now_ms - b->heard > b->patience) rtctl_off(b);
}

static inline void rtctl_answer(rtctl_board *b, uint8_t kind, uint8_t length) {
  b->reply[0] = 0xA5, b->reply[1] = kind, b->reply[2] = length;
  uint16_t crc = rtctl_crc(b->reply + 1, (uint16_t)(length + 2));
  b->reply[3 + length] = (uint8_t)crc, b->reply[4 + length] = (uint8_t)(crc >> 8);
  b->reply_length = (uint16_t)(length + 5);
}

/* Processes one byte; returns 1 when `reply` must be sent. */
static inline int rtctl_byte(rtctl_board *b, uint8_t byte, uint32_t now_ms) {
  if (b->at == 0 && byte != 0xA5) return 0;
  b->frame[b->at++] = byte;
  if (b->at < 3 || b->at < (uint16_t)(b->frame[2] + 5)) return 0;
  uint8_t kind = b->frame[1], length = b->frame[2], *in = b->frame + 3, *out = b->reply + 3;
  uint16_t crc = rtctl_crc(b->frame + 1, (uint16_t)(length + 2));
  b->at = 0;
  if ((uint8_t)crc != in[length] || (uint8_t)(crc >> 8) != in[length + 1]) return 0; /* the computer asks again */
  if (kind == 0x01 && length == 3) {
    rtctl_off(b);
    b->patience = (uint32_t)in[1] | (uint32_t)in[2] << 8;
    uint8_t name = (uint8_t)strlen(b->name);
    out[0] = RTCTL_VERSION, out[1] = b->outputs, out[2] = b->inputs, out[3] = b->counters, out[4] = b->lines;
    memcpy(out + 5, b->name, name);
    rtctl_answer(b, 0x81, (uint8_t)(5 + name));
    return 1;
  }
  if (kind == 0x02 && length == 3 + 4 * b->outputs) {
    b->heard = now_ms;
    b->on = in[1], b->lines_out = in[2] & b->lines;
    memcpy(b->output, in + 3, 4u * b->outputs);
    out[0] = in[0], out[1] = b->fault, out[2] = b->lines_in;
    memcpy(out + 3, b->counter, 4u * b->counters);
    memcpy(out + 3 + 4 * b->counters, b->input, 4u * b->inputs);
    rtctl_answer(b, 0x82, (uint8_t)(3 + 4 * (b->counters + b->inputs)));
    return 1;
  }
  return 0;
}

#endif
