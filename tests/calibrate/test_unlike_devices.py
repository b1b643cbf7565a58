"""Devices unlike the virtual default: axes, counts, gravity, rates, speeds, few poses, gaps."""

import re
from dataclasses import dataclass, replace

import numpy as np
import pytest

from imucal_wizard.core.poses import START_POSES
from imucal_wizard.core.readings import BoolArray, FloatArray, Readings, Series
from imucal_wizard.core.units import COUNT, STANDARD_GRAVITY
from imucal_wizard.estimate.gauge import triangular
from imucal_wizard.estimate.recording import FitOptions, fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Rotate
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.scripts import EDGE_NAMES, FACE_NAMES, next_angle
from imucal_wizard.simulate.sensor import SensorModel
from tests.calibrate.sessions import recorded, session, true

DEGREE = np.pi / 180.0


def _axes(*signed: int) -> FloatArray:
    """Which axis, counted from 1, each column shows, and with which sign."""
    return np.array([np.sign(one) * np.eye(3)[abs(one) - 1] for one in signed])


@dataclass(frozen=True, eq=False)
class Wiring:
    """Readings ``gain · P y + offset`` instead of ``y``."""

    axes: FloatArray
    gain: float = 1.0
    offset: float = 0.0

    def of(self, series: Series) -> Series:
        """The series as this device puts it out."""
        unit = series.unit if self.gain == 1.0 else COUNT
        return Series(series.time, self.gain * series.values @ self.axes.T + self.offset, unit)


PLAIN = Wiring(np.eye(3))


@pytest.mark.parametrize(
    ("force", "rate"),
    [
        (PLAIN, Wiring(_axes(1, 2, -3))),
        (PLAIN, Wiring(_axes(2, -3, 1))),
        (Wiring(_axes(1, 2, -3)), PLAIN),
        (Wiring(_axes(-2, 1, 3)), Wiring(_axes(3, 2, 1), 16.4 / DEGREE)),
        (Wiring(np.eye(3), 77.7, 512.0), Wiring(np.eye(3), 3.3 / DEGREE, -1500.0)),
    ],
)
def test_wiring_and_counts_change_nothing_but_the_form(force: Wiring, rate: Wiring) -> None:
    """Permuted, inverted and left-handed axes, odd gains and offsets: the truth, so written."""
    readings = session()
    assert readings.gyroscope is not None
    changed = replace(
        readings,
        accelerometer=force.of(readings.accelerometer),
        gyroscope=rate.of(readings.gyroscope),
    )
    report = fit_readings(changed)
    truth = true()
    whole = truth.accelerometer_matrix @ force.axes.T / force.gain
    turned, expected = triangular(whole)
    if expected[2, 2] < 0.0:  # a magnitude does not show that the axes are left-handed
        expected[2], turned[:, 2] = -expected[2], -turned[:, 2]
    fit = report.sensors["accelerometer"]
    assert fit.matrix @ np.linalg.inv(expected) == pytest.approx(np.eye(3), abs=5e-4)
    bias = force.gain * force.axes @ truth.accelerometer_bias + force.offset
    assert fit.bias == pytest.approx(bias, abs=2e-3 * force.gain)
    # a rate is a pseudo-vector: seen in a mirror it turns the other way round
    frame = np.linalg.det(turned) * turned.T
    gyroscope = frame @ truth.gyroscope_matrix @ rate.axes.T / rate.gain
    found = report.sensors["gyroscope"].matrix
    assert found @ np.linalg.inv(gyroscope) == pytest.approx(np.eye(3), abs=2e-3)


