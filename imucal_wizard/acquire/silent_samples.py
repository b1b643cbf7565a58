"""Samples that are zero on all axes: gravity and the Earth's field never are."""

from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from imucal_wizard.core.quantities import plural
from imucal_wizard.core.readings import BoolArray, FloatArray, Readings, Series
from imucal_wizard.core.statistics import true_on_all_axes

INERTIAL = ("accelerometer", "gyroscope")
FIELD = "magnetometer"
MAX_SILENT_SHARE = {"accelerometer": 0.5, FIELD: 1.0}
"""Share of samples that are zero on all axes above which they are what the device sends: one that
removes gravity sends zero at rest. Nothing removes the field, and a file with a line for each
measurement of a faster sensor may be filled up with zeros to any share."""


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


def series_of(readings: Readings) -> dict[str, Series | None]:
    """The readings by sensor."""
    return {name: getattr(readings, name) for name in (*INERTIAL, FIELD)}


def sends_zeros(name: str, series: Series | None) -> bool:
    """Whether the zeros of a sensor are what it sends, as those of one that never answers are.

    Args:
        name: of the sensor.
        series: a recording of it, or the beginning of one.
    """
    heard = SilentSamples().heard(series.values) if series is not None and len(series) else None
    if heard is None:
        return False
    return not heard.any() or float((~heard).mean()) > MAX_SILENT_SHARE[name]


def silent_note(name: str, count: int) -> str:
    """What is said of the silent samples of a sensor."""
    return (
        f"{plural(count, 'sample')} of the {name} read exactly zero on all axes: the sensor did "
        "not answer, or the file was filled up; left out"
    )


class SilenceFilter:
    """Leaves out the silent samples of what arrives in pieces.

    Args:
        names: the sensors of which samples may be silent.

    Attributes:
        watches: by sensor.
        left_out: number of samples that were left out, by sensor.
    """

    def __init__(self, names: Iterable[str] = MAX_SILENT_SHARE) -> None:
        self.watches = {name: SilentSamples() for name in names}
        self.left_out: dict[str, int] = {}

    def feed(self, readings: Readings) -> Readings:
        """The measurements of a piece."""
        for name, watch in self.watches.items():
            series = series_of(readings)
            own = series[name]
            heard = watch.heard(own.values) if own is not None and len(own) else None
            if heard is not None:
                readings = replace(readings, **heard_rows(series, name, heard))  # type: ignore[arg-type] # by sensor
                self.left_out[name] = self.left_out.get(name, 0) + int((~heard).sum())
        return readings
