"""A wandering bias widens the standard errors of slow effects, and hardly those of others."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.hidden.designs import REPEATED
from benchmarks.hidden.fitted import left_over, measured_of
from benchmarks.hidden.noise import COLOURS
from benchmarks.hidden.recording import record
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.random_walk import with_random_walk
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.terms import Term
from tests.diagnose.recordings import fitted


def widened(term: str, colour: str) -> FloatArray:
    """By which factor each standard error of an added effect grows."""
    measured = measured_of(record(REPEATED, COLOURS[colour], (), np.random.default_rng(4)))
    found = fit(measured, [Term(effect(term))])
    wider = with_random_walk(found, left_over(measured, found))
    shown = {one.name: one.standard_error for one in wider.parameters}
    assert shown[f"{term}_x"] == pytest.approx(wider.size_errors[0][0])
    return np.asarray(wider.size_errors[0] / found.size_errors[0])


def test_a_random_walk_makes_a_drift_uncertain() -> None:
    """It goes as far in ten minutes as a drift would."""
    assert widened("bias-drift", "walk").min() > 1.5


def test_a_random_walk_says_little_of_a_bent_characteristic() -> None:
    """The poses come in any order."""
    assert widened("second-order", "walk").max() < 1.2


def test_white_noise_widens_nothing_much() -> None:
    """No wander is seen; what the holds cannot exclude is half of the error at most."""
    assert widened("bias-drift", "white").max() < 1.5


def test_a_model_without_effects_is_left_as_it_is() -> None:
    """There is nothing to widen."""
    measured = measured_of(record(REPEATED, COLOURS["walk"], (), np.random.default_rng(4)))
    found = fit(measured)
    assert with_random_walk(found, left_over(measured, found)) is found


def test_a_gyroscope_that_reads_another_bias_each_time_is_called_that() -> None:
    """What its rests show of the bias is in the rotations, too, as long as they take."""
    report, readings = fitted(poses="26+repeats", rotations=2)
    gyroscope, rng = readings.gyroscope, np.random.default_rng(8)
    assert gyroscope is not None
    changes = np.sort([time for hold in report.holds for time in (hold.start, hold.end)])
    biases = np.radians(0.05) * rng.normal(size=(len(changes) + 1, 3))
    values = gyroscope.values + biases[np.searchsorted(changes, gyroscope.time)]
    other = replace(readings, gyroscope=replace(gyroscope, values=values))
    bench = Benches(fit_readings(other), other).bench("gyroscope")
    assert bench is not None
    assert bench.look().opinion.verdict is Verdict.NOT_REPEATABLE