def _recording(
    *, rate: float = 100.0, directions: int = 18, turns: int = 3, fastest: float | None = None
) -> Readings:
    """A sensor without bias instability, whose noise is white and nothing else."""
    hand = VirtualHand(rate, 0)
    actions: list[Action] = [LieStill(10.0)]
    for name in (FACE_NAMES + EDGE_NAMES)[:directions]:
        actions += [PlacePose(name), LieStill(3.5)]
    for axis, pose in START_POSES.items():
        actions += [PlacePose(pose), LieStill(3.5)]
        tilt = 0.0
        for index in range(turns):
            angle = next_angle(index, tilt)
            tilt += angle
            actions += [Rotate(axis, angle, fastest), LieStill(3.5)]
    hand.perform(actions)
    drawn = SensorModel.drawn(0)
    model = replace(
        drawn,
        accelerometer=replace(drawn.accelerometer, floor=0.0, step=0.0),
        gyroscope=replace(drawn.gyroscope, floor=0.0, step=0.0),
    )
    return recorded(hand, model, rate)


def _assert_right(report: FitReport) -> None:
    """Matrices right to a thousandth or two, biases within four standard errors."""
    truth = true()
    for name, matrix, bias, most in (
        ("accelerometer", truth.accelerometer_matrix, truth.accelerometer_bias, 1e-3),
        ("gyroscope", truth.gyroscope_matrix, truth.gyroscope_bias, 2e-3),
    ):
        fit = report.sensors[name]
        assert all(one.carried for one in fit.parameters)
        assert fit.matrix @ np.linalg.inv(matrix) == pytest.approx(np.eye(3), abs=most)
        assert fit.covariance is not None
        errors = np.sqrt(np.diag(fit.covariance))
        known = errors[:3] if name == "accelerometer" else errors[9:]
        assert (np.abs(fit.bias - bias) < 4.0 * known).all()


@pytest.mark.parametrize(
    ("rate", "directions", "turns", "fastest"),
    [
        (25.0, 18, 3, 500.0),
        (100.0, 18, 3, 15.0),
        (1000.0, 18, 2, None),
        (100.0, 12, 2, None),
        (100.0, 9, 3, 500.0),
    ],
)
def test_rates_speeds_and_few_directions(
    rate: float, directions: int, turns: int, fastest: float | None
) -> None:
    """25 Hz to 1 kHz, 15 to 500 °/s; the rotations' starts make nine directions enough."""
    _assert_right(
        fit_readings(_recording(rate=rate, directions=directions, turns=turns, fastest=fastest))
    )


def test_gravity_is_what_the_user_says() -> None:
    """At 9.78 m/s² the forces are smaller, and so is what they are held against."""
    readings, truth = _recording(), true()
    series = readings.accelerometer
    smaller = (series.values - truth.accelerometer_bias) * 9.78 / STANDARD_GRAVITY
    changed = replace(series, values=smaller + truth.accelerometer_bias)
    _assert_right(fit_readings(replace(readings, accelerometer=changed), FitOptions(gravity=9.78)))


def _stamped(readings: Readings, time: FloatArray, keep: BoolArray) -> Readings:
    force, rate = readings.accelerometer, readings.gyroscope
    assert rate is not None
    return Readings(
        replace(force, time=time[keep], values=force.values[keep]),
        replace(rate, time=time[keep], values=rate.values[keep]),
    )


def test_stamps_that_jitter_by_four_tenths_of_an_interval() -> None:
    """The angle is the sum over many steps, so that it hardly notices."""
    readings = _recording()
    time = readings.accelerometer.time
    jitter = np.random.default_rng(0).uniform(-0.4, 0.4, len(time)) * (time[1] - time[0])
    _assert_right(fit_readings(_stamped(readings, time + jitter, np.ones(len(time), bool))))


def test_gaps_cost_the_rotations_they_lie_in_and_nothing_else() -> None:
    """Twelve times 0.3 s or 0.1 s are missing anywhere."""
    readings = _recording(turns=6)
    time = readings.accelerometer.time
    holes = np.random.default_rng(0).uniform(0.0, time[-1], 12)
    keep = np.asarray((np.abs(time[:, None] - holes) > np.tile([0.15, 0.05], 6)).all(axis=1))
    report = fit_readings(_stamped(readings, time, keep))
    _assert_right(report)
    (said,) = (text for text in report.warnings if "rotations are not used" in text)
    assert re.search(r"used: a gap of up to 0\.3\d s in its time stamps \(\d times\)$", said)
