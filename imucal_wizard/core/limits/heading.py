"""Limits of a heading shown live."""

MAX_FIELD_CHANGE = 0.05
"""Share by which the field may differ from that of the calibration: more is iron, or another
place."""
MAX_DIP_CHANGE_DEG = 3.0
"""The same for its dip: more is iron, or the device is being moved, which spoils gravity."""
