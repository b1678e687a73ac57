/* A DC motor with an encoder on any Arduino with two interrupt pins: PWM on 9, direction on 8, encoder A and B on 2 and 3.
 * The config's drive is in volts of a 12 V bridge. Never run on a device; docs/hardware.md says what to try first. */
#include "rtctl_board.h"

static rtctl_board board;
static volatile int32_t counts;

static void edge() { counts += digitalRead(2) == digitalRead(3) ? 1 : -1; }

void setup() {
  pinMode(8, OUTPUT), pinMode(9, OUTPUT);
  attachInterrupt(digitalPinToInterrupt(2), edge, CHANGE);
  Serial.begin(1000000);
  rtctl_begin(&board, 1, 0, 1, 0, "arduino");
}

void loop() {
  noInterrupts();
  board.counter[0] = (uint32_t)counts;
  interrupts();
  while (Serial.available())
    if (rtctl_byte(&board, (uint8_t)Serial.read(), millis())) Serial.write(board.reply, board.reply_length);
  rtctl_watch(&board, millis());
  float volts = board.on ? board.output[0] : 0.0f;
  digitalWrite(8, volts >= 0);
  analogWrite(9, (int)min(255.0f, 255.0f * fabs(volts) / 12.0f));
}
