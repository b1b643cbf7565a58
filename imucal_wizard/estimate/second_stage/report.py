"""The second stage on a recording: magnetometer aligned, clocks compared, turns closed twice."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.notices import Notice, NoticeKind, of_kind
from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.estimate.fit_warnings import exchanged_axes
from imucal_wizard.estimate.gravity_and_field import (
    Segment,
    field_at,
    inner_span,
    undisturbed,
    up_of,
    with_gyroscope,
    within_noise,
)
from imucal_wizard.estimate.magnetometer.experiment import StillPoses
from imucal_wizard.estimate.magnetometer.fit import MagnetometerFit
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.estimate.second_stage.alignment import align
from imucal_wizard.estimate.second_stage.error_modes import (
    ErrorModes,
    of_accelerometer,
    of_magnetometer,
)
from imucal_wizard.estimate.second_stage.field_changes import changes_text
from imucal_wizard.estimate.second_stage.found import Headings, SecondStage
from imucal_wizard.estimate.second_stage.heading import Compass

SMALLEST_LEVEL = 1e-3
"""Level part of the field, as a share of it, which a heading divides by."""


def with_second_stage(
    report: FitReport, series: Series | None, turns: Sequence[Segment]
) -> FitReport:
    """The report with the magnetometer in the accelerometer's frame and what follows from it.

    If the still positions do not determine the alignment, the report only gains a note.

    Args:
        report: of each sensor by itself.
        series: all the magnetometer's readings, those at rest among them.
        turns: the gyroscope between the holds of the report; none without one.
    """
    found = report.magnetic
    if found is None or series is None or "accelerometer" not in report.sensors:
        return report
    try:
        return _second_stage(report, series, turns, found)
    except DataError as error:
        text = f"the magnetometer stays in its own frame: {error}"
        note = Notice(text, NoticeKind.NOT_ALIGNED, "magnetometer")
        return replace(report, warnings=(*report.warnings, note))


def _second_stage(
    report: FitReport, series: Series, turns: Sequence[Segment], found: MagnetometerFit
) -> FitReport:
    calm = undisturbed(series, found)
    places, readings, counts = field_at(report.holds, calm, found)
    field = (readings - found.fit.bias) @ found.fit.matrix.T
    up = up_of(report.sensors["accelerometer"], [report.holds[i] for i in places])
    modes = _error_modes(report, found)
    doubt = modes.of_up(up)
    alignment = align(up, unit_vectors(field), modes.of_field(found.fit, field), doubt)
    reference = report.sensors["accelerometer"].reference
    poses, used = None, alignment.used
    if reference is not None:
        which = np.array(places)[used]
        span = np.array([inner_span(report.holds[i]) for i in which]).reshape(-1, 2)
        poses = StillPoses(which, span, readings[used], counts[used], reference, doubt[used])
    aligned = found.aligned(alignment, poses)
    compass = Compass(report.sensors["accelerometer"], found.fit, alignment, modes)
    stage = SecondStage(alignment, modes, _headings(report, compass, places, readings))
    sensors = {**report.sensors, "magnetometer": aligned}
    if "gyroscope" in report.sensors:
        stage, better = with_gyroscope(report, stage, turns, calm, found, aligned)
        sensors["gyroscope"] = better
    warnings = _with_third_sensor(report, alignment.rotation)
    if stage.changes:
        text = changes_text(stage.changes, within_noise(aligned))
        warnings = (*warnings, Notice(text, NoticeKind.FIELD_TURNED, "magnetometer"))
    return replace(report, sensors=sensors, second_stage=stage, warnings=warnings)


def _with_third_sensor(report: FitReport, field_axes: FloatArray) -> tuple[str, ...]:
    """The warnings, in which the magnetometer decides whose axes are exchanged."""
    notes = of_kind(report.warnings, NoticeKind.AXES)
    if not notes:
        return report.warnings
    decided = exchanged_axes(report.sensors["gyroscope"].matrix, field_axes)
    said: dict[str, str] = dict(zip(notes, decided, strict=True))
    return tuple(said.get(text, text) for text in report.warnings)


def _error_modes(report: FitReport, found: MagnetometerFit) -> ErrorModes:
    fit = report.sensors["accelerometer"]
    every = up_of(fit, list(report.holds))
    return ErrorModes(of_magnetometer(found.fit), of_accelerometer(fit, every, report.gravity))


def _headings(
    report: FitReport, compass: Compass, places: list[int], readings: FloatArray
) -> Headings:
    """In each of these holds, by the magnetometer's mean readings there, shape (n, 3).

    What the dip scatters by between them the field does across it, too: noise and rounding of the
    means, iron near some place.
    """
    force = np.array([report.holds[i].accelerometer for i in places])
    found = compass.bearings(force, readings)
    alignment = compass.alignment
    here = alignment.scatter / max(float(np.cos(alignment.dip)), SMALLEST_LEVEL)
    return Headings(found.before, found.after, np.hypot(found.error, here), np.array(places))
