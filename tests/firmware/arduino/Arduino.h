// As much of Arduino as the sketches use, on a clock that only they move.
#pragma once
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>

extern uint64_t clockMicros;  // true time; a sketch sees its lower 32 bits
extern uint64_t endMicros;    // a sketch that still waits then is stopped
extern int hostBytes;         // how many bytes the host has sent and nobody has read

inline void passes(uint64_t time) {
  clockMicros += time;
  if (clockMicros > endMicros) exit(3);
}

inline uint32_t micros() {
  passes(4);
  return (uint32_t)clockMicros;
}
inline void delay(uint32_t milliseconds) { passes(1000ULL * milliseconds); }

struct SerialPort {
  void begin(uint32_t baud) { printf("# baud %u\n", baud); }
  int available() { return hostBytes; }
  int read() { return hostBytes > 0 ? (hostBytes--, 'x') : -1; }
  void print(const char *text) { printf("%s", text); }
  void print(char letter) { putchar(letter); }
  void print(float value, int digits) { printf("%.*f", digits, (double)value); }
  void println(const char *text) { printf("%s\r\n", text); }
  void println(float value, int digits) { printf("%.*f\r\n", digits, (double)value); }
  void println(int value) { printf("%d\r\n", value); }
};
extern SerialPort Serial;
