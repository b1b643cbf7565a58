"""The formulas of the second stage one by one: closures, clocks, dip and heading."""

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.quaternions import rotation_vector
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.second_stage import clock_offset as clock
from imucal_wizard.estimate.second_stage.alignment import align, leaning
from imucal_wizard.estimate.second_stage.clock_offset import Passage, clock_offset
from imucal_wizard.estimate.second_stage.heading import heading, heading_error, turned
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.rows.field_closure import FieldClosure
from imucal_wizard.model.rows.source import BIAS, MATRIX, Parameters
from imucal_wizard.model.terms import Term, Terms
from tests.estimate.closures import NO_EFFECTS, closures, headings
from tests.estimate.closures import turned as turned_at
from tests.estimate.field_truth import all_over

RATE = 100.0


def _references(count: int, rng: np.random.Generator) -> tuple[FieldClosure, Attitude]:
    """Turns at constant rates from any attitude, and the attitude (body to first body) at the end.

    Up and field are where the true turn brings them.
    """
    time = np.arange(0.0, 1.2, 1.0 / RATE)
    rates = rng.uniform(0.8, 2.0, (count, 1)) * all_over(rng, count)
    ends = Attitude.from_rotvec(rates * time[-1])
    up, field = all_over(rng, count), all_over(rng, count)
    samples = [time] * count, [np.tile(rate, (len(time), 1)) for rate in rates]
    by_gravity = closures(*samples, up, ends.inv().apply(up))
    return headings(by_gravity, closures(*samples, field, ends.inv().apply(field))), ends


def _wrong(rng: np.random.Generator, size: float) -> tuple[FloatArray, FloatArray]:
    """A calibration that is off by so much."""
    return np.eye(3) + size * rng.standard_normal((3, 3)), size * rng.standard_normal(3)


def test_tilt_and_heading_together_are_the_whole_error_of_attitude() -> None:
    """Against SciPy's attitude with the wrong rates, to second order in the error."""
    rng = np.random.default_rng(0)
    data, ends = _references(30, rng)
    for size in (1e-3, 1e-4):
        matrix, bias = _wrong(rng, size)
        at, up = turned_at(data, matrix, bias), data.by_gravity.after
        whole = at.by_gravity.closure + at.residual[:, None] * up
        seconds = data.by_gravity.samples.dt.reshape(30, -1).sum(axis=1)
        true = ends.as_rotvec() / seconds[:, None]
        wrong = Attitude.from_rotvec(((true - bias) @ matrix.T) * seconds[:, None])
        # carried vectors and measured ones differ by the rotation from the first to the second
        error = (ends.inv() * wrong).as_rotvec()
        # up and field nearly in line tell the heading worse
        sine = np.linalg.norm(np.cross(up, data.by_field.after), axis=1)
        assert (np.abs(whole - error).max(axis=1) < 60.0 * size**2 / sine**2).all()


def test_the_slopes_of_the_heading_are_the_numeric_ones() -> None:
    """Central differences by each of the twelve parameters, to the coning that is left out."""
    rng = np.random.default_rng(1)
    data, _ = _references(8, rng)
    matrix, bias = _wrong(rng, 1e-2)
    columns = turned_at(data, matrix, bias).base_columns()
    for index in range(12):
        step = 1e-6 * np.eye(12)[index]
        ahead, behind = (
            turned_at(data, matrix + s * step[MATRIX].reshape(3, 3), bias + s * step[BIAS])
            for s in (1.0, -1.0)
        )
        slope = (ahead.residual - behind.residual) / 2e-6
        assert columns[:, index] == pytest.approx(slope, abs=0.02 * np.abs(columns).max())


def test_the_force_on_the_gyroscope_is_gravity_where_the_field_closes_the_rotation() -> None:
    """It was taken along the field, so that headings spoke against the true sensitivity to g."""
    rng = np.random.default_rng(2)
    data, _ = _references(8, rng)
    samples, up = data.by_gravity.samples, data.by_gravity.before[data.by_gravity.samples.rotation]
    sensitivity = np.radians(0.2) * rng.standard_normal((3, 3))  # rad/s per g
    attitudes = Attitude.from_rotvec(samples.reading * samples.time[:, None])
    felt = attitudes.inv().apply(up) @ sensitivity.T
    samples = replace(samples, reading=samples.reading + felt)
    known = replace(
        data,
        by_gravity=replace(data.by_gravity, samples=samples),
        by_field=replace(data.by_field, samples=samples),
    )
    terms = Terms("gyroscope", [Term(effect("g-sensitivity"), None)])
    at = Parameters(np.eye(3), np.zeros(3), np.degrees(sensitivity).ravel())
    rows = known.at(at, terms, known.at(Parameters(np.eye(3), np.zeros(3)), NO_EFFECTS))
    rows = known.at(at, terms, rows)
    assert np.abs(turned_at(known, np.eye(3), np.zeros(3)).residual).max() > 2e-3
    assert np.abs(rows.residual).max() < 1e-5


