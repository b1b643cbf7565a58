"""The nine-parameter gyroscope fit in the accelerometer's frame."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.attitude import RotationSamples
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.fit import fit as fit_rows
from imucal_wizard.estimate.fit import minimum
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.gyroscope_fit import determined_entries
from imucal_wizard.estimate.gyroscope_report import fit_gyroscope
from imucal_wizard.estimate.gyroscope_start import aided_start, misfit, start_matrix
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.rotation_set import rotation_set
from imucal_wizard.model.nominal_gains import CROSS_PRIOR, SCALE_PRIOR, Nominal, nominal_of
from imucal_wizard.model.rows.source import Parameters
from tests.estimate.motions import (
    STARTS,
    Turned,
    exact_accelerometer,
    experiment,
    free_turns,
    hand_turns,
)
from tests.estimate.truth import Truth, in_counts, turn, typical_gyroscope
from tests.estimate.wandering import wandering


def _of(fit: SensorFit) -> GyroscopeExperiment:
    assert isinstance(fit.experiment, GyroscopeExperiment)
    return fit.experiment


def _inside(data: Turned) -> tuple[RotationSamples, FloatArray, FloatArray, FloatArray]:
    """The rotations, up before and after each, and up at every sample."""
    turned = rotation_set(data.holds, data.rotations, exact_accelerometer(data.reference))
    up = data.reference.up
    assert turned.up is not None
    return turned.samples, up[turned.before], up[turned.after], turned.up


IDEAL = Truth(np.eye(3), np.zeros(3))


@pytest.mark.parametrize("gain", [None, 3206.9, 4778.0])
def test_all_twelve_parameters_come_back(gain: float | None) -> None:
    """Gains to 1e-6 (the integration at 100 samples/s), in rad/s and in counts around 32768."""
    truth = typical_gyroscope() if gain is None else in_counts(typical_gyroscope(), gain)
    motions = hand_turns(6, np.random.default_rng(0))
    fit = experiment(motions, truth, unit="count" if gain else "rad/s").fit()
    size = gain or 1.0
    assert np.abs(fit.matrix - truth.matrix).max() * size < 1e-6
    assert np.abs(fit.bias - truth.bias).max() < 1e-9 * size
    assert fit.not_determined == ()
    assert np.abs(fit.residuals).max() < 1e-6
    assert fit.held_out is not None
    assert np.abs(fit.held_out).max() < 3e-6


def test_the_samples_may_be_few() -> None:
    """At 50 samples/s the error is sixteen times larger, at 25 again: fourth order, not Euler."""
    errors = []
    for rate in (25.0, 50.0, 100.0):
        rng = np.random.default_rng(0)
        motions = [
            turn(start, np.array(vector), seconds=2.0, rate=rate, wobble=0.2 * np.ones(3))
            for start in STARTS.values()
            for vector in ((2.0, 0.3, 0.1), (-1.0, 2.0, 0.4), (0.5, -0.4, 2.5), (-2.0, -0.3, -2.0))
        ]
        fit = experiment(motions, IDEAL, rng).fit()
        errors.append(np.abs(fit.matrix - np.eye(3)).max())
    assert errors[0] > 10.0 * errors[1] > 100.0 * errors[2]
    assert errors[2] < 1e-5


@pytest.mark.parametrize(
    ("channels", "signs"),
    [
        ((1, 0, 2), (1, 1, 1)),
        ((2, 0, 1), (1, -1, 1)),
        ((0, 1, 2), (1, 1, -1)),
        ((0, 2, 1), (-1, 1, 1)),
    ],
)
@pytest.mark.parametrize("known", [True, False])
def test_swapped_and_negated_axes_are_found(
    channels: tuple[int, ...], signs: tuple[float, ...], known: bool
) -> None:
    """Nothing is assumed of order and sign; the fit says which axis feels which."""
    straight = typical_gyroscope()
    swap = np.zeros((3, 3))
    swap[channels, range(3)] = signs
    truth = Truth(swap @ straight.sensitivity, swap @ straight.bias)
    if not known:
        truth = in_counts(truth, 4778.0)
    fit = experiment(
        hand_turns(6, np.random.default_rng(1)), truth, unit="rad/s" if known else "count"
    ).fit()
    assert np.abs(fit.matrix @ truth.sensitivity - np.eye(3)).max() < 1e-6
    nominal = _of(fit).nominal
    assert nominal.channels == channels
    assert nominal.signs == signs


@pytest.mark.parametrize("factor", [2.0, 0.5, np.pi / 180.0, 180.0 / np.pi, 1e-3, 1e3])
def test_a_wrong_unit_or_rate_is_a_scale_like_any_other(factor: float) -> None:
    """Degrees for radians, a rate twice too high: the scale comes out as that factor."""
    truth = Truth(np.eye(3) / factor, np.zeros(3))
    fit = experiment(hand_turns(6, np.random.default_rng(2)), truth).fit()
    assert np.abs(fit.matrix / factor - np.eye(3)).max() < 1e-5


@pytest.mark.parametrize("factor", [0.5, 1.0, 2.0, 3.0])
def test_full_turns_are_counted_by_what_the_accelerometer_sees_on_the_way(factor: float) -> None:
    """After a full turn any whole number of turns closes; the way there tells them apart."""
    motions = [
        turn(STARTS[axis], sense * 2.0 * np.pi * np.eye(3)["xyz".index(axis)], seconds=4.0)
        for axis in "xyz"
        for sense in (1.0, -1.0)
    ]
    data = experiment(motions, Truth(np.eye(3) / factor, np.zeros(3)))
    start = start_matrix(*_inside(data), np.zeros(3), known=True)
    assert np.abs(np.diag(start) / factor - 1.0).max() < 0.05
    fit = data.fit()
    assert np.abs(np.diag(fit.matrix) / factor - 1.0).max() < 1e-5


def test_the_start_needs_no_unit() -> None:
    """From up during the turns alone, to 0.1 % where the hand adds no acceleration."""
    truth = in_counts(typical_gyroscope(), 4778.0)
    data = experiment(hand_turns(3, np.random.default_rng(3)), truth)
    samples, before, after, up = _inside(data)
    start = aided_start(samples, before, after, up, truth.bias)
    assert np.abs(start @ truth.sensitivity - np.eye(3)).max() < 1e-3
    assert misfit(samples, before, up, start, truth.bias) < 1e-6


def test_counts_without_the_accelerometer_on_the_way_are_refused() -> None:
    """Nothing says what a count is; the reason is given."""
    data = experiment(hand_turns(3, np.random.default_rng(3)), in_counts(IDEAL, 4778.0))
    with pytest.raises(DataError, match="counts"):
        start_matrix(*_inside(data)[:3], None, np.zeros(3), known=False)
    start = start_matrix(*_inside(data)[:3], None, np.zeros(3), known=True)
    assert (start == np.eye(3)).all()


def test_a_dead_gyroscope_is_refused() -> None:
    """It turns and nothing is read."""
    data = experiment(hand_turns(3, np.random.default_rng(3)), Truth(np.zeros((3, 3)), np.ones(3)))
    with pytest.raises(DataError, match="dead"):
        start_matrix(*_inside(data), np.ones(3), known=True)


SIGMA = 0.0025
"""Noise of a sample: 0.02 °/s/√Hz at 100 samples/s, a consumer sensor's."""


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_turns_about_one_axis_determine_only_its_own_column(axis: str) -> None:
    """How the other two sensor axes feel anything is not shown; they stay at 1 and 0 and are named.

    The turns are those of a mechanical axis, without a hand's wobble.
    """
    rng = np.random.default_rng(4)
    motions = hand_turns(12, rng, axes=axis, wobble=0.0)
    fit = experiment(motions, typical_gyroscope(), rng, sigma=SIGMA).fit()
    others = [other for other in "xyz" if other != axis]
    never = {f"sensitivity_{other}" for other in others}
    never |= {f"cross_{row}{column}" for row in "xyz" for column in others if row != column}
    assert never <= set(fit.not_determined)
    column = "xyz".index(axis)
    rest = np.delete(fit.matrix, column, axis=1)
    assert (rest == np.delete(np.eye(3), column, axis=1)).all()
    truth = typical_gyroscope().matrix[column, column]
    error = float(np.sqrt(np.asarray(fit.covariance)[4 * column, 4 * column]))
    assert f"sensitivity_{axis}" not in fit.not_determined
    assert abs(fit.matrix[column, column] - truth) < 5.0 * error + 3e-4


