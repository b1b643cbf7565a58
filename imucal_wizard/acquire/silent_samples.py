"""Samples that are zero on all axes: gravity and the Earth's field never are."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray, Series
from imucal_wizard.core.statistics import true_on_all_axes

INERTIAL = ("accelerometer", "gyroscope")
FIELD = "magnetometer"


class SilentSamples:
    """Finds samples that are zero on all axes, those before the first answer of the sensor too.

    Attributes:
        running: number of silent samples since the last other one.
    """

    def __init__(self) -> None:
        self.running = 0

    @property
    def answers(self) -> bool:
        """Whether the newest sample is a measurement."""
        return not self.running

    def heard(self, values: FloatArray) -> BoolArray | None:
        """Which samples are measurements, shape (n,); None if all are.

        Args:
            values: shape (n, 3), n > 0.
        """
        if values.all():
            self.running = 0
            return None
        heard = ~true_on_all_axes(values == 0.0)
        numbered = np.flatnonzero(heard)
        before = self.running + len(heard)
        self.running = len(heard) - 1 - int(numbered[-1]) if len(numbered) else before
        return None if heard.all() else heard


def heard_rows(
    series: Mapping[str, Series | None], name: str, heard: BoolArray
) -> dict[str, Series]:
    """The series that change if silent samples of one sensor are left out.

    With samples of the accelerometer those of what is read together with it are left out.

    Args:
        series: of one recording or piece of a stream, by sensor.
        name: whose samples are silent.
        heard: the others, shape (n,).
    """
    own = series[name]
    assert own is not None, "silent samples are of a sensor that is there"  # noqa: S101 (narrows the type)
    time, found = own.time[heard], {}  # one array for all sensors that are read together
    for other, beside in series.items():
        together = name in INERTIAL and beside is not None and beside.time is own.time
        if beside is not None and (other == name or together):
            found[other] = replace(beside, time=time, values=beside.values[heard])
    return found
