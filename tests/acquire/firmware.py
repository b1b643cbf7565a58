"""What well-known firmware prints, and what it stands for."""

import math
from collections.abc import Callable

from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.readings import Readings, join_readings

G = 9.80665
DPS = math.pi / 180


def heard(
    sample: Callable[[int], bytes] | bytes, setup: StreamSetup | None = None, count: int = 300
) -> tuple[Intake, Readings | None]:
    """An Intake that has heard some samples, 100 each second."""
    intake = Intake(setup)
    parts = []
    for i in range(count):
        data = sample if isinstance(sample, bytes) else sample(i)
        parts.append(intake.feed(data, i * 0.01))
    there = [p for p in parts if p is not None]
    return intake, join_readings(there) if there else None


FIRMWARE: dict[str, tuple[str, bytes, list[float], list[float]]] = {
    "Adafruit_MPU6050 basic_readings": (
        "adafruit-mpu6050",
        (
            b"Acceleration X: 0.12, Y: -0.45, Z: 9.76 m/s^2\r\nRotation X: -0.02, Y: 0.01, Z: 0.00 "
            b"rad/s\r\nTemperature: 27.31 degC\r\n\r\n"
        ),
        [0.12, -0.45, 9.76],
        [-0.02, 0.01, 0.0],
    ),
    "Adafruit_BNO055 read_all_data": (
        "adafruit-bno055",
        (
            b"Accl:\tx= -0.12 |\ty= 0.33 |\tz= 9.71\r\nGyro:\tx= 0.06 |\ty= -0.06 |\tz= 0.00\r\n"
            b"Mag:\tx= -12.44 |\ty= 30.06 |\tz= -41.75\r\n"
        ),
        [-0.12, 0.33, 9.71],
        [0.06 * DPS, -0.06 * DPS, 0],
    ),
    "SparkFun ICM-20948 scaled": (
        "sparkfun-scaled",
        (
            b"Scaled. Acc (mg) [ -00069.34, -00276.37,  00965.82 ], Gyr (DPS) [ -00000.31,  "
            b" 00001.22, -00000.05 ], Mag (uT) [ -00028.05, -00051.00,  00032.40 ], "
            b"Tmp (C) [  00026.31 ]\r\n"
        ),
        [-0.06934 * G, -0.27637 * G, 0.96582 * G],
        [-0.31 * DPS, 1.22 * DPS, -0.05 * DPS],
    ),
    "SparkFun ICM-20948 raw": (
        "sparkfun-raw",
        (
            b"RAW. Acc [ -01136, -04528,  15824 ], Gyr [ -00041,  00160, -00007 ], Mag [ -00187, "
            b"-00340,  00216 ], Tmp [  01773 ]\r\n"
        ),
        [-1136, -4528, 15824],
        [-41, 160, -7],
    ),
    "i2cdevlib": (
        "i2cdev",
        b"a/g:\t-212\t1044\t16288\t-23\t11\t2\r\n",
        [-212, 1044, 16288],
        [-23, 11, 2],
    ),
    "Razor AHRS": (
        "razor-ahrs",
        b"#A-R=-21.00,4.00,251.00\r\n#M-R=91.00,-13.00,-480.00\r\n#G-R=-42.00,96.00,-18.00\r\n",
        [21, -4, -251],
        [-42, 96, -18],
    ),
    "MotionCal": (
        "raw-uni",
        (
            b"Raw:-58,-815,8362,76,-121,-95,-375,-159,-24\r\n"
            b"Uni:-0.07,-0.98,10.00,0.0832,-0.1327,-0.1046,-37.50,-15.93,-2.50\r\n"
        ),
        [-58 * 9.8 / 8192, -815 * 9.8 / 8192, 8362 * 9.8 / 8192],
        [0.0832, -0.1327, -0.1046],
    ),
    "MotionCal, Uni: alone": (
        "uni",
        b"Uni:-0.07,-0.98,10.00,0.0832,-0.1327,-0.1046,-37.50,-15.93,-2.50\r\n",
        [-0.07, -0.98, 10.0],
        [0.0832, -0.1327, -0.1046],
    ),
    "VectorNav VNIMU": (
        "vnimu",
        (
            b"$VNIMU,-00.0350,+00.4222,-00.6643,-00.015,+00.019,+09.948,+00.002066,-00.008442,"
            b"-00.044656,+20.7,+084.322*66\r\n"
        ),
        [-0.015, 0.019, 9.948],
        [0.002066, -0.008442, -0.044656],
    ),
    "OpenLog Artemis": (
        "openlog-artemis",
        (
            b"rtcDate,rtcTime,aX,aY,aZ,gX,gY,gZ,mX,mY,mZ,imu_degC,output_Hz,\r\n"
            b"01/07/2000,16:18:45.54,-638.67,153.32,782.23,-1.69,1.47,-0.42,21.45,37.80,-5.85,9.77,"
            b"1.00,\r\n"
        ),
        [-0.63867 * G, 0.15332 * G, 0.78223 * G],
        [-1.69 * DPS, 1.47 * DPS, -0.42 * DPS],
    ),
    "own labels with units": (
        "labels",
        b"acc=[0.10,0.20,9.80] m/s^2 gyro=[1.0,2.0,3.0] deg/s T=25.1 C\r\n",
        [0.1, 0.2, 9.8],
        [DPS, 2 * DPS, 3 * DPS],
    ),
}
"""Format, what is printed for one sample, and its specific force and rate in SI or counts."""


ASKING: dict[str, tuple[str, bytes, list[float]]] = {
    "Adafruit_MPU6050 plotter": (
        "labels",
        b"AccelX:0.12,AccelY:-0.45,AccelZ:9.76, GyroX:-0.02,GyroY:0.01,GyroZ:0.00\r\n",
        [0.12, -0.45, 9.76],
    ),
    "CircuitPython tuple": (
        "csv",
        b"(0.12, -0.45, 9.76 , -0.02, 0.01, 0.00)\r\n",
        [0.12, -0.45, 9.76],
    ),
    "tabs": ("csv", b"0.01\t-0.02\t1.00\t0.1\t0.2\t0.3\r\n", [0.01 * G, -0.02 * G, G]),
    "blanks": ("csv", b"10 -20 1000 0.1 0.2 0.3\r\n", [0.01 * G, -0.02 * G, G]),
    "JSON": (
        "json",
        b'{"ax":0.12,"ay":-0.45,"az":9.76,"gx":-0.02,"gy":0.01,"gz":0.0}\r\n',
        [0.12, -0.45, 9.76],
    ),
    "nested JSON": (
        "json",
        b'{"imu":{"acc":[0.12,-0.45,9.76],"gyro":{"x":0,"y":0.01,"z":0.5}},"ok":true}\n',
        [0.12, -0.45, 9.76],
    ),
    "words in front": (
        "labels",
        b"Sensor readings with offsets:\t-0.01\t0.00\t9.81\t0.00\t0.00\t-0.00\r\n",
        [-0.01, 0.0, 9.81],
    ),
    "letters": ("labels", b"a 0.1 0.2 9.8 g 1.0 2.0 3.0\r\n", [0.1, 0.2, 9.8]),
}
"""Format, what is printed, specific force: the unit of the rates is not said."""


STREAMS = {name: entry[1] for name, entry in FIRMWARE.items()}
STREAMS |= {name: entry[1] for name, entry in ASKING.items()}
"""What each of them prints for one sample."""
