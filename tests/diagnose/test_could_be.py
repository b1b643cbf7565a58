"""The error that the poses do not show, against the true one."""

import numpy as np
import pytest

from benchmarks.could_be import errors_elsewhere, one_magnetometer, one_unit
from benchmarks.gyroscope_bound import DEVICES, RATE, Session, fitted
from benchmarks.hidden.designs import PLANS
from benchmarks.hidden.fitted import measured_of
from benchmarks.hidden.noise import COLOURS
from benchmarks.hidden.recording import record
from benchmarks.hidden_field.recording import CONSUMER
from benchmarks.hidden_field.sessions import STANDARD
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.could_be import DIRECTIONS
from imucal_wizard.estimate.accelerometer import accelerometer_experiment
from imucal_wizard.estimate.fit import fit
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.effect import ACCELEROMETER
from imucal_wizard.model.rows.gravity_magnitude import GravityMagnitude
from imucal_wizard.model.rows.source import Parameters
from imucal_wizard.model.terms import Terms
from tests.estimate.truth import turn


def test_fewer_poses_leave_more_open() -> None:
    """Of one sensor with nothing hidden, 38 holds leave less open than 18."""
    said = []
    for design in ("18", "26+12"):
        units = [_said(design, seed) for seed in range(3)]
        said.append(np.median(units))
    assert said[1] < said[0]


def _said(design: str, seed: int) -> float:
    rng = np.random.default_rng(seed)
    bench = Bench(ACCELEROMETER, measured_of(record(PLANS[design], COLOURS["white"], (), rng)))
    return bench.look().could_be or np.inf


def test_the_hidden_effect_that_would_make_most_is_named() -> None:
    """Faces and edges show no product of all three forces; corners do.

    ``x y z`` is zero on all of them and on average, so that no parameter absorbs any of it.
    """
    rng = np.random.default_rng(4)
    faces_and_edges, with_corners = (
        Bench(ACCELEROMETER, measured_of(record(PLANS[one], COLOURS["white"], (), rng))).look()
        for one in ("18", "26+12")
    )
    hidden = faces_and_edges.most_hidden
    assert hidden is not None
    assert hidden.name in {f"cross-product {one}" for one in ("xyz", "yxz", "zxy")}
    typical = effect("cross-product").typical(ACCELEROMETER).max() * 1e-3 * STANDARD_GRAVITY
    assert hidden.error == pytest.approx(
        typical * np.quantile(np.abs(DIRECTIONS.prod(axis=1)), 0.95), rel=0.1
    )
    other = with_corners.most_hidden
    assert other is None or "cross-product" not in other.name


def test_angles_that_the_poses_do_not_determine_may_be_wrong() -> None:
    """Faces, and edges between x and y: the angles to z are left at zero, and are not zero."""
    rng = np.random.default_rng(2)
    recorded = record(PLANS["18"], COLOURS["white"], (), rng)
    every = measured_of(recorded)
    near = np.sort(np.abs(every.up), axis=1)[:, 2] > 0.95
    chosen = near | (np.abs(every.up[:, 2]) < 0.3)
    holds = [hold for hold, one in zip(every.holds, chosen, strict=True) if one]
    few = accelerometer_experiment(holds, every.gravity, every.unit, every.readings)
    assert few.identified.dropped
    bench = Bench(ACCELEROMETER, few)
    true = root_mean_square(errors_elsewhere(recorded, bench, rng))
    assert true < (bench.look().could_be or 0.0) < 5.0 * true


@pytest.mark.parametrize("seed", [1, 2])
def test_gains_that_the_rotations_do_not_determine_may_be_wrong(seed: int) -> None:
    """Those of z are left at their nominal values where nothing turns about z."""
    session, rng = Session(DEVICES[0], seed), np.random.default_rng(seed)
    angles, ups = rng.uniform(0.6, 2.0, 40) * rng.choice((-1.0, 1.0), 40), [session.up[0]]
    session.motions = []
    for number, angle in enumerate(angles):
        session.motions.append(turn(ups[-1], angle * np.eye(3)[number % 2], rate=RATE))
        ups.append(session.motions[-1].up[-1])
    session.up, session.levels = np.array(ups), np.ones(len(ups))
    found = fitted(*session.recorded(rng))
    assert found.experiment is not None
    bench = Bench("gyroscope", found.experiment)
    assert "sensitivity_z" in bench.undetermined
    wrong = bench.fit.matrix - session.gyroscope.matrix
    # one column of gains, for turns of about a radian and two
    true = float(np.linalg.norm(wrong))
    assert true < (bench.look().could_be or 0.0) < 0.2


@pytest.mark.study
def test_it_covers_the_error_of_magnetometers() -> None:
    """The same of the field's magnitude, with slow noise that many rows share."""
    rng = np.random.default_rng(78)
    units = [one_magnetometer(STANDARD, CONSUMER, rng) for _ in range(6)]
    inside = np.mean([np.mean(np.abs(one.errors) <= one.could_be) for one in units])
    true = np.array([np.sqrt(np.mean(one.errors**2)) for one in units])
    assert 0.85 < inside < 0.99
    assert np.median([one.could_be for one in units] / true) < 3.0


@pytest.mark.study
@pytest.mark.parametrize(("design", "colour"), [("26+12", "consumer"), ("26+12", "walk")])
def test_it_covers_the_error_of_accelerometers(design: str, colour: str) -> None:
    """93 to 97 % of directions, of a bias that walks far at least that, and 2.5 standard errors."""
    rng = np.random.default_rng(77)
    units = [one_unit(design, colour, rng) for _ in range(8)]
    inside = np.array([np.mean(np.abs(one.errors) <= one.could_be) for one in units])
    true = np.array([np.sqrt(np.mean(one.errors**2)) for one in units])
    said = np.array([one.could_be for one in units])
    spread = 2.5 * inside.std() / np.sqrt(len(units))
    assert inside.mean() > 0.93 - spread
    assert inside.mean() < 0.97 + spread or colour == "walk"
    assert np.median(said / true) < 3.0 + 0.5 * (colour == "walk")


@pytest.mark.parametrize("design", ["18", "26+12"])
def test_each_hold_is_met_in_all_directions(design: str) -> None:
    """The time of a new hold tells neither its direction nor the square of a component."""
    rng = np.random.default_rng(3)
    found = fit(measured_of(record(PLANS[design], COLOURS["white"], (), rng)))
    assert found.rows is not None
    calibration, terms = Parameters(found.matrix, found.bias), Terms(ACCELEROMETER, ())
    new = found.rows.sources[0].elsewhere(DIRECTIONS, calibration, terms)
    assert isinstance(new, GravityMagnitude)
    known = new.circumstances
    up = known.force / STANDARD_GRAVITY
    for shape in (*up.T, *up.T**2):
        assert abs(np.corrcoef(known.time, shape)[0, 1]) < 0.05
