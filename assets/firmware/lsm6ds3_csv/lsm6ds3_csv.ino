// Raw readings of an ST LSM6DS3 (or LSM6DS3TR-C) as CSV lines for imucal-wizard.
//
// Wiring: VIN, GND, SDA, SCL; on an Arduino Nano 33 IoT or a Seeed XIAO Sense the chip is on board.
// Register numbers and units: data sheets DocID026899 (LSM6DS3) and DocID030071 (LSM6DS3TR-C).

#include <Wire.h>

const uint32_t BAUD = 115200;
const uint32_t HEADER_US = 5000000;    // the header again every 5 s
const uint32_t LOST_US = 200000;       // no new sample for so long: the chip is lost
const char HEADER[] = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s],temp[degC]";

const uint8_t WHO_AM_I = 0x0F;         // 0x69 LSM6DS3, 0x6A LSM6DS3TR-C
const uint8_t CTRL1_XL = 0x10;         // 0x48: 104 Hz, 4 g
const uint8_t CTRL2_G = 0x11;          // 0x44: 104 Hz, 500 deg/s
const uint8_t CTRL3_C = 0x12;          // 0x44: block update, address counts up; 0x01: reset
const uint8_t STATUS = 0x1E;           // bit 0 new acceleration, bit 1 new rate
const uint8_t OUT_TEMP = 0x20;         // 2 bytes temperature, 6 gyroscope, 6 accelerometer

const float ACCELERATION = 0.122e-3f * 9.80665f;     // 0.122 mg per count
const float RATE = 17.50e-3f * 0.0174532925f;        // 17.50 mdeg/s per count

uint8_t address = 0x6A;
float degreesPerCount = 1.0f / 16.0f;                // LSM6DS3; the TR-C has 256 counts per degC
uint32_t lastMicros, lastHeader;
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
  for (address = 0x6A; address <= 0x6B; address++) {
    uint8_t id = 0;
    if (!readRegisters(WHO_AM_I, &id, 1) || (id != 0x69 && id != 0x6A)) continue;
    degreesPerCount = id == 0x69 ? 1.0f / 16.0f : 1.0f / 256.0f;
    return true;
  }
  return false;
}

bool configure() {
  bool good = writeRegister(CTRL3_C, 0x01);
  delay(50);
  good = good && writeRegister(CTRL3_C, 0x44);
  good = good && writeRegister(CTRL1_XL, 0x48) && writeRegister(CTRL2_G, 0x44);
  delay(100);                          // the gyroscope settles
  return good;
}

void startChip() {
  while (!findChip() || !configure()) {
    Serial.println("# no LSM6DS3 answers at 0x6A or 0x6B: check power, SDA and SCL");
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
  lastHeader = micros();
}

void setup() {
  Serial.begin(BAUD);
  Wire.begin();
  Wire.setClock(400000);
  delay(100);
  startChip();
  printHeader();
  lastMicros = micros();
}

void loop() {
  uint8_t status = 0;
  bool answered = readRegisters(STATUS, &status, 1);
  uint32_t now = micros();
  if (!answered || (uint32_t)(now - lastMicros) > LOST_US) {
    Serial.println("# the LSM6DS3 does not answer: starting it again");
    startChip();
    advanceTime(micros());
    return;
  }
  if ((status & 0x03) != 0x03) return;
  uint8_t data[14];
  if (!readRegisters(OUT_TEMP, data, 14)) return;
  advanceTime(now);
  bool asked = Serial.available() > 0;
  while (Serial.available() > 0) Serial.read();
  if (asked || (uint32_t)(now - lastHeader) >= HEADER_US) printHeader();
  printTime();
  for (uint8_t axis = 0; axis < 3; axis++) {
    Serial.print(',');
    Serial.print(word16(data + 8 + 2 * axis) * ACCELERATION, 5);
  }
  for (uint8_t axis = 0; axis < 3; axis++) {
    Serial.print(',');
    Serial.print(word16(data + 2 + 2 * axis) * RATE, 6);
  }
  Serial.print(',');
  Serial.println(25.0f + word16(data) * degreesPerCount, 3);
}
