"""The text a virtual IMU prints: a header whose names carry units, then one line per sample."""

import numpy as np

from imucal_wizard.devices.virtual.sensor import SensorModel
from imucal_wizard.devices.virtual.stream import Samples
from imucal_wizard.units import COUNT

HEADER_EVERY = 5.0
"""The header is printed again so often, s, for those who listen late."""


class LinePrinter:
    """Turns samples into lines.

    Args:
        sensor: whose units the columns carry.
        end: what ends a line; Arduino's unless told otherwise.
        field: whether there are columns of a magnetometer, empty where it has no new sample.
        load: whether there is a column of the motors' current.
    """

    def __init__(
        self,
        sensor: SensorModel,
        end: str = "\r\n",
        *,
        field: bool = False,
        load: bool = False,
    ) -> None:
        force, rate = sensor.accelerometer.unit, sensor.gyroscope.unit
        names = ["t[s]"]
        names += [f"a{axis}[{force}]" for axis in "xyz"]
        names += [f"g{axis}[{rate}]" for axis in "xyz"]
        names += [f"m{axis}[uT]" for axis in "xyz"] if field else []
        names += ["current[A]"] if load else []
        names += ["temp[degC]"]
        self.header = (",".join(names) + end).encode()
        acceleration = "%.0f" if force == COUNT else "%.6f"
        turning = "%.0f" if rate == COUNT else "%.7f"
        magnetic = ["%.1f"] * 3 if field else []
        electric = ["%.2f"] if load else []
        formats = ["%.6f", *[acceleration] * 3, *[turning] * 3, *magnetic, *electric, "%.3f"]
        self._format = ",".join(formats) + end

    def lines(self, samples: Samples) -> bytes:
        """The lines of these samples; one formatting for all of them is the quickest way."""
        columns = [samples.time, samples.accelerometer, samples.gyroscope]
        if samples.magnetometer is not None:
            columns.append(samples.magnetometer)
        if samples.current is not None:
            columns.append(samples.current)
        table = np.column_stack([*columns, samples.temperature])
        text = (self._format * len(table)) % tuple(table.ravel().tolist())
        return text.replace("nan", "").encode()
