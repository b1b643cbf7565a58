"""An effect of the catalogue that no fit settles on."""

import itertools

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.effect import Circumstances, Effect


def restless(monkeypatch: pytest.MonkeyPatch, effect: type[Effect]) -> None:
    """Each time that a fit asks what the effect does, the answer is another one."""
    usual, factors = effect.columns, itertools.cycle((1.0, 2.0, 3.0))

    def columns(
        self: Effect, sensor: str, c: Circumstances, variant: float | None = None
    ) -> FloatArray:
        return np.asarray(next(factors) * usual(self, sensor, c, variant))

    monkeypatch.setattr(effect, "columns", columns)
    monkeypatch.setattr("imucal_wizard.estimate.fit.MAX_ITERATIONS", 8)  # others need four
    monkeypatch.setattr("imucal_wizard.model.terms.MAX_PASSES", 8)  # others need six
