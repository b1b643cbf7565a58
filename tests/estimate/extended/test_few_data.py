"""Few holds and few turns: a prior keeps every fit finite, and nothing runs away."""

import numpy as np
import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.accelerometer import BASE, accelerometer_experiment
from imucal_wizard.estimate.fit import fit
from imucal_wizard.model.catalogue import effects_for
from imucal_wizard.model.effect import Circumstances, Effect
from imucal_wizard.model.effects.second_order import SecondOrder
from imucal_wizard.model.terms import Term
from tests.estimate.extended.turns import Noise, course, measured, twenty_turns
from tests.estimate.truth import EIGHTEEN, SIX, holds_of, tilted, typical_accelerometer

NOISE = 3e-3
FEW_TURNS = measured(
    course(twenty_turns(1, 4)),
    noise=Noise(sample=1e-3, wander=1e-4, force=NOISE),
    rng=np.random.default_rng(0),
)
LADDER = [BASE, ("bias",), ("scale",), ()]


@pytest.mark.parametrize("one", effects_for("accelerometer"), ids=lambda one: one.name)
@pytest.mark.parametrize("directions", [SIX, EIGHTEEN], ids=["6", "18"])
def test_any_effect_can_be_fitted_to_few_holds(one: Effect, directions: FloatArray) -> None:
    """No size goes beyond what its prior allows, whatever of the base is left out."""
    rng = np.random.default_rng(1)
    found = holds_of(
        typical_accelerometer(),
        tilted(directions, 1.0, rng),
        noise=NOISE * rng.standard_normal((len(directions), 3)),
        sigma=NOISE,
    )
    data = accelerometer_experiment(found, 9.80665, "m/s^2")
    typical = np.array([p.typical for p in one.parameters("accelerometer")])
    for base in LADDER:
        plain, with_it = fit(data, (), base), fit(data, (Term(one),), base)
        assert with_it.rms_fitted <= 1.001 * plain.rms_fitted + 1e-6
        if base == BASE:
            assert (np.abs(with_it.sizes[0]) < 4.0 * typical).all()


@pytest.mark.parametrize("one", effects_for("gyroscope"), ids=lambda one: one.name)
def test_any_effect_can_be_fitted_to_four_turns(one: Effect) -> None:
    """Eight closures cannot know nine gains and an effect; the still means and the prior do."""
    plain, with_it = fit(FEW_TURNS), fit(FEW_TURNS, (Term(one),))
    assert with_it.rms_fitted < 1.1 * plain.rms_fitted + 1e-6
    typical = np.array([p.typical for p in one.parameters("gyroscope")])
    assert (np.abs(with_it.sizes[0]) < 4.0 * typical).all()
    for base in LADDER:
        assert np.isfinite(fit(FEW_TURNS, (Term(one),), base).rms_fitted)


def test_an_effect_without_a_value_is_refused_by_name() -> None:
    """A formula that divides by zero says so instead of spoiling the fit."""

    class Broken(SecondOrder):
        def columns(
            self, sensor: str, c: Circumstances, variant: float | None = None
        ) -> FloatArray:
            return np.asarray(np.nan * super().columns(sensor, c, variant))

    with pytest.raises(DataError, match="second-order has no value"):
        fit(FEW_TURNS, (Term(Broken()),))
