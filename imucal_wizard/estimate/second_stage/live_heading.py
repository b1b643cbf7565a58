"""The heading of one moment before and after calibration, and whether it can be trusted there."""

import math

import numpy as np

from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.estimate.second_stage.heading import Compass, up_in

Reading = tuple[float, float, float]
MAX_FIELD_CHANGE = 0.05
"""Share by which the field may differ from that at calibration; more is iron, or another place."""
MAX_DIP_CHANGE_DEG = 3.0
"""Degrees by which the dip may differ; more is iron, or a motion that disturbs gravity."""


@dataclass(frozen=True)
class LiveHeading:
    """The heading of the x axis at one moment, degrees clockwise from magnetic north.

    Attributes:
        before: by the readings as they come; NaN where x is upright.
        after: by the calibration.
        error: its standard deviation by what is not known of the calibration.
        size: of the corrected field, in the unit of the calibration.
        dip: of the field below the horizon, degrees.
        rise: of the x axis above the horizon, degrees.
        size_then: of the field when it was calibrated, or None.
        dip_then: the same of its dip, or None.
        noise: standard deviation of the heading by the noise of one reading, or None.
    """

    before: float
    after: float
    error: float
    size: float
    dip: float
    rise: float
    size_then: float | None = None
    dip_then: float | None = None
    noise: float | None = None

    @property
    def change(self) -> float:
        """What the calibration does, degrees between −180 and 180."""
        return (self.after - self.before + 180.0) % 360.0 - 180.0

    @property
    def same_field(self) -> bool:
        """Whether the field is as large as it was when it was calibrated."""
        then = self.size_then
        return then is not None and abs(self.size - then) <= MAX_FIELD_CHANGE * then

    @property
    def same_dip(self) -> bool:
        """Whether the field dips as it did when it was calibrated."""
        return self.dip_then is not None and abs(self.dip - self.dip_then) <= MAX_DIP_CHANGE_DEG


def live_heading(
    report: FitReport, compass: Compass, acceleration: Reading, field: Reading
) -> LiveHeading:
    """The heading by one reading of each sensor, in the units of the stream."""
    force, readings = np.array([acceleration]), np.array([field])
    found = compass.bearings(force, readings)
    before, after, error = np.degrees([found.before[0], found.after[0], found.error[0]])
    up, corrected = up_in(compass.accelerometer, force)[0], compass.field(readings)[0]
    size = float(np.linalg.norm(corrected))
    dip = -_rise(float(up @ corrected) / size)
    magnetic, stage = report.magnetic, report.second_stage
    floor = None if magnetic is None else magnetic.noise
    level = size * math.cos(math.radians(dip))
    return LiveHeading(
        before % 360.0,
        after % 360.0,
        float(error),
        size,
        dip,
        _rise(float(up[0])),
        None if magnetic is None else magnetic.magnitude,
        None if stage is None else math.degrees(stage.alignment.dip),
        math.degrees(floor / level) if floor and level else None,
    )


def _rise(sine: float) -> float:
    """Degrees above the horizon; a unit vector's component may be a bit more than one."""
    return math.degrees(math.asin(min(1.0, max(-1.0, sine))))
