"""The heading of one moment, before and after calibration, and whether it can be trusted there."""

import math
from dataclasses import dataclass

import numpy as np

from imucal_wizard.fitting.compass import Compass, up_in
from imucal_wizard.live.snapshot import StreamStatus
from imucal_wizard.second_stage_text import heading_summary
from imucal_wizard.solver.result import FitReport
from imucal_wizard.tui.text import Line, line, number, unit_sign, wrapped

NEAR = 0.05
"""Share by which the field's size may differ from that of the calibration."""
NEAR_DEG = 3.0
"""The same for its dip."""
_TAKES = (
    "It takes the circles of the step Field, and the device held still in its poses while the "
    "magnetometer records, so that the two sensors can be aligned by the dip of the field."
)


@dataclass(frozen=True)
class Course:
    """The heading of the x axis at one moment, degrees clockwise from magnetic north.

    Attributes:
        before: by the readings as they come; NaN where x is upright.
        after: by the calibration.
        error: its standard deviation by what is not known of the calibration.
        size: of the corrected field, in the unit of the calibration.
        dip: of the field below the horizon, degrees.
        rise: of the x axis above the horizon, degrees.
    """

    before: float
    after: float
    error: float
    size: float
    dip: float
    rise: float


def course(compass: Compass, stream: StreamStatus) -> Course | None:
    """The heading by the newest readings, or None while one of the two is missing."""
    if stream.accelerometer is None or stream.magnetometer is None:
        return None
    force, readings = np.array([stream.accelerometer]), np.array([stream.magnetometer])
    found = compass.bearings(force, readings)
    before, after, error = np.degrees([found.before[0], found.after[0], found.error[0]])
    up, field = up_in(compass.accelerometer, force)[0], compass.field(readings)[0]
    size = float(np.linalg.norm(field))
    return Course(
        before % 360.0,
        after % 360.0,
        float(error),
        size,
        -_rise(float(up @ field) / size),
        _rise(float(up[0])),
    )


def _rise(sine: float) -> float:
    """Degrees above the horizon; a unit vector's component may be a bit more than one."""
    return math.degrees(math.asin(min(1.0, max(-1.0, sine))))


def large(degrees: float) -> str:
    """A heading to be read from two metres."""
    return f"{degrees % 360.0:.1f}°" if math.isfinite(degrees) else "–"


def course_rows(now: Course | None, report: FitReport, width: int) -> list[Line]:
    """What the calibration does here, whether field and dip are those of the calibration."""
    if now is None:
        return [line("no reading of the magnetometer yet", "quiet")]
    rows = [_after(now, report), _change(now), _field(now, report), _dip(now, report)]
    if report.second_stage is None:
        return rows
    change, left = np.degrees(heading_summary(report.second_stage.headings))
    if math.isfinite(change):
        says = f"In the still positions before and after differ by {change:.1f}° rms; "
        rows += wrapped(f"{says}the error left is {left:.2f}°.", width, "quiet")
    return rows


def no_heading_rows(report: FitReport, width: int) -> list[Line]:
    """Why there is no heading, and what it takes."""
    if report.magnetic is None:
        rows = wrapped("There is no heading without a calibrated magnetometer.", width, "warn")
    else:
        rows = wrapped("Nothing says yet how the magnetometer lies in the device.", width, "warn")
    for text in (text for text in report.warnings if "magnetometer" in text):
        rows += wrapped(f"▲ {text}", width, "", indent="  ")
    return [*rows, line(""), *wrapped(_TAKES, width)]


def _after(now: Course, report: FitReport) -> Line:
    """The heading with what the calibration does not know of it, and what one reading adds."""
    if not math.isfinite(now.after):
        return (("▲ x stands upright: no heading. Lay it flatter", "warn"),)
    known = f"{now.after:.1f} ± {now.error:.2f}°"
    noise = None if report.magnetic is None else report.magnetic.fit.floor
    level = now.size * math.cos(math.radians(now.dip))
    adds = f"; noise of one reading ± {math.degrees(noise / level):.1f}°" if noise and level else ""
    return (("after ", "quiet"), (known, "good"), (f" by the calibration{adds}", "quiet"))


def _change(now: Course) -> Line:
    off = (now.after - now.before + 180.0) % 360.0 - 180.0
    turns = f"the calibration turns it by {off:+.1f}°; ".replace("-", "−")
    rise, where = round(abs(now.rise)), "above" if now.rise >= 0 else "below"
    lies = f"{rise}° {where} the horizon" if rise else "level"
    return (turns if math.isfinite(off) else "", "strong"), (f"the x axis is {lies}", "quiet")


def _field(now: Course, report: FitReport) -> Line:
    found = report.magnetic
    if found is None:
        return ()
    unit, usual = unit_sign(found.fit.unit), found.magnitude
    text = f"field {number(now.size)} {unit}, {number(usual)} when calibrated "
    if abs(now.size - usual) <= NEAR * usual:
        return (text, ""), ("✓", "good")
    return (text, ""), ("▲ iron is near it, or another place", "warn")


def _dip(now: Course, report: FitReport) -> Line:
    if report.second_stage is None:
        return ()
    usual = math.degrees(report.second_stage.alignment.dip)
    text = f"dip {now.dip:.1f}°, {usual:.1f}° when calibrated ".replace("-", "−")
    if abs(now.dip - usual) <= NEAR_DEG:
        return (text, ""), ("✓", "good")
    return (text, ""), ("▲ it is being moved, or iron is near it", "warn")