def test_a_scale_that_counts_do_not_show_cannot_be_nominal() -> None:
    """Nobody knows what a count about z is when nothing turned about z."""
    rng = np.random.default_rng(5)
    motions = hand_turns(12, rng, axes="xy", wobble=0.0)
    truth = in_counts(typical_gyroscope(), 4778.0)
    data = experiment(motions, truth, rng, sigma=SIGMA, unit="count")
    with pytest.raises(DataError, match="scale about z"):
        data.fit()


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_turns_in_one_plane_do_not_determine_the_gain_out_of_it(axis: str) -> None:
    """In full turns about a level axis what is felt about the others cancels on the way round."""
    rng = np.random.default_rng(6)
    along = np.eye(3)["xyz".index(axis)]
    motions = [
        turn(STARTS[axis], sense * 2.0 * np.pi * along, seconds=float(seconds))
        for sense in (1.0, -1.0)
        for seconds in (2.0, 3.0, 4.0)
    ]
    fit = experiment(motions, typical_gyroscope(), rng, sigma=SIGMA).fit()
    assert {f"cross_{row}{axis}" for row in "xyz" if row != axis} <= set(fit.not_determined)
    assert f"sensitivity_{axis}" not in fit.not_determined


def test_every_gain_that_is_not_determined_has_the_variance_of_datasheets() -> None:
    """It is no result, and as wrong as sensors usually are."""
    rng = np.random.default_rng(7)
    fit = experiment(hand_turns(6, rng, axes="x"), typical_gyroscope(), rng, sigma=SIGMA).fit()
    variance = dict(
        zip(
            (f"{r}{c}" for r in "xyz" for c in "xyz"),
            np.diag(np.asarray(fit.covariance)),
            strict=False,
        )
    )
    for name in fit.not_determined:
        axes = name[-1] * 2 if name.startswith("sensitivity") else name[-2:]
        usual = SCALE_PRIOR if axes[0] == axes[1] else CROSS_PRIOR
        assert np.sqrt(variance[axes]) == pytest.approx(usual, rel=0.05)


