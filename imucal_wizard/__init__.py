"""A guided calibration wizard in the terminal for MEMS inertial sensors."""

__version__ = "0.1.0"
