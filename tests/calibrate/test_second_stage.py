"""The second stage: alignment by constant dip, clocks, the gyroscope by two references, heading."""

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from benchmarks.hand_motion import Device, placed, recorded
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.notices import NoticeKind
from imucal_wizard.core.quaternions import rotation_matrix, rotation_vector
from imucal_wizard.core.readings import FloatArray, Series
from imucal_wizard.estimate.recording import FitOptions, fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.estimate.second_stage.alignment import align
from imucal_wizard.estimate.second_stage.found import Added, SecondStage
from imucal_wizard.estimate.second_stage.heading import heading
from imucal_wizard.report.document import fit_document
from imucal_wizard.report.text import summary
from imucal_wizard.simulate.recording import simulate_recording
from tests.calibrate.collecting import SESSION, offline
from tests.estimate.field_truth import all_over
from tests.estimate.whole_session import HOLD, TURN, attitude


@cache
def reported(seed: int = 0, vertical: float = 0.3, clock: float = 0.035) -> FitReport:
    """The fit of a simulated session."""
    if (vertical, clock) == (SESSION.vertical, SESSION.clock):
        return offline(seed)
    return fit_readings(replace(SESSION, vertical=vertical, clock=clock).readings(seed))


def stage_of(report: FitReport) -> SecondStage:
    """Its second stage, which must be there."""
    assert report.second_stage is not None, report.warnings
    return report.second_stage


@pytest.mark.study
def test_the_rotation_between_the_sensors_is_found_with_its_certainty() -> None:
    """Three angles and the dip in four sessions: none off by more than four standard errors."""
    off = []
    for seed in range(4):
        found = stage_of(reported(seed)).alignment
        error = rotation_vector(found.rotation @ rotation_matrix(SESSION.misalignment).T)
        off += list(error / np.sqrt(np.diag(found.covariance)))
        off.append((np.degrees(found.dip) - SESSION.dip) / np.degrees(found.dip_error))
    assert np.abs(off).max() < 4.0
    assert np.sqrt(np.mean(np.square(off))) < 1.7


def test_the_aligned_magnetometer_is_in_the_accelerometers_frame() -> None:
    """``M = R P``: frame, term and angles say so, and the dip is the same in every hold."""
    report = reported(0)
    sensor = report.sensors["magnetometer"]
    assert sensor.frame == "accelerometer"
    assert sensor.model[-1] == "misalignment"
    rotation = rotation_matrix(SESSION.misalignment)
    found = sensor.matrix / np.cbrt(np.linalg.det(sensor.matrix))
    symmetric = rotation.T @ found
    assert np.abs(symmetric - symmetric.T).max() < 3e-3
    names = {p.name: p for p in sensor.parameters}
    for axis, true in zip("xyz", SESSION.misalignment, strict=True):
        angle = names[f"misalignment_{axis}"]
        assert abs(angle.value - true) < 4.0 * (angle.standard_error or 0.0)


@pytest.mark.parametrize("clock", [0.035, -0.2, 0.0])
def test_the_offset_between_the_clocks_is_estimated(clock: float) -> None:
    """Known to a fraction of a millisecond, though the field is sampled every 12.5 ms."""
    found = stage_of(reported(1, clock=clock)).clock
    assert found is not None
    assert found.standard_error < 1e-3
    assert abs(found.seconds - clock) < 4.5 * found.standard_error


def test_turns_about_the_vertical_count_with_the_field_as_reference() -> None:
    """Three fifths of the turns are invisible to gravity: both references know the gains better."""
    report = reported(2, vertical=0.6)
    added = stage_of(report).added
    assert added is not None
    assert added.turns > 1.3 * len(report.rotations)
    assert added.standard_errors is not None
    assert added.standard_errors < 0.8
    assert added.better
    fit = report.sensors["gyroscope"]
    assert fit.method == "vector + field"
    assert fit.covariance is not None
    truth = np.concatenate([SESSION.gyroscope.matrix.ravel(), SESSION.gyroscope.bias])
    found = np.concatenate([fit.matrix.ravel(), fit.bias])
    assert (np.abs(found - truth) < 4.5 * np.sqrt(np.diag(fit.covariance))).all()


@pytest.mark.parametrize(
    ("tilt", "heading", "better"),
    [
        (0.9, 0.5, True),
        (1.05, 0.9, True),
        (1.08, 1.0, False),
        (1.27, 0.5, False),
        (0.9, 1.2, False),
        (1.0, 1.0, True),
    ],
)
def test_both_references_are_kept_only_where_rotations_left_out_say_so(
    tilt: float, heading: float, better: bool
) -> None:
    """Closures by both references over those by gravity alone; neither may be worse."""
    added = Added(30, 1.3, 1.3 * tilt, 2.0, 2.0 * heading, None)
    assert added.better == better
    assert Added(30, 0.0, 0.0, 0.0, 0.0, None).better


