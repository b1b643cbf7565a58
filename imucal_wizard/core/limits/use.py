"""Limits of use: the errors up to which a calibrated sensor serves, by its grade."""

LIMITS_OF_USE: dict[str, dict[str, str]] = {
    "consumer": {"accelerometer": "2 mg", "gyroscope": "1 deg", "magnetometer": "0.5 uT"},
    "industrial": {"accelerometer": "0.5 mg", "gyroscope": "0.3 deg", "magnetometer": "0.2 uT"},
    "tactical": {"accelerometer": "0.1 mg", "gyroscope": "0.05 deg", "magnetometer": "0.05 uT"},
}
"""The gyroscope's is the angle by which a rotation does not close. A consumer part: 2 mg tilts the
horizon by 0.1°, and 0.5 µT turns a heading by 1.4° where 20 µT lie level. Better parts are bought
for errors of about a quarter and a twentieth of these."""
USUAL_GRADE = "consumer"
"""The grade of a sensor of which nothing else is said."""
IMPLAUSIBLE_SCALE = 0.2
"""Logarithm of a scale (18 % too small or 22 % too large) that no sensor has: its unit, range or
sampling rate is wrong, or its fit. No accelerometer has a bias of this share of 1 g."""
FAR_FROM_POSES_DEG = 75.0
"""A direction farther than this from every hold is not covered. Six faces leave at most 55°, and
75° if each face is up to 20° off."""
USUAL_ROTATION_SECONDS = 10.0 / 3.0
"""A rotation by 100° and back at 60 °/s: an error of the rate of 0.3 °/s then sums up to 1°."""
