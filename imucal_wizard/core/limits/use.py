"""Limits of use: the errors up to which a calibrated sensor serves, by its grade."""

LIMITS_OF_USE: dict[str, dict[str, float]] = {
    "consumer": {"accelerometer": 0.02, "gyroscope": 0.0175, "magnetometer": 0.5},
    "industrial": {"accelerometer": 0.005, "gyroscope": 0.005, "magnetometer": 0.2},
    "tactical": {"accelerometer": 0.001, "gyroscope": 0.001, "magnetometer": 0.05},
}
"""m/s², rad of one rotation's closure, µT. A consumer part: 2 mg tilts the horizon by 0.1°, a
rotation closes to 1°, 0.5 µT turns a heading by 1.4° where 20 µT lie level. Better parts
are bought for errors of about a quarter and a twentieth of these."""
USUAL_GRADE = "consumer"
"""The grade of a sensor of which nothing else is said."""
