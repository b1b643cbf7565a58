// Raw readings of an NXP MAG3110 and an ST LSM6DS3 (or LSM6DS3TR-C) as CSV for imucal-wizard.
//
// Each chip at its highest rate: accelerometer and gyroscope 1666 Hz, magnetometer 80 Hz. A line is
// one sample of accelerometer and gyroscope with its time; where the magnetometer had a new sample
// since the line before (0.6 ms earlier) it stands in the same line, else those fields are empty.
// Counts, so that the lines are short; needs a 32-bit board whose USB is its own (native).
// Registers: data sheets MAG3110 (NXP rev. 9.2), DocID026899 (LSM6DS3), DocID030071 (LSM6DS3TR-C).

#include <Wire.h>

const uint32_t BAUD = 2000000;         // native USB runs at its own speed
const uint32_t HEADER_US = 5000000;    // the header again every 5 s
const uint32_t LOST_US = 200000;       // no new sample for so long: a chip is lost
const uint32_t FIELD_US = 11000;       // 80 Hz: nothing new is to be had earlier
const char HEADER[] = "t[s],mx[uT],my[uT],mz[uT],ax[count],ay[count],az[count],gx[count],gy[count],gz[count]";

const uint8_t MAGNETOMETER = 0x0E;     // its only address
const uint8_t DR_STATUS = 0x00;        // 0x08: new sample of all three axes
const uint8_t OUT_X_MSB = 0x01;        // x, y, z, high byte first, 0.1 uT per count
const uint8_t MAG_WHO_AM_I = 0x07;     // 0xC4
const uint8_t CTRL_REG1 = 0x10;        // 0x01: active, 80 Hz, 16 samples averaged
const uint8_t CTRL_REG2 = 0x11;        // 0xA0: resets its coils by itself, no offsets taken out

const uint8_t WHO_AM_I = 0x0F;         // 0x69 LSM6DS3, 0x6A LSM6DS3TR-C
const uint8_t CTRL1_XL = 0x10;         // 0x88: 1666 Hz, 4 g: 0.122 mg per count
const uint8_t CTRL2_G = 0x11;          // 0x84: 1666 Hz, 500 deg/s: 17.5 mdeg/s per count
const uint8_t CTRL3_C = 0x12;          // 0x44: block update, address counts up; 0x01: reset
const uint8_t STATUS = 0x1E;           // bit 0 new acceleration, bit 1 new rate
const uint8_t OUT_GYRO = 0x22;         // 6 bytes gyroscope, 6 accelerometer, low byte first

uint8_t inertial = 0x6A;
uint32_t lastMicros, lastHeader, lastField;
uint32_t seconds, microseconds;

bool writeRegister(uint8_t address, uint8_t reg, uint8_t value) {
  Wire.beginTransmission(address);
  Wire.write(reg);
  Wire.write(value);
  return Wire.endTransmission() == 0;
}

bool readRegisters(uint8_t address, uint8_t reg, uint8_t *data, uint8_t count) {
  Wire.beginTransmission(address);
  Wire.write(reg);
  if (Wire.endTransmission(false) != 0) return false;
  if (Wire.requestFrom(address, count) != count) return false;
  for (uint8_t i = 0; i < count; i++) data[i] = Wire.read();
  return true;
}

int word16(uint8_t high, uint8_t low) {
  return (int16_t)((uint16_t)high << 8 | low);
}

bool startInertial() {
  for (inertial = 0x6A; inertial <= 0x6B; inertial++) {
    uint8_t id = 0;
    if (!readRegisters(inertial, WHO_AM_I, &id, 1) || (id != 0x69 && id != 0x6A)) continue;
    bool good = writeRegister(inertial, CTRL3_C, 0x01);
    delay(50);
    good = good && writeRegister(inertial, CTRL3_C, 0x44);
    good = good && writeRegister(inertial, CTRL1_XL, 0x88);
    good = good && writeRegister(inertial, CTRL2_G, 0x84);
    delay(100);                        // the gyroscope settles
    return good;
  }
  return false;
}

bool startMagnetometer() {
  uint8_t id = 0;
  if (!readRegisters(MAGNETOMETER, MAG_WHO_AM_I, &id, 1) || id != 0xC4) return false;
  bool good = writeRegister(MAGNETOMETER, CTRL_REG1, 0x00);  // only in standby may it be set
  good = good && writeRegister(MAGNETOMETER, CTRL_REG2, 0xA0);
  return good && writeRegister(MAGNETOMETER, CTRL_REG1, 0x01);
}

void startChips() {
  while (!startInertial()) {
    Serial.println("# no LSM6DS3 answers at 0x6A or 0x6B: check power, SDA and SCL");
    delay(1000);
  }
  while (!startMagnetometer()) {
    Serial.println("# no MAG3110 answers at 0x0E: check power (3.3 V at most), SDA and SCL");
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

void printHeader() {
  Serial.println(HEADER);
  lastHeader = micros();
}

// Three fields of the magnetometer in uT, or three empty ones; false when the chip is lost.
bool fieldText(char *text, size_t size, uint32_t now) {
  uint8_t status = 0, data[6];
  snprintf(text, size, ",,,");
  if ((uint32_t)(now - lastField) < FIELD_US) return true;
  if (!readRegisters(MAGNETOMETER, DR_STATUS, &status, 1)) return false;
  if ((status & 0x08) == 0) return (uint32_t)(now - lastField) < LOST_US;
  if (!readRegisters(MAGNETOMETER, OUT_X_MSB, data, 6)) return false;
  lastField = now;
  size_t used = 0;
  for (uint8_t axis = 0; axis < 3 && used < size; axis++) {
    int tenths = word16(data[2 * axis], data[2 * axis + 1]);
    int whole = abs(tenths);
    used += snprintf(text + used, size - used, ",%s%d.%d", tenths < 0 ? "-" : "", whole / 10, whole % 10);
  }
  return true;
}

void restart(const char *chip) {
  Serial.print("# the ");
  Serial.print(chip);
  Serial.println(" does not answer: starting it again");
  startChips();
  uint32_t now = micros();
  advanceTime(now);
  lastField = now;
}

void setup() {
  Serial.begin(BAUD);
  Wire.begin();
  Wire.setClock(400000);
  delay(100);
  startChips();
  printHeader();
  lastMicros = lastField = micros();
}

void loop() {
  uint8_t status = 0, data[12];
  bool answered = readRegisters(inertial, STATUS, &status, 1);
  uint32_t now = micros();
  if (!answered || (uint32_t)(now - lastMicros) > LOST_US) return restart("LSM6DS3");
  if ((status & 0x03) != 0x03) return;
  if (!readRegisters(inertial, OUT_GYRO, data, 12)) return;
  char field[40], line[120];
  if (!fieldText(field, sizeof field, now)) return restart("MAG3110");
  advanceTime(now);
  bool asked = Serial.available() > 0;
  while (Serial.available() > 0) Serial.read();
  if (asked || (uint32_t)(now - lastHeader) >= HEADER_US) printHeader();
  int counts[6];
  for (uint8_t i = 0; i < 6; i++) counts[i] = word16(data[2 * i + 1], data[2 * i]);
  snprintf(line, sizeof line, "%lu.%06lu%s,%d,%d,%d,%d,%d,%d", (unsigned long)seconds,
           (unsigned long)microseconds, field, counts[3], counts[4], counts[5], counts[0], counts[1],
           counts[2]);
  Serial.println(line);
}