def _turned_between(up: FloatArray, field: FloatArray) -> Callable[..., FieldClosure]:
    """Steady rotations between these directions, to be closed by any directions of up and field."""
    time, turns = np.arange(0.0, 1.2, 1.0 / RATE), []
    for one, two in itertools.pairwise(zip(up, field, strict=True)):
        turn = Attitude.align_vectors(np.array(one), np.array(two), weights=[1.0, 1.0])[0]
        turns.append(np.tile(turn.as_rotvec() / time[-1], (len(time), 1)))

    def data(up: FloatArray, field: FloatArray) -> FieldClosure:
        by_gravity = closures([time] * len(turns), turns, up[:-1], up[1:])
        by_field = closures([time] * len(turns), turns, field[:-1], field[1:])
        return headings(by_gravity, by_field)

    return data


SMALL = 1e-5
"""An error of a direction, rad, to which headings follow on a straight line."""


def test_an_error_of_the_accelerometer_moves_headings_as_aligning_anew_does() -> None:
    """Up is wrong by one skewed axis; the magnetometer is aligned to up as it was and as it is."""
    up, field = _fields(np.random.default_rng(5), 10, np.radians(60.0))
    data = _turned_between(up, field)
    skewed = up[:, 1:2] * np.array([1.0, 0.0, 0.0])
    doubt = skewed - up * (up * skewed).sum(axis=1)[:, None]
    ahead, behind = (
        turned_at(data(moved, field @ align(moved, field).rotation.T), np.eye(3), np.zeros(3))
        for moved in (unit_vectors(up + sign * SMALL * doubt) for sign in (1.0, -1.0))
    )
    doubted = replace(data(up, field), leaning=leaning(up, field)).doubting(doubt[:, :, None], 1, 0)
    column = turned_at(doubted, np.eye(3), np.zeros(3)).shared_columns()[:, 0]
    slope = (ahead.residual - behind.residual) / (2.0 * SMALL)
    assert column == pytest.approx(slope, abs=1e-3 * np.abs(slope).max())
    assert doubted.undetermined == doubted.shared == ("accelerometer_0",)


def test_an_error_of_the_magnetometer_moves_headings_as_other_directions_of_the_field_do() -> None:
    """Its soft iron is wrong by one entry, in all rotations alike; up is wrong in another way."""
    up, field = _fields(np.random.default_rng(6), 10, np.radians(60.0))
    data = _turned_between(up, field)
    bent = field[:, :1] * np.array([0.0, 1.0, 0.0])
    moved = bent - field * (field * bent).sum(axis=1)[:, None]
    ahead, behind = (
        turned_at(data(up, unit_vectors(field + sign * SMALL * moved)), np.eye(3), np.zeros(3))
        for sign in (1.0, -1.0)
    )
    known = replace(data(up, field), field_doubt=moved[:, :, None])
    doubted = known.doubting(np.roll(moved, 1, axis=1)[:, :, None], 0, 0)
    columns = turned_at(doubted, np.eye(3), np.zeros(3)).shared_columns()
    slope = (ahead.residual - behind.residual) / (2.0 * SMALL)
    assert columns[:, 1] == pytest.approx(slope, abs=1e-3 * np.abs(slope).max())
    assert doubted.shared == ("accelerometer_0", "magnetometer_0")
    assert doubted.shared_precision == (1.0, 1.0)
    assert doubted.undetermined == ()


def _passage(rng: np.random.Generator, offset: float, noise: float) -> Passage:
    """A turn about one axis, faster and slower; the field's clock is ``offset`` ahead.

    At a constant rate a later clock would look like another field.
    """
    time = np.arange(0.0, 2.0, 1.0 / RATE)
    axis = rng.uniform(1.0, 2.0) * all_over(rng, 1)[0]

    def attitude(t: FloatArray) -> Attitude:
        return Attitude.from_rotvec(np.outer(1.0 - np.cos(0.5 * np.pi * t), axis))

    at = np.arange(0.2, 1.8, 0.0137)
    seen = attitude(at).inv().apply(all_over(rng, 1)[0])
    return Passage(
        time,
        attitude(time).as_matrix(),
        np.outer(0.5 * np.pi * np.sin(0.5 * np.pi * time), axis),
        at + offset,
        seen + noise * rng.standard_normal(seen.shape),
    )


