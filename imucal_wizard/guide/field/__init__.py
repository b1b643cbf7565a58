"""The magnetometer's step: circles turned by hand, evaluated while the device turns."""
