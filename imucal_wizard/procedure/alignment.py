"""Both sensors at the same times: what the detection of rest looks at."""

from dataclasses import replace

import numpy as np

from imucal_wizard.readings import Readings, Series


def aligned(readings: Readings) -> Readings:
    """The gyroscope at the accelerometer's times, by linear interpolation, where it has its own."""
    own, gyroscope = readings.accelerometer, readings.gyroscope
    if gyroscope is None or np.array_equal(own.time, gyroscope.time):
        return readings
    columns = [np.interp(own.time, gyroscope.time, column) for column in gyroscope.values.T]
    return replace(readings, gyroscope=Series(own.time, np.column_stack(columns), gyroscope.unit))