def test_dropped_gains_keep_swapped_axes_apart() -> None:
    """With x and y swapped, turns about body x are felt by sensor y: its gain is carried."""
    rng = np.random.default_rng(8)
    swap = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    motions = hand_turns(8, rng, axes="x", wobble=0.0)
    data = experiment(motions, Truth(swap, np.zeros(3)), rng, sigma=SIGMA)
    known = exact_accelerometer(data.reference)
    turned = rotation_set(data.holds, data.rotations, known)
    start = Parameters(swap, np.zeros(3))
    nominal = Nominal(channels=(1, 0, 2))
    rough = GyroscopeExperiment(data.holds, turned, data.reference, "rad/s", start, nominal)
    free = determined_entries(minimum(rough), nominal, tuple(range(12)))
    fit = fit_rows(rough.moved(start, free))
    assert "sensitivity_x" not in fit.not_determined
    assert {"sensitivity_y", "sensitivity_z"} <= set(fit.not_determined)
    assert (fit.matrix[:, 0] == [0.0, 1.0, 0.0]).all()


def test_nominal_gains_follow_the_first_estimate() -> None:
    """A clear permutation is taken; anything else is not guessed."""
    turned = Attitude.from_rotvec([0.05, -0.02, 0.1]).as_matrix()
    assert nominal_of(1.1 * turned, True) == Nominal()
    assert nominal_of(turned[:, [2, 0, 1]], True).channels == (1, 2, 0)
    unclear = np.array([[1.0, 0.2, 0.0], [0.9, 0.3, 0.0], [0.0, 0.0, 1.0]])
    assert nominal_of(unclear, False) == Nominal(known=False, clear=False)


