"""What adding an effect would do is what adding it does."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.promises import promises
from imucal_wizard.core.readings import BoolArray, FloatArray
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals, candidate_at
from imucal_wizard.diagnose.suspects import EffectTrial, try_effects
from imucal_wizard.model.effect import MAGNETOMETER
from tests.diagnose.recordings import fitted
from tests.diagnose.sessions import session


def refitted(
    misfit: WhitenedResiduals, trial: EffectTrial, keep: BoolArray, candidate: Candidate
) -> tuple[FloatArray, float]:
    """Errors of all rows under the fit of those kept, m/s², and its cost: priors as rows."""
    balance, system = trial.found.balance, misfit.minimum.system
    columns = -misfit.measured(candidate.columns)
    columns = np.concatenate([system.columns, columns], axis=1)
    held = np.diag(np.sqrt(balance.precision))[balance.precision > 0.0]
    rows = np.concatenate([(columns / np.sqrt(balance.variance)[:, None])[keep], held])
    wanted = np.concatenate([(system.residual / np.sqrt(balance.variance))[keep], 0.0 * held[:, 0]])
    scale = np.linalg.norm(rows, axis=0)
    found = np.linalg.lstsq(rows / scale, wanted, rcond=None)[0] / scale
    return np.asarray(system.residual - columns @ found), float(
        ((wanted - rows @ found) ** 2).sum()
    )


@pytest.mark.parametrize("term", ["second-order", "warm-up", "cross-product"])
def test_fitted_and_held_out_errors_are_those_of_explicit_fits(term: str) -> None:
    """Without any refit, to the last digit: all rows, and each direction left out in turn.

    The others choose the time constant, too, among those that are tried.
    """
    misfit, _ = session("second-order:2:y")
    candidate = next(one for one in misfit.candidates if one.term == term)
    trial = try_effects(misfit, (candidate,), np.diag(misfit.noise))
    whole, _ = refitted(misfit, trial, np.ones(len(misfit), np.bool_), candidate)
    np.testing.assert_allclose(trial.found.errors, whole, atol=1e-6 * misfit.sigma.min())
    tried = candidate.effect.variants(misfit.minimum.experiment.circumstances)
    variants = {one for one in (candidate.variant, *tried) if one is not None}
    settings = [candidate_at(misfit, candidate.effect, one) for one in variants] or [candidate]
    left = np.empty(len(misfit))
    for group in np.unique(misfit.group):
        out = misfit.group == group
        fits = [refitted(misfit, trial, ~out, one) for one in settings]
        left[out] = min(fits, key=lambda fit: fit[1])[0][out]
    assert trial.rms_held_out == pytest.approx(float(np.sqrt(np.mean(left**2))), rel=1e-6)


def noisy(misfit: WhitenedResiduals, whitened: FloatArray) -> WhitenedResiduals:
    """The same misfit with other residuals."""
    found = misfit.minimum
    residual = found.independent.rows(misfit.measured(whitened))
    minimum = replace(found, system=replace(found.system, residual=residual))
    return replace(misfit, residual=whitened, minimum=minimum)


@pytest.mark.parametrize("wander", [0.0, 0.6])
@pytest.mark.parametrize("term", ["second-order", "bias-drift"])
def test_the_size_comes_back_within_its_standard_error(term: str, wander: float) -> None:
    """Over many noises, steady or wandering, the size scatters by its standard error."""
    misfit, hypotheses = session(colour="white")
    candidate = next(one for one in misfit.candidates if one.term == term)
    size = float(candidate.typical[1])
    hidden = size * candidate.columns[:, 1]
    walk = hypotheses.frame.walked(wander)
    root = np.linalg.cholesky(np.eye(len(misfit)) + walk)
    scatter = (misfit.sigma[:, None] * root) @ (misfit.sigma[:, None] * root).T
    rng = np.random.default_rng(3)
    off = []
    for _ in range(200):
        other = noisy(misfit, hidden + root @ rng.standard_normal(len(misfit)))
        trial = try_effects(other, (candidate,), scatter)
        off.append((trial.size[1] - size) / trial.standard_error[1])
    assert np.mean(off) == pytest.approx(0.0, abs=0.4)  # the prior pulls a little towards zero
    assert np.std(off) == pytest.approx(1.0, abs=0.15)


def test_an_effect_that_is_not_there_does_not_help_what_is_held_out() -> None:
    """More columns fit better, but do not predict better."""
    misfit, _ = session(colour="white")
    rng = np.random.default_rng(4)
    candidate = next(one for one in misfit.candidates if one.term == "cross-product")
    better = []
    for _ in range(40):
        noise = rng.standard_normal(len(misfit))
        other = noisy(misfit, noise)
        plain, more = (try_effects(other, one, np.diag(misfit.noise)) for one in ((), (candidate,)))
        assert more.rms_fitted < plain.rms_fitted
        assert more.rms_held_out is not None
        assert plain.rms_held_out is not None
        better.append(more.rms_held_out < plain.rms_held_out)
    assert np.mean(better) < 0.3


@pytest.mark.parametrize("sensor", ["accelerometer", "gyroscope"])
@pytest.mark.parametrize("hidden", ["second-order:5:x", "gyroscope/g-sensitivity:0.1:xy"])
def test_a_promised_error_is_the_one_that_adding_brings(sensor: str, hidden: str) -> None:
    """Also where the gyroscope's reference is wrong, by what the accelerometer lacks.

    The trial moves once, along straight lines; that is the only difference.
    """
    bench = Benches(*fitted(hidden, rotations=3, seed=3)).bench(sensor)
    assert bench is not None
    tried = [one for one in bench.look().suspects if one.trial is not None][:3]
    for one in tried:
        assert one.trial is not None
        assert one.candidate is not None
        rung = bench.add(one.term, one.candidate.variant)
        assert one.trial.rms_fitted == pytest.approx(rung.rms_fitted, rel=0.15)
        assert one.trial.rms_held_out == pytest.approx(rung.rms_held_out, rel=0.15)
        bench.undo()


@pytest.mark.study
def test_a_promised_error_of_a_magnetometer_is_the_one_that_adding_brings() -> None:
    """Of each of its first suspects in a whole recording, to 15 %."""
    found = promises(8100, 0, (MAGNETOMETER,))
    assert len(found) >= 2
    assert all(one.kept for one in found)
