// Raw readings of a Bosch BNO055 as CSV lines for imucal-wizard.
//
// The fusion modes put out data that the chip has already compensated; a calibration needs what the
// sensors themselves say. So this sketch runs the chip in AMG mode: accelerometer, magnetometer and
// gyroscope on, fusion off.
//
// Wiring: VIN, GND, SDA, SCL. Register numbers and units: data sheet BST-BNO055-DS000-14.

#include <Wire.h>

const uint32_t BAUD = 115200;
const uint32_t PERIOD_US = 10000;      // 100 samples per second
const uint32_t HEADER_US = 5000000;    // the header again every 5 s
const char HEADER[] = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s],temp[degC]";

// Page 0
const uint8_t CHIP_ID = 0x00;          // reads 0xA0
const uint8_t PAGE_ID = 0x07;
const uint8_t DATA = 0x08;             // 6 bytes accelerometer, 6 magnetometer, 6 gyroscope
const uint8_t TEMPERATURE = 0x34;      // signed, 1 degC
const uint8_t UNIT_SEL = 0x3B;         // 0: m/s^2, deg/s, degC
const uint8_t OPR_MODE = 0x3D;
const uint8_t PWR_MODE = 0x3E;
// Page 1
const uint8_t ACC_CONFIG = 0x08;       // 0x0D: 4 g, 62.5 Hz, normal
const uint8_t GYR_CONFIG_0 = 0x0A;     // 0x38: 2000 deg/s, 32 Hz

const uint8_t CONFIG_MODE = 0x00;      // up to 19 ms to get there
const uint8_t AMG_MODE = 0x07;         // up to 7 ms from there

const float ACCELERATION = 0.01f;                    // 100 counts per m/s^2
const float RATE = 0.0174532925f / 16.0f;            // 16 counts per deg/s

uint8_t address = 0x28;
uint32_t lastMicros, nextSample, sinceHeader;
uint32_t seconds, microseconds;

bool writeRegister(uint8_t reg, uint8_t value) {
  Wire.beginTransmission(address);
  Wire.write(reg);
  Wire.write(value);
  return Wire.endTransmission() == 0;
}

bool readRegisters(uint8_t reg, uint8_t *data, uint8_t count) {
  Wire.beginTransmission(address);
  Wire.write(reg);
  if (Wire.endTransmission(false) != 0) return false;
  if (Wire.requestFrom(address, count) != count) return false;
  for (uint8_t i = 0; i < count; i++) data[i] = Wire.read();
  return true;
}

int16_t word16(const uint8_t *data) {
  return (int16_t)((uint16_t)data[1] << 8 | data[0]);
}

bool findChip() {
  for (address = 0x28; address <= 0x29; address++) {
    uint8_t id = 0;
    if (readRegisters(CHIP_ID, &id, 1) && id == 0xA0) return true;
  }
  return false;
}

bool configure() {
  bool good = writeRegister(PAGE_ID, 0) && writeRegister(OPR_MODE, CONFIG_MODE);
  delay(25);
  good = good && writeRegister(PWR_MODE, 0) && writeRegister(UNIT_SEL, 0);
  good = good && writeRegister(PAGE_ID, 1);
  good = good && writeRegister(ACC_CONFIG, 0x0D) && writeRegister(GYR_CONFIG_0, 0x38);
  good = good && writeRegister(PAGE_ID, 0) && writeRegister(OPR_MODE, AMG_MODE);
  delay(25);
  return good;
}

void startChip() {
  while (!findChip() || !configure()) {
    Serial.println("# no BNO055 answers at 0x28 or 0x29: check power, SDA and SCL");
    delay(1000);
  }
}

// Time as whole seconds and microseconds: a float cannot hold it, and micros() wraps after 71 min.
void advanceTime(uint32_t now) {
  microseconds += now - lastMicros;
  lastMicros = now;
  while (microseconds >= 1000000UL) {
    microseconds -= 1000000UL;
    seconds++;
  }
}

void printTime() {
  char text[24];
  snprintf(text, sizeof text, "%lu.%06lu", (unsigned long)seconds, (unsigned long)microseconds);
  Serial.print(text);
}

void printHeader() {
  Serial.println(HEADER);
  sinceHeader = 0;
}

void setup() {
  Serial.begin(BAUD);
  Wire.begin();
  Wire.setClock(400000);
  delay(700);                          // the chip needs 650 ms after power-on
  startChip();
  printHeader();
  lastMicros = nextSample = micros();
}

void loop() {
  if ((int32_t)(micros() - nextSample) < 0) return;
  nextSample += PERIOD_US;
  uint8_t data[18];
  int8_t temperature;
  uint32_t now = micros();
  if (!readRegisters(DATA, data, 18) || !readRegisters(TEMPERATURE, (uint8_t *)&temperature, 1)) {
    Serial.println("# the BNO055 does not answer: starting it again");
    startChip();
    nextSample = micros();
    return;
  }
  advanceTime(now);
  sinceHeader += PERIOD_US;
  bool asked = Serial.available() > 0;
  while (Serial.available() > 0) Serial.read();
  if (asked || sinceHeader >= HEADER_US) printHeader();
  printTime();
  for (uint8_t axis = 0; axis < 3; axis++) {
    Serial.print(',');
    Serial.print(word16(data + 2 * axis) * ACCELERATION, 5);
  }
  for (uint8_t axis = 0; axis < 3; axis++) {
    Serial.print(',');
    Serial.print(word16(data + 12 + 2 * axis) * RATE, 6);
  }
  Serial.print(',');
  Serial.println(temperature);
}
