"""The frozen snapshot that the reader thread hands to the screen."""

import math
from dataclasses import field

import numpy as np

from imucal_wizard.acquire.decode.base import Column
from imucal_wizard.core.limits.procedure import MAX_PREVIEW_GRAVITY_ERROR, MIN_PRINTED_DECIMALS
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import ACCELERATION_UNITS, COUNT, STANDARD_GRAVITY
from imucal_wizard.guide.instruction import Flow
from imucal_wizard.guide.state import Event, Status


@dataclass(frozen=True)
class StreamStatus:
    """The stream at one moment.

    Attributes:
        source: description of the source ("virtual IMU", "/dev/ttyACM0, Arduino Nano").
        format: name of the format, or "" while unknown.
        connected: False while the port is lost or not yet open.
        problem: the problem and what to do, or "".
        busy: the problem ends by itself (a port is being opened, a session restored).
        stalled: the port is open, but no samples arrive.
        unwritten: why what was received is not on the disk yet, or ""; the disk has failed if the
            source has finished.
        rate: samples per second, 0 while unknown.
        samples: number of samples decoded.
        lost: number of lost samples, without those lost while the device was away.
        malformed: number of lines or frames dropped.
        temperature: newest temperature, °C, or None.
        accelerometer: newest reading, or None.
        gyroscope: newest reading, or None.
        magnetometer: newest reading, or None.
        accelerometer_unit: ``m/s^2`` or ``count``.
        gyroscope_unit: ``rad/s`` or ``count``.
        magnetometer_unit: ``uT`` or ``count``.
        gravity: magnitude of the newest second's mean acceleration, in its unit, or None.
        digits: printed decimals of the accelerometer columns, or None if not text.
        warnings: warnings, newest last, each once.
        needs: properties that must be stated before samples can be read (``columns``, ``gyroscope
            unit`` …).
        columns: the columns as far as they are known, with a proposal if they must be stated.
        line: the newest line, printable.
        values: the numbers read from it, one per column.
    """

    source: str = ""
    format: str = ""
    connected: bool = False
    problem: str = ""
    busy: bool = False
    stalled: bool = False
    unwritten: str = ""
    rate: float = 0.0
    samples: int = 0
    lost: int = 0
    malformed: int = 0
    temperature: float | None = None
    accelerometer: tuple[float, float, float] | None = None
    gyroscope: tuple[float, float, float] | None = None
    magnetometer: tuple[float, float, float] | None = None
    accelerometer_unit: str = "m/s^2"
    gyroscope_unit: str = "rad/s"
    magnetometer_unit: str = "uT"
    gravity: float | None = None
    digits: int | None = None
    warnings: tuple[str, ...] = ()
    needs: tuple[str, ...] = ()
    columns: tuple[Column, ...] = ()
    line: str = ""
    values: tuple[float, ...] = ()

    def flow(self, *, ended: bool) -> Flow:
        """Whether samples arrive; ``ended``: the source has ended."""
        return Flow(self.connected, self.stalled, ended)

    @property
    def units(self) -> dict[str, str]:
        """Unit of the readings of accelerometer and gyroscope; a sensor not there is left out."""
        found = {"accelerometer": self.accelerometer_unit}
        return found if self.gyroscope is None else {**found, "gyroscope": self.gyroscope_unit}

    @property
    def gravity_right(self) -> bool | None:
        """Whether the accelerometer's unit is plausible; None if unknown."""
        if self.gravity is None or self.accelerometer_unit == COUNT:
            return None
        return math.isclose(self.gravity, STANDARD_GRAVITY, rel_tol=MAX_PREVIEW_GRAVITY_ERROR)

    @property
    def few_digits(self) -> bool:
        """Whether too few decimals are printed to show the noise; counts have none."""
        printed = next((c.unit for c in self.columns if c.channel == "ax"), "")
        if self.accelerometer_unit == COUNT or self.digits is None:
            return False
        if not self.digits and not printed:  # whole numbers may be counts
            return False
        last = ACCELERATION_UNITS.get(printed, 1.0) * 10.0**-self.digits
        return bool(last > 10.0 ** (0.5 - MIN_PRINTED_DECIMALS))  # nearest decimal in m/s²


def _no_traces() -> FloatArray:
    return np.zeros((0, 6))


@dataclass(frozen=True, eq=False)
class Snapshot:
    """Everything a screen shows at one moment.

    Attributes:
        serial: increases by one with every new snapshot.
        stream: the stream.
        status: the procedure.
        events: the newest events, oldest first, at most 50.
        event_count: total number of events; the screen plays the new ones.
        traces: newest seconds of all six channels, shape (n, 6), decimated for drawing; NaN without
            a gyroscope.
        attitude: body-to-world rotation matrix for the drawing, shape (3, 3), or None.
        finished: the source has ended (a file) or the reader has stopped.
    """

    serial: int = 0
    stream: StreamStatus = field(default_factory=StreamStatus)
    status: Status = field(default_factory=Status)
    events: tuple[Event, ...] = ()
    event_count: int = 0
    traces: FloatArray = field(default_factory=_no_traces)
    attitude: FloatArray | None = None
    finished: bool = False
