"""Readings, units, poses, rotation algebra and errors, on which every other package builds."""

VERSION = "0.1.0"
"""Version of the program; sessions and calibration files record it."""