def test_a_field_that_changed_is_no_reference_for_the_gyroscope() -> None:
    """Iron in the device moves in mid-session; gravity alone closes all rotations."""
    readings = replace(SESSION, vertical=0.0).readings(0)
    assert readings.magnetometer is not None
    field = readings.magnetometer.values.copy()
    field[len(field) // 2 :, 0] += 6.0
    magnetometer = replace(readings.magnetometer, values=field)
    report = fit_readings(replace(readings, magnetometer=magnetometer))
    stage, fit = stage_of(report), report.sensors["gyroscope"]
    assert any("fitted to gravity alone" in note for note in stage.notes)
    alone = fit_readings(replace(readings, magnetometer=None)).sensors["gyroscope"]
    assert fit.matrix == pytest.approx(alone.matrix, abs=1e-12)


def test_a_field_that_turns_about_the_vertical_is_said_of_the_magnetometer() -> None:
    """Gravity alone closes the rotation meanwhile, whose heading the gyroscope's fit leaves out."""
    report = fit_readings(replace(SESSION, field_turn=np.radians(30.0)).readings(2))
    stage, steady = stage_of(report), stage_of(offline(2))
    (change,) = stage.changes
    assert (change.before, change.after) == (19, 20)
    assert abs(np.degrees(change.angle)) == pytest.approx(30.0, abs=0.5)
    (said,) = report.warned("magnetometer", NoticeKind.FIELD_TURNED)
    assert said.startswith("the field turned about the vertical between holds 20 and 21 by")
    assert stage.added is not None
    assert steady.added is not None
    assert stage.added.turns == steady.added.turns - 1
    assert stage.added.heading_after < 1.1 * steady.added.heading_after


@pytest.mark.parametrize("method", ["offset", "static"])
def test_a_method_that_was_asked_for_is_kept_and_told_what_both_references_would_add(
    method: str,
) -> None:
    """Closures are angles, whatever the method's own error is of."""
    options = FitOptions(gyroscope_method=method)
    report = fit_readings(replace(SESSION, vertical=0.3).readings(0), options)
    stage, fit = stage_of(report), report.sensors["gyroscope"]
    assert fit.method == method
    assert stage.added is not None
    assert stage.added.tilt_after < 0.5 * stage.added.tilt_before
    assert stage.added.tilt_before > np.radians(0.1)
    assert any(f"was asked for: {method}" in note for note in stage.notes)


def test_long_turns_among_short_ones_are_weighed_by_what_they_last(tmp_path: Path) -> None:
    """A turn of ten seconds walks farther than one of a second: more data is no less certain."""
    path = tmp_path / "turned.csv"
    simulate_recording(path, seed=3, magnetometer=True)
    added = stage_of(fit_readings(read_files([path]))).added
    assert added is not None
    assert added.standard_errors is not None
    assert added.standard_errors < 1.0


def _heading_errors(seed: int) -> tuple[FloatArray, FloatArray]:
    """By how much the headings of the holds are off, and their standard errors, rad."""
    stage = stage_of(reported(seed))
    poses = SESSION.poses(np.random.default_rng(seed))
    middle = stage.headings.hold.astype(float) * (HOLD + TURN) + HOLD / 2.0
    axes = attitude(poses, middle).apply([1.0, 0.0, 0.0])
    true = np.arctan2(axes[:, 0], axes[:, 1])
    seen = np.isfinite(stage.headings.after)
    off = np.angle(np.exp(1j * (stage.headings.after - true)))[seen]
    before = np.angle(np.exp(1j * (stage.headings.before - true)))
    assert np.degrees(np.sqrt(np.nanmean(before**2))) > 20.0
    return off, stage.headings.error[seen]


@pytest.mark.study
def test_heading_errors_after_the_calibration_are_as_stated() -> None:
    """With the noise of each hold's means: in four sessions 95 % within two standard errors."""
    found = [_heading_errors(seed) for seed in range(4)]
    off, error = (np.concatenate(part) for part in zip(*found, strict=True))
    assert len(off) > 100
    assert np.degrees(np.sqrt(np.mean(off**2))) < 0.3
    assert np.mean(np.abs(off) < 2.0 * error) > 0.9
    assert np.sqrt(np.mean((off / error) ** 2)) > 0.6
    assert np.abs(off / error).max() < 4.5


def test_disturbed_samples_have_no_part_in_headings_clocks_and_turns() -> None:
    """One sample in a hundred wild: the second stage is what it is without them."""
    readings = SESSION.readings(0)
    series = readings.magnetometer
    assert series is not None
    rng = np.random.default_rng(8)
    wild = rng.random(len(series)) < 0.01
    values = series.values + wild[:, None] * rng.normal(0.0, 150.0, series.values.shape)
    spoilt = fit_readings(replace(readings, magnetometer=replace(series, values=values)))
    found, clean = stage_of(spoilt), stage_of(reported(0))
    off = np.angle(np.exp(1j * (found.headings.after - clean.headings.after)))
    assert np.degrees(np.nanmax(np.abs(off))) < 0.3
    assert found.clock is not None
    assert clean.clock is not None
    assert found.clock.standard_error < 1.2 * clean.clock.standard_error
    assert found.added is not None
    assert clean.added is not None
    assert found.added.heading_after < 1.2 * clean.added.heading_after


def test_a_sensor_that_lies_turned_on_the_board_is_aligned_too() -> None:
    """No start is assumed: axes exchanged and upside down, and 5° off."""
    rng = np.random.default_rng(3)
    up = all_over(rng, 20)
    swap = np.array([[0.0, -1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
    rotation = rotation_matrix(np.radians([3.0, -4.0, 2.0])) @ swap
    level = -np.sin(np.radians(60.0))
    across = np.cross(up, all_over(rng, 20))
    across /= np.linalg.norm(across, axis=1)[:, None]
    field = level * up + np.sqrt(1.0 - level**2) * across
    found = align(up, field @ rotation)
    assert np.abs(found.rotation - rotation).max() < 1e-6
    assert found.dip == pytest.approx(np.radians(60.0), abs=1e-9)


def test_one_position_beside_iron_is_left_out() -> None:
    """Its dip is 15° off; the others decide."""
    rng = np.random.default_rng(4)
    up = all_over(rng, 25)
    across = np.cross(up, all_over(rng, 25))
    across /= np.linalg.norm(across, axis=1)[:, None]
    dip = np.full(25, np.radians(60.0)) + 5e-4 * rng.standard_normal(25)
    dip[7] += np.radians(15.0)
    field = -np.sin(dip)[:, None] * up + np.cos(dip)[:, None] * across
    found = align(up, field)
    assert found.used.sum() == 24
    assert not found.used[7]
    assert np.abs(rotation_vector(found.rotation)).max() < 2e-3


def test_too_few_positions_are_refused() -> None:
    """Five positions cannot contradict four unknowns twice."""
    rng = np.random.default_rng(5)
    with pytest.raises(DataError, match="too few"):
        align(all_over(rng, 5), all_over(rng, 5))


def test_positions_of_one_tilt_do_not_determine_the_rotation() -> None:
    """Flat in ten headings, nothing says how the magnetometer is turned about the vertical."""
    turn = np.linspace(0.0, 6.0, 10)
    up = np.tile([0.0, 0.0, 1.0], (10, 1))
    field = np.column_stack([0.4 * np.cos(turn), 0.4 * np.sin(turn), np.full(10, -0.9165)])
    field += 1e-4 * np.random.default_rng(6).standard_normal(field.shape)
    with pytest.raises(DataError, match="do not determine the rotation"):
        align(up, field / np.linalg.norm(field, axis=1)[:, None])


def test_the_field_points_as_the_textbook_says() -> None:
    """Flat: x to the north is 0°, to the east 90°; upright there is none; tilt changes nothing."""
    down = -0.9
    up = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
    field = np.array([[0.4, 0.0, down], [0.0, 0.4, down], [down, 0.4, 0.0]])
    found = np.degrees(heading(up, field))
    assert found[:2] == pytest.approx([0.0, 90.0], abs=1e-9)
    assert np.isnan(found[2])
    tilt = rotation_matrix(np.array([0.5, 0.0, 0.0]))
    assert heading(up[:2] @ tilt.T, field[:2] @ tilt.T) == pytest.approx(np.radians([0.0, 90.0]))


def test_the_second_stage_stands_in_text_and_json() -> None:
    """Dip, clock, closure gained and headings; 80 columns; plain JSON."""
    report = reported(0)
    text = summary(report)
    for word in ("SECOND STAGE", "dip 6", "clock is +", "about the vertical", "heading"):
        assert word in text
    assert max(map(len, text.splitlines())) <= 80
    found = fit_document(report)["second_stage"]
    json.dumps(found)
    assert found["clock_offset"]["seconds"] == pytest.approx(0.035, abs=2e-3)
    assert len(found["headings"]) == found["positions"]


def test_a_mirrored_axis_shows_as_the_other_half_of_the_earth() -> None:
    """Gravity and turns cannot tell m from −m; the text says what the user can check."""
    readings = SESSION.readings(0)
    assert readings.magnetometer is not None
    seen = "positive dip: if you are south of the magnetic equator, an axis is mirrored"
    assert seen in summary(reported(0))
    mirrored = replace(readings.magnetometer, values=readings.magnetometer.values * [1, 1, -1])
    report = fit_readings(replace(readings, magnetometer=mirrored))
    assert np.degrees(stage_of(report).alignment.dip) == pytest.approx(-SESSION.dip, abs=0.2)
    assert "and the axes are these instead: z points the other way" in summary(report)
    assert "negative dip: if you are north of the magnetic equator" in summary(report)
    assert max(map(len, summary(report).splitlines())) <= 80


def test_without_a_gyroscope_the_alignment_still_stands() -> None:
    """Accelerometer and magnetometer alone."""
    readings = replace(SESSION.readings(0), gyroscope=None)
    stage = stage_of(fit_readings(readings))
    assert stage.added is None
    assert stage.clock is None
    assert np.degrees(stage.alignment.dip) == pytest.approx(SESSION.dip, abs=0.1)


def test_a_magnetometer_that_was_not_recorded_at_rest_stays_in_its_own_frame() -> None:
    """Samples of the turns alone say nothing of the dip; the report says so and stays whole."""
    readings = SESSION.readings(0)
    series = readings.magnetometer
    assert series is not None
    turning = (series.time - SESSION.clock) % 4.6 > 2.9
    part = Series(series.time[turning], series.values[turning], series.unit)
    report = fit_readings(replace(readings, magnetometer=part))
    assert report.second_stage is None
    assert report.sensors["magnetometer"].frame == "own"
    assert any("own frame" in text for text in report.warnings)
    assert any("clocks of the two sensors are seconds apart" in text for text in report.warnings)


def test_a_slow_magnetometer_printed_in_every_line_is_aligned_as_well() -> None:
    """80 readings a second in the lines of 400: five times each, and none at rest looks moved."""
    readings = SESSION.readings(0)
    series = readings.magnetometer
    assert series is not None
    lines = np.arange(series.time[0] + 0.02, series.time[-1], 1.0 / 400.0)
    row = np.searchsorted(series.time, lines, side="right") - 1
    report = fit_readings(
        replace(readings, magnetometer=Series(lines, series.values[row], series.unit))
    )
    found, clean = stage_of(report), stage_of(reported(0))
    assert found.alignment.used.sum() == clean.alignment.used.sum()
    away = rotation_vector(found.alignment.rotation @ clean.alignment.rotation.T)
    assert (np.abs(away) < np.sqrt(np.diag(clean.alignment.covariance))).all()
    assert report.rates["magnetometer"] == pytest.approx(80.0, rel=0.02)
    assert any("repeated 5 times" in text for text in report.warnings)


def test_the_magnetometer_shows_that_the_accelerometers_axes_are_exchanged() -> None:
    """Gyroscope and magnetometer agree, and two of the accelerometer's columns are exchanged."""
    readings = SESSION.readings(0)
    series = readings.accelerometer
    exchanged = replace(series, values=series.values[:, [1, 0, 2]])
    report = fit_readings(replace(readings, accelerometer=exchanged))
    (said,) = (text for text in report.warnings if "do not match" in text)
    assert said.startswith("the accelerometer's axes do not match those of the gyroscope and the")
    assert "take its x, y, z from +y, +x, +z" in said


@pytest.mark.parametrize("degrees", [0.0, 3.0, 30.0, -90.0])
def test_a_field_that_turns_while_the_device_rests_is_told_of_that_hold(degrees: float) -> None:
    """No rotation shows it: the field of such a hold is none."""
    rng = np.random.default_rng(25_971)
    device = Device()
    motion = placed(device, rng, turns=2)
    edges = np.flatnonzero(np.diff(np.concatenate([[0.0], motion.resting, [0.0]])))
    begin, past = edges.reshape(-1, 2)[8]
    turning = np.clip((np.arange(len(motion.time)) - (begin + past) / 2) / 20 + 0.5, 0.0, 1.0)
    level = 20.0 * np.exp(1j * np.radians(degrees) * turning)
    world = np.column_stack([level.real, level.imag, np.full(len(level), -43.0)])
    field = motion.attitude.inv().apply(world) + 0.04 * rng.standard_normal(world.shape)
    series = Series(motion.time, field + np.array([3.0, -8.0, 5.0]), "uT")
    report = fit_readings(replace(recorded(motion, device, rng), magnetometer=series))
    told = report.warned("magnetometer", NoticeKind.FIELD_TURNED)
    if not degrees:
        assert not told
    else:
        (said,) = re.findall(r"during hold 9 by (\S+)°", " ".join(told))
        assert float(said) == pytest.approx(abs(degrees), abs=0.3)
