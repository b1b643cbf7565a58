"""The likeliest explanations: how much of the misfit each part of them takes away."""

import numpy as np

from imucal_wizard.bench.evidence import Jury, Weighed
from imucal_wizard.bench.hypotheses import DISTURBED
from imucal_wizard.bench.misfit import Misfit
from imucal_wizard.readings import FloatArray

SLIGHT = 1e-3
"""A wander of the noise less likely than this is left out."""


class Best:
    """The likeliest explanations, and what they take away.

    Args:
        misfit: what is left.
        jury: the explanations.
        weighed: their probabilities.
    """

    def __init__(self, misfit: Misfit, jury: Jury, weighed: Weighed) -> None:
        self._misfit, self._jury, self._weighed = misfit, jury, weighed
        self._coordinates = jury.frame.across.T @ misfit.residual
        self._wandering = weighed.noise.sum(axis=1)
        single, paired = weighed.single, weighed.paired
        self._pair_wins = len(paired) > 0 and paired.max() > single.max()
        self.noise = float(
            weighed.sigma_paired[paired.argmax()]
            if self._pair_wins
            else weighed.sigma[single.argmax()]
        )

    @property
    def left(self) -> float:
        """What is left in all, rms over its degrees of freedom, in the same units as ``noise``."""
        return float(np.sqrt(np.mean(self._coordinates**2))) if len(self._coordinates) else 0.0

    @property
    def left_by_all(self) -> float:
        """The same with every effect of the catalogue taken away, whatever sizes that needs."""
        columns = [one.columns * one.typical for one in self._misfit.candidates]
        if not columns:
            return self.left
        inside = self._jury.frame.across.T @ np.concatenate(columns, axis=1)
        left, values, _ = np.linalg.svd(inside, full_matrices=False)
        taken = left[:, values > 1e-9 * values.max(initial=0.0)]
        rest = self._coordinates - taken @ (taken.T @ self._coordinates)
        return float(np.sqrt((rest @ rest) / max(len(rest) - taken.shape[1], 1)))

    def taken_away(self, families: tuple[str, ...]) -> dict[str, float]:
        """Squares of the noise that each of these families takes away beside the others."""
        parts, noise = self._likeliest(families)
        whole = self._explained([patterns for _, patterns in parts])
        return {
            family: (whole - self._explained([x for own, x in parts if own != family])) / noise**2
            for family in families
            if parts
        }

    def strongest(self) -> float:
        """The same for the likeliest explanation by effects, as a whole."""
        parts, noise = self._likeliest(())
        return self._explained([patterns for _, patterns in parts]) / noise**2

    def _likeliest(self, families: tuple[str, ...]) -> tuple[list[tuple[str, FloatArray]], float]:
        """Patterns by family of the likeliest explanation that has these families; its noise."""
        jury, weighed = self._jury, self._weighed
        wanted = set(families)
        fits = np.array(
            [
                (bool(h.terms) or DISTURBED in wanted) and wanted <= set(h.families)
                for h in jury.hypotheses
            ]
        )
        single = np.where(fits, weighed.single, 0.0)
        paired = weighed.paired * self._pairs_with(wanted)
        if not single.any() and not paired.any():
            return [], 1.0
        if len(paired) and paired.max() > single.max():
            place = int(paired.argmax())
            both = [] if jury.pairs is None else jury.pairs.both(place)
            return [(h.families[0], h.patterns) for h in both], float(weighed.sigma_paired[place])
        place = int(single.argmax())
        one = jury.hypotheses[place]
        return [(one.families[0], one.patterns)], float(weighed.sigma[place])

    def _pairs_with(self, wanted: set[str]) -> FloatArray:
        pairs = self._jury.pairs
        if pairs is None:
            return np.zeros(0)
        found = np.ones(len(pairs))
        for family in wanted:
            own = np.array([family in one.families for one in pairs.members])
            found *= own[pairs.first] | own[pairs.second]
        return found

    def _explained(self, patterns: list[FloatArray]) -> float:
        """Squares that patterns take away, expected over how far the noise may wander.

        A little doubt about a far wander is not a middling wander: of a slow effect that one takes
        nearly everything.
        """
        if not patterns:
            return 0.0
        weights, shares = self._jury.weights, self._wandering
        return sum(
            float(share) * self._explained_under(patterns, own)
            for own, share in zip(weights, shares, strict=True)
            if share > SLIGHT
        )

    def _explained_under(self, patterns: list[FloatArray], weights: FloatArray) -> float:
        root = np.sqrt(weights)
        columns = root[:, None] * np.concatenate(patterns, axis=1)
        left, values, _ = np.linalg.svd(columns, full_matrices=False)
        # no value at all where the model has taken up every row that was measured
        inside = left[:, values > 1e-6 * values.max(initial=0.0)].T @ (root * self._coordinates)
        return float(inside @ inside)