def test_free_turns_serve_as_well_as_turns_about_axes() -> None:
    """No rotation has to be about one axis."""
    truth = typical_gyroscope()
    fit = experiment(free_turns(18, np.random.default_rng(9)), truth).fit()
    assert np.abs(fit.matrix - truth.matrix).max() < 2e-6


def test_a_gyroscope_that_does_not_fit_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no minimum is found, the user is told where to look."""
    monkeypatch.setattr("imucal_wizard.estimate.fit.MAX_ITERATIONS", 1)
    monkeypatch.setattr("imucal_wizard.estimate.fit.VALLEY", 1e-6)
    data = experiment(hand_turns(3, np.random.default_rng(3)), typical_gyroscope())
    with pytest.raises(DataError, match="sampling rate"):
        data.fit()


@pytest.mark.parametrize("rate", [25.0, 100.0])
def test_the_coning_that_the_derivative_leaves_out_moves_no_parameter(rate: float) -> None:
    """From where the fit ends, a Newton step of the cost itself is a thousandth of an error.

    The derivative leaves out how a rate changes the coning, half a hundredth of it at 100
    samples/s and four times that at 25, but it multiplies residuals, which are noise.
    """
    rng = np.random.default_rng(11)
    motions = hand_turns(6, rng, rate=rate)
    fit = experiment(motions, typical_gyroscope(), rng, sigma=2e-3, tilt_sigma=1e-3).fit()
    closure, table = _of(fit).closure, fit.rows
    assert table is not None
    assert fit.covariance is not None
    sigma = np.sqrt(np.diag(fit.covariance))
    # what the errors of the reference and the Earth's rate take away, which stay as they are
    known = table.reported - table.residual

    def cost(moved: FloatArray) -> float:
        """Of the rates at rest about their mean, and of the rotations."""
        errors = closure.rows_of(
            closure.closures(fit.matrix + moved[:9].reshape(3, 3), fit.bias + moved[9:])[:, :, None]
        )
        reading = (_of(fit).rest.reading - fit.bias - moved[9:]) @ fit.matrix.T
        independent = table.independent.rows(np.append(reading.ravel(), errors[:, 0]) - known)
        return float((independent**2 / table.variance).sum())

    step = 0.1
    slope = np.array(
        [(cost(step * one) - cost(-step * one)) / (2.0 * step) for one in np.diag(sigma)]
    )
    correlation = fit.covariance / np.outer(sigma, sigma)
    assert np.abs(0.5 * correlation @ slope).max() < 2e-3


def test_a_silent_axis_is_not_told_as_an_unsteady_hand() -> None:
    """The motion that it does not show is in the rests, whose mean forces then scatter."""
    session = wandering(2, 0.0, np.random.default_rng(11))
    first, said = session.rotations[0].before, []
    shaken = replace(first, accelerometer_covariance=1e4 * first.accelerometer_covariance)
    holds = [shaken if one is first else one for one in session.holds]
    rotations = [replace(session.rotations[0], before=shaken), *session.rotations[1:]]
    found = fit_accelerometer(holds, STANDARD_GRAVITY, "m/s^2")
    for dead in (False, True):
        sees = np.array([1.0, 0.0 if dead else 1.0, 1.0])
        turned = [replace(one, rate=one.rate * sees) for one in rotations]
        told = fit_gyroscope(holds, turned, found, "rad/s")
        assert (told.fit is None) == dead
        own = () if told.fit is None else told.fit.warnings
        said.append("; ".join((*told.warnings, *own)))
    assert "was not steady" in said[0]
    assert "axis y reads the same" in said[1]
    assert "was not steady" not in said[1]
