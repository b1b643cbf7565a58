"""An IMU that does not exist, on a real pseudo-terminal: a hand, a sensor, a serial line."""
