// Runs a sketch for some seconds: CHIP_BNO055, CHIP_LSM6DS3 or CHIP_MAG3110 (with the LSM6DS3 beside
// it) says what is on the bus.
#include "Wire.h"

#include SKETCH

uint64_t clockMicros = 4294000000ULL;  // the sketch's clock wraps within the first second
uint64_t endMicros = clockMicros + 30000000ULL;
int hostBytes = 0;
SerialPort Serial;
TwoWire Wire;

static void word(int page, int place, int16_t value) {
  chip.registers[page][place] = (uint8_t)value;
  chip.registers[page][place + 1] = (uint8_t)((uint16_t)value >> 8);
}

#ifdef CHIP_BNO055
Chip chip(0x29, 0x07);
static void powered() {
  chip.registers[0][0x00] = 0xA0;
  chip.registers[0][0x34] = (uint8_t)(int8_t)-3;                             // degC
  const int16_t a[] = {981, -12, -5}, g[] = {16, -32, 1};
  for (int i = 0; i < 3; i++) word(0, 0x08 + 2 * i, a[i]), word(0, 0x14 + 2 * i, g[i]);
}
static void measured() {}
Chip *beside = nullptr;
#else
Chip chip(0x6A, 0xFF);
static void powered() {
  chip.registers[0][0x0F] = 0x6A;
  word(0, 0x20, -256);                                                       // 24 degC
  const int16_t a[] = {8197, -100, -1}, g[] = {57, -114, 1};
  for (int i = 0; i < 3; i++) word(0, 0x28 + 2 * i, a[i]), word(0, 0x22 + 2 * i, g[i]);
}
#ifdef CHIP_MAG3110
static const uint64_t EVERY = 600;  // 1666 Hz
static Chip magnetometer(0x0E, 0xFF);
Chip *beside = &magnetometer;
static void field() {  // a new sample every 1/80 s
  static uint64_t next = clockMicros;
  uint8_t *registers = magnetometer.registers[0];
  const int16_t m[] = {884, -1135, -5};
  for (int i = 0; i < 3; i++) registers[1 + 2 * i] = (uint8_t)((uint16_t)m[i] >> 8), registers[2 + 2 * i] = (uint8_t)m[i];
  registers[0x07] = 0xC4;
  registers[0x00] = registers[0x10] == 0x01 && clockMicros >= next ? 0x08 : 0;
  while (next <= clockMicros) next += 12500;
}
#else
static const uint64_t EVERY = 9615;  // 104 Hz
Chip *beside = nullptr;
static void field() {}
#endif
static void measured() {
  static uint64_t next = clockMicros;
  chip.registers[0][0x1E] = clockMicros >= next ? 3 : 0;
  while (next <= clockMicros) next += EVERY;
  field();
}
#endif

int main() {
  powered();
  measured();
  setup();
  const uint64_t start = clockMicros;
  bool asked = false;
  chip.goes = start + 8000000ULL, chip.returns = start + 8500000ULL;
  while (clockMicros < start + 12000000ULL) {
    if (!asked && clockMicros > start + 2000000ULL) hostBytes = 3, asked = true;
    measured();
    loop();
    clockMicros += 20;
  }
  for (int page = 0; page < 2; page++) {
    printf("# page %d", page);
    for (int place = 0; place < 64; place++) printf(" %02X", chip.registers[page][place]);
    printf("\n");
  }
}
