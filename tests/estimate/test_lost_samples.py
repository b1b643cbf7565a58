"""Samples that are missing in a rotation although the times go on, as where these are counted."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.estimate.result import FitReport
from tests.diagnose.recordings import fitted


def closed(readings: Readings, first: float, past: float) -> Readings:
    """The readings without a stretch, s, as if nothing had been there."""

    def cut(series: Series | None) -> Series | None:
        if series is None:
            return None
        kept = (series.time < first) | (series.time >= past)
        count = int(kept.sum())
        return replace(series, time=series.time[:count], values=series.values[kept])

    accelerometer = cut(readings.accelerometer)
    assert accelerometer is not None
    return replace(readings, accelerometer=accelerometer, gyroscope=cut(readings.gyroscope))


def fastest(report: FitReport) -> tuple[int, float]:
    """The rotation with the fastest rate, and when that was."""
    each = [np.linalg.norm(one.rate, axis=1) for one in report.rotations]
    number = int(np.argmax([rate.max() for rate in each]))
    return number, float(report.rotations[number].time[each[number].argmax()])


def test_a_rotation_in_which_samples_are_missing_is_told() -> None:
    """The rate jumps there and nowhere else, and only that rotation does not close."""
    report, readings = fitted(poses="26", seed=3)
    number, when = fastest(report)
    lost = fit_readings(closed(readings, when, when + 0.4))
    problems = {k: one.problem for k, one in enumerate(lost.rotations) if one.problem}
    assert [*problems] == [number]
    assert "the rate jumps by " in (problems[number] or "")
    gyroscope, before = lost.sensors["gyroscope"], report.sensors["gyroscope"]
    assert gyroscope.rms_held_out == pytest.approx(before.rms_held_out, rel=0.2)
    assert any("samples are missing or repeated" in text for text in lost.warnings)


def test_all_rotations_in_which_samples_are_missing_are_told() -> None:
    """Each spoils the fit of the others, so none is found by leaving out one alone."""
    report, readings = fitted(poses="26", seed=3)
    numbers = [4, 9, 13, 18, 21]
    for number in reversed(numbers):  # what is later keeps its times
        one = report.rotations[number]
        when = 0.6 * one.time[0] + 0.4 * one.time[-1]
        readings = closed(readings, when, when + 0.15)
    lost = fit_readings(readings)
    assert [k for k, one in enumerate(lost.rotations) if one.problem] == numbers
    gyroscope, before = lost.sensors["gyroscope"], report.sensors["gyroscope"]
    assert gyroscope.rms_held_out == pytest.approx(before.rms_held_out, rel=0.2)
    assert any("in rotations 5, 10, 14, 19 and 22 the rate" in text for text in lost.warnings)


def test_rotations_in_which_samples_are_missing_twice_are_told() -> None:
    """Two jumps of about the same size, of which neither takes back the other."""
    report, readings = fitted(poses="26", seed=3)
    numbers = [4, 13, 21]
    for number in reversed(numbers):
        one = report.rotations[number]
        for share in (0.35, 0.15):
            when = one.time[0] + share * (one.time[-1] - one.time[0])
            readings = closed(readings, when, when + 0.15)
    lost = fit_readings(readings)
    assert [k for k, one in enumerate(lost.rotations) if one.problem] == numbers


def test_a_rotation_that_moved_otherwise_is_not_said_to_lack_samples() -> None:
    """A hold that was moved spoils two rotations, whose rates go on."""
    report, readings = fitted(poses="26", seed=3)
    hold = report.holds[7]
    values = readings.accelerometer.values.copy()
    inside = (readings.accelerometer.time >= hold.start - 0.5) & (
        readings.accelerometer.time <= hold.end + 0.5
    )
    turned = np.array([[1.0, -0.03, 0.0], [0.03, 1.0, 0.0], [0.0, 0.0, 1.0]])
    values[inside] = values[inside] @ turned.T
    moved = replace(readings, accelerometer=replace(readings.accelerometer, values=values))
    assert not any("the rate jumps" in (one.problem or "") for one in fit_readings(moved).rotations)