def test_the_slope_of_the_clocks_cost_is_the_numeric_one() -> None:
    """Half of it, and near the bottom half the curvature too."""
    rng = np.random.default_rng(2)
    turns = clock.Turns([_passage(rng, 0.1, 1e-4)])
    step = 1e-4
    for offset in (0.08, 0.1, 0.13):
        (ahead, _, _), (here, slope, square), (behind, _, _) = (
            turns.terms(offset + k * step)[0] for k in (1.0, 0.0, -1.0)
        )
        assert slope == pytest.approx((ahead - behind) / (4.0 * step), rel=1e-3, abs=1e-4)
        if offset == 0.1:  # elsewhere what is left bends it as well
            bend = (ahead - 2.0 * here + behind) / (2.0 * step**2)
            assert square == pytest.approx(bend, rel=0.05)


@pytest.mark.study
def test_the_error_of_the_clock_offset_is_as_stated() -> None:
    """In twenty sets of twenty turns 2.1 standard errors (t, 19 degrees) hold the truth 19 times.

    Three binomial standard deviations less are allowed; of half of them the error is below 0.7.
    """
    rng = np.random.default_rng(3)
    off = []
    for _ in range(20):
        found = clock_offset([_passage(rng, -0.07, 0.02) for _ in range(20)])
        assert found is not None
        off.append((found.seconds + 0.07) / found.standard_error)
    away = np.abs(off)
    assert (away < 2.1).sum() >= 16
    assert 0.3 < np.median(away) < 1.1


def _fields(rng: np.random.Generator, count: int, dip: float) -> tuple[FloatArray, FloatArray]:
    """Up and unit field in any attitudes."""
    attitudes = Attitude.random(count, random_state=int(rng.integers(2**31)))
    world = np.array([0.0, np.cos(dip), -np.sin(dip)])
    return attitudes.inv().apply([0.0, 0.0, 1.0]), attitudes.inv().apply(world)


@pytest.mark.study
def test_the_errors_of_the_alignment_are_as_stated() -> None:
    """Angles and dip of fifteen positions scatter by their standard errors.

    Fifty sets know each rms to 10 %; three and a half times that are allowed.
    """
    rng, dip = np.random.default_rng(4), np.radians(60.0)
    off = []
    for _ in range(50):
        up, field = _fields(rng, 15, dip)
        noisy = field + 2e-3 * rng.standard_normal(field.shape)
        found = align(up, noisy / np.linalg.norm(noisy, axis=1)[:, None])
        angles = rotation_vector(found.rotation) / np.sqrt(np.diag(found.covariance))
        off.append([*angles, (found.dip - dip) / found.dip_error])
    rms = np.sqrt(np.mean(np.square(off), axis=0))
    # eleven degrees of freedom, and now and then the worst position left out
    assert rms == pytest.approx(np.full(4, np.sqrt(11.0 / 9.0)), rel=0.35)


def test_an_uncertain_field_makes_the_angles_uncertain() -> None:
    """Against an alignment of the fields moved by it."""
    rng, dip = np.random.default_rng(5), np.radians(60.0)
    up, field = _fields(rng, 15, dip)
    # as a wrong soft iron bends the field
    doubt = np.einsum("ni,ijk->njk", field, 1e-4 * rng.standard_normal((3, 3, 2)))
    plain, whole = align(up, field), align(up, field, doubt)
    expected, dips = np.zeros((3, 3)), 0.0
    for k in range(2):
        moved = align(up, field + doubt[:, :, k])
        assert moved.used.all()
        change = rotation_vector(moved.rotation @ plain.rotation.T)
        expected += np.outer(change, change)
        dips += (moved.dip - plain.dip) ** 2
    assert whole.covariance == pytest.approx(expected, rel=0.02, abs=1e-11)
    assert whole.dip_error == pytest.approx(np.sqrt(dips), rel=0.01)


def test_the_headings_error_is_how_headings_scatter() -> None:
    """Of ten thousand calibrations drawn from the covariance."""
    rng = np.random.default_rng(6)
    up, field = _fields(rng, 6, np.radians(50.0))
    root = 2e-3 * rng.standard_normal((3, 3))

    def headings(theta: FloatArray) -> FloatArray:
        return heading(up, field - theta)

    drawn = np.array([headings(root @ rng.standard_normal(3)) for _ in range(10_000)])
    spread = turned(drawn, headings(np.zeros(3))).std(axis=0)
    found = heading_error(headings, np.zeros(3), root @ root.T)
    seen = np.isfinite(found)
    assert seen.sum() >= 3
    assert found[seen] == pytest.approx(spread[seen], rel=0.04)
