// The I2C bus, with one or two chips on it: registers that count up, on pages if there are any.
#pragma once
#include "Arduino.h"

struct Chip {
  uint8_t address;
  uint8_t pageRegister;  // 0xFF: it has no pages
  uint8_t registers[2][128] = {};
  uint64_t goes = ~0ULL, returns = ~0ULL;  // when it is off the bus
  bool away() const { return clockMicros >= goes && clockMicros < returns; }
  Chip(uint8_t onBus, uint8_t paged) : address(onBus), pageRegister(paged) {}
  uint8_t page() const { return pageRegister == 0xFF ? 0 : registers[0][pageRegister] & 1; }
  void written(uint8_t place, uint8_t value) {
    if (place == pageRegister) registers[0][place] = registers[1][place] = value;
    else registers[page()][place] = value;
  }
};
extern Chip chip;
extern Chip *beside;  // a second chip, or none

inline Chip *answering(uint8_t address) {
  if (address == chip.address && !chip.away()) return &chip;
  return beside && address == beside->address && !beside->away() ? beside : nullptr;
}

struct TwoWire {
  uint8_t target = 0, place = 0;
  bool placed = false;
  int left = 0;
  void begin() {}
  void setClock(uint32_t) {}
  void beginTransmission(uint8_t address) { target = address, placed = false; }
  void write(uint8_t byte) {
    if (!placed) place = byte, placed = true;
    else if (answering(target)) answering(target)->written(place++, byte);
  }
  uint8_t endTransmission(bool stop = true) {
    (void)stop;
    passes(60);
    return answering(target) ? 0 : 2;
  }
  uint8_t requestFrom(uint8_t address, uint8_t count) {
    passes(30u * count);
    left = answering(address) ? count : 0;
    return (uint8_t)left;
  }
  int read() {
    Chip *from = answering(target);
    return left-- > 0 && from ? from->registers[from->page()][place++] : -1;
  }
};
extern TwoWire Wire;
