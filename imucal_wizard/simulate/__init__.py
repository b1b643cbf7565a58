"""The virtual IMU: a hand, a sensor, and the lines that the device prints."""
