"""The version of the program, as sessions and calibration files record it."""

VERSION = "0.1.0"
