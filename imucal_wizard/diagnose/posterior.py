"""The probability of each explanation of one design, given a residual.

With patterns X at the prior size s, noise ``σ² W⁻¹`` (see ``random_walk``) and t = (s/σ)², the
residual r is Gaussian, and its likelihood gains against noise alone

    2 ln(p/p₀) = −ln |I + t XᵀWX| + (t/σ²) rᵀWX (I + t XᵀWX)⁻¹ XᵀWr

which the eigenvectors of XᵀWX turn into sums of single numbers. Sizes, σ and the random walk are
averaged over; the repeats in r itself determine how large the noise is.
"""

from collections.abc import Sequence
from copy import copy
from functools import cached_property
from itertools import groupby

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.hypotheses import (
    DISTURBED,
    EFFECT,
    NOTHING,
    PAIR,
    UNKNOWN,
    Hypothesis,
    Pairs,
    all_pairs,
    disturbances,
    effect_hypotheses,
    joint_hypotheses,
    noise_alone,
    siblings,
)
from imucal_wizard.diagnose.random_walk import SIGMAS, SQUARES, Frame, frame_of
from imucal_wizard.diagnose.residuals import WhitenedResiduals
from imucal_wizard.diagnose.unknown_structure import axes_changes, field_changes, unknown_structure

MAX_UNKNOWN_ALONE = 0.1
"""Probability of unknown structure up to which no pairs of whole effects are looked for."""
MIN_NOISE_SHARE = 1e-6
"""Share of the likeliest noise up to which another one is out of the question."""
MAX_NOISE_PROBABILITY = 0.1
"""Probability of noise alone above which nothing is claimed."""
MIN_SIBLING_SHARE = 1e-5
"""Of the probability of the likeliest explanation, below which two effects of a family are left
out: they are many, and each costs time wherever explanations are weighed."""
MAX_SIBLINGS = 12
"""Pairs of effects of one family, by what they explain at equal sizes, that are weighed at all."""
MAX_JOINED = 3
"""Explanations of a kind that are joined with others on all their parameters: each costs as much as
the set."""
JOINED_WITH = {EFFECT: 1, DISTURBED: 2}
"""Others that each of them is joined with. A disturbed rotation spoils the holds at its ends too,
so two disturbed items are told from an item between them only where both are tried together."""


@dataclass(frozen=True, eq=False)
class Posterior:
    """Every explanation's share of the probability.

    Attributes:
        evidence: logarithm of the marginal likelihood of each single explanation, shape (h,).
        single: probability of each single explanation, shape (h,).
        paired: probability of each pair, shape (p,).
        sigma: expected noise under each single explanation, shape (h,).
        sigma_paired: the same under each pair, shape (p,).
        noise: probability of each wander and σ over all explanations, shape (wanders, sigmas).
        wander: expected wander of the noise, over all explanations.
        log_evidence: logarithm of the marginal likelihood of all explanations together.
    """

    evidence: FloatArray
    single: FloatArray
    paired: FloatArray
    sigma: FloatArray
    sigma_paired: FloatArray
    noise: FloatArray
    wander: float
    log_evidence: float

    @property
    def expected_noise(self) -> float:
        """Expected noise over all explanations, in units of that within the holds."""
        return float(self.single @ self.sigma + self.paired @ self.sigma_paired)


class HypothesisSet:
    """All explanations of one design, ready to judge any residual of it.

    Args:
        frame: the coordinates.
        hypotheses: the single explanations; the first is noise alone.
        pairs: the pairs, or None.
        inside: what is left out of all patterns, orthonormal, shape (m, k), or None.
    """

    def __init__(
        self,
        frame: Frame,
        hypotheses: Sequence[Hypothesis],
        pairs: Pairs | None = None,
        inside: FloatArray | None = None,
    ) -> None:
        self.frame = frame
        self.single = tuple(hypotheses)
        self.pairs = pairs
        self.log_prior = np.array([one.log_prior for one in hypotheses])
        others = self.single[1:]
        self.spectra = spectra(others, frame.each_weights, inside) if others else []

    def posterior(self, residual: FloatArray) -> Posterior:
        """Weigh all explanations.

        Args:
            residual: whitened, shape (n,).
        """
        coordinates = self.frame.across.T @ residual
        alone = self.frame.log_noise(coordinates)
        single = self._single(coordinates, alone)
        evidence = _log_of_sum(single.reshape(len(single), -1))
        single += self.log_prior[:, None, None]
        highest = single.max()
        # two effects explain more than one, and leave no larger noise
        wanders, sigmas = _likely_noise(np.exp(single - highest).sum(axis=0))
        paired = self._paired(coordinates, alone[:wanders, :sigmas] - highest)
        beyond = float(paired.max(initial=0.0))
        single = np.exp(single - (highest + beyond))
        paired -= np.float32(beyond)
        np.exp(paired, out=paired)
        total = single.sum() + paired.sum(dtype=np.float64)
        noise = single.sum(axis=0)
        noise[:wanders, :sigmas] += paired.sum(axis=1, dtype=np.float64)
        noise /= total
        of_pairs = np.zeros((paired.shape[1], single.shape[2]))
        of_pairs[:, :sigmas] = paired.sum(axis=0)
        by_sigma = np.concatenate([single.sum(axis=1), of_pairs]) / total
        share = by_sigma.sum(axis=1)
        sigma = (by_sigma @ SIGMAS) / np.maximum(share, 1e-300)
        count = len(self.single)
        return Posterior(
            evidence,
            share[:count],
            share[count:],
            sigma[:count],
            sigma[count:],
            noise,
            float(noise.sum(axis=1) @ np.array(self.frame.wanders)),
            float(highest + beyond + np.log(total)),
        )

    def likeliest_effects(self, posterior: Posterior) -> list[tuple[str, float | None]]:
        """The effects of the likeliest explanation by effects alone, each with its setting."""
        single = np.array([bool(one.terms) for one in self.single])
        shares = np.where(single, posterior.single, 0.0)
        members: Sequence[Hypothesis] = (self.single[int(shares.argmax())],)
        if self.pairs is not None and posterior.paired.max() > shares.max():
            members = self.pairs.both(int(posterior.paired.argmax()))
        members = members[0].members or members
        return [(one.terms[0], one.variant) for one in members if one.terms]

    def with_joint(
        self, residual: FloatArray, posterior: Posterior, kinds: Sequence[str]
    ) -> "HypothesisSet":
        """The set with pairs of explanations of which one has several parameters.

        All of them would be too many. Joined are the likeliest effects on all parameters, and the
        likeliest holds and rotations of several rows, each with the likeliest effect and the two
        likeliest disturbed holds or rotations of what it leaves.

        Args:
            residual: whitened, shape (n,).
            posterior: of the set for this residual.
            kinds: of the first of each pair.

        Returns:
            The same set where there is nothing to join.
        """
        whole: dict[str, dict[object, Hypothesis]] = {EFFECT: {}, DISTURBED: {}}
        for place in np.argsort(-(posterior.evidence + self.log_prior)).tolist():
            one = self.single[place]
            if one.kind == EFFECT and not one.parameter:
                whole[EFFECT].setdefault(one.terms[0], one)
            elif one.kind == DISTURBED and one.patterns.shape[1] > 1:
                whole[DISTURBED].setdefault(one.variant, one)
        made: list[Hypothesis] = []
        coordinates = self.frame.across.T @ residual
        for first in [one for kind in kinds for one in list(whole[kind].values())[:MAX_JOINED]]:
            inside = np.linalg.svd(first.patterns, full_matrices=False)[0]
            left = self.frame.across @ (coordinates - inside @ (inside.T @ coordinates))
            for kind, count in JOINED_WITH.items():
                known = [one for one in self.single if _joins(first, one, kind)]
                odds = self._odds(known, left, inside) if known else np.zeros(0)
                others: dict[object, Hypothesis] = {}
                for place in np.argsort(-odds, kind="stable").tolist():
                    others.setdefault(known[place].terms or known[place].variant, known[place])
                for other in list(others.values())[:count]:
                    made += joint_hypotheses(first, other)
        return self._widened(made)

    def with_siblings(self, residual: FloatArray, posterior: Posterior) -> "HypothesisSet":
        """The set with the likely pairs of whole effects of one slow family.

        Args:
            residual: whitened, shape (n,).
            posterior: of the set for this residual.
        """
        both = siblings(self.single)
        if not both:
            return self
        # of equal sizes first: every ratio costs as much as all of them
        equal = [one for each in both for one in joint_hypotheses(*each, ratios=(1.0,))]
        likely = np.argsort(-self._odds(equal, residual))[:MAX_SIBLINGS]
        made = [one for place in likely.tolist() for one in joint_hypotheses(*both[place])]
        odds = self._odds(made, residual)
        highest = max(float(odds.max()), float((posterior.evidence + self.log_prior).max()))
        least = highest + float(np.log(MIN_SIBLING_SHARE))
        kept = [one for one, own in zip(made, odds, strict=True) if own > least]
        return self._widened(kept)

    def _widened(self, made: Sequence[Hypothesis]) -> "HypothesisSet":
        """The set with more single explanations; the same set without any."""
        if not made:
            return self
        wider = copy(self)
        wider.single = (*self.single, *made)
        wider.log_prior = np.array([one.log_prior for one in wider.single])
        more = spectra(made, self.frame.each_weights)
        wider.spectra = [one.joined(own) for one, own in zip(self.spectra, more, strict=True)]
        return wider

    def _odds(
        self, made: Sequence[Hypothesis], residual: FloatArray, inside: FloatArray | None = None
    ) -> FloatArray:
        """Prior and evidence of explanations, in logarithms, shape (h,).

        Args:
            made: the explanations.
            residual: whitened, shape (n,).
            inside: what is left out of their patterns, orthonormal, shape (m, k), or None.
        """
        own = HypothesisSet(self.frame, (self.single[0], *made), inside=inside)
        return own.log_prior[1:] + own.posterior(residual).evidence[1:]

    def beside(
        self, coordinates: FloatArray, inside: FloatArray, largest_wander: float = np.inf
    ) -> dict[str, float]:
        """Probability of each kind of single explanation of what a name leaves.

        Args:
            coordinates: of a residual, shape (m,).
            inside: what the name takes up, orthonormal, shape (m, k).
            largest_wander: of the noise, where it is known.
        """
        rest = HypothesisSet(self.frame.up_to(largest_wander), self.single, inside=inside)
        left = coordinates - inside @ (inside.T @ coordinates)
        found = rest.posterior(self.frame.across @ left)
        shares = dict.fromkeys((NOTHING, EFFECT, PAIR, DISTURBED, UNKNOWN), 0.0)
        for one, share in zip(self.single, found.single, strict=True):
            shares[one.kind] += float(share)
        return shares

    def _single(self, coordinates: FloatArray, alone: FloatArray) -> FloatArray:
        """Likelihood averaged over the size, shape (h, wanders, sigmas)."""
        gains = np.stack([one.gains(coordinates) for one in self.spectra], axis=1)
        averaged = _log_of_sum(np.moveaxis(gains, 2, -1)) - np.log(gains.shape[2])
        return np.asarray(alone + np.concatenate([np.zeros((1, *averaged.shape[1:])), averaged]))

    def _paired(self, coordinates: FloatArray, alone: FloatArray) -> NDArray[np.float32]:
        """Likelihood and prior under the first wanders and σ, shape (wanders, p, sigmas)."""
        wanders, sigmas = alone.shape
        if self.pairs is None:
            return np.zeros((wanders, 0, sigmas), np.float32)
        weights = self.frame.each_weights[:wanders]
        found = self.pairs.gains(coordinates, weights, SQUARES[:sigmas])
        found += alone.astype(np.float32)[:, None, :]
        found += self.pairs.log_prior.astype(np.float32)[:, None]
        return found


def _log_of_sum(logs: FloatArray) -> FloatArray:
    """Logarithm of the sum over the last axis of what has these logarithms, shape (…)."""
    highest = logs.max(axis=-1)
    terms = logs - highest[..., None]
    return np.asarray(highest + np.log(np.exp(terms, out=terms).sum(axis=-1)))


def _joins(first: Hypothesis, other: Hypothesis, kind: str) -> bool:
    """Whether an explanation of this kind is to be joined with another one, found before it."""
    if other.kind != kind:
        return False
    if kind == DISTURBED:  # what has one row is among the pairs
        return other.patterns.shape[1] > 1 and other.variant != first.variant
    return first.kind == EFFECT and other.families != first.families


def _likely_noise(share: FloatArray) -> tuple[int, int]:
    """How many wanders and σ, from the smallest on, are not out of the question.

    Args:
        share: probability of each wander and σ, in any unit, shape (wanders, sigmas).
    """
    likely = np.argwhere(share > MIN_NOISE_SHARE * share.max())
    return int(likely[:, 0].max()) + 1, int(likely[:, 1].max()) + 1


def explained(
    misfit: WhitenedResiduals, largest_wander: float = np.inf
) -> tuple[HypothesisSet, Posterior]:
    """Everything that may explain a misfit, and the probabilities.

    Where noise alone is improbable, pairs of whole effects of one slow family are among the
    explanations. So are other pairs of which one has several parameters: with a disturbed hold or
    rotation where noise does not make what is left, and all where unknown structure is likely.

    Args:
        misfit: what is left.
        largest_wander: of the noise, where it is known.
    """
    hypotheses = hypothesis_set(misfit, largest_wander=largest_wander)
    posterior = hypotheses.posterior(misfit.residual)
    unknown = [one.kind == UNKNOWN for one in hypotheses.single]
    kinds: tuple[str, ...] = ()
    if posterior.single[unknown].sum() > MAX_UNKNOWN_ALONE:
        kinds = EFFECT, DISTURBED
    elif not misfit.lack_of_fit().within_noise:
        kinds = (DISTURBED,)
    joint = hypotheses.with_joint(misfit.residual, posterior, kinds)
    if joint is not hypotheses:
        hypotheses, posterior = joint, joint.posterior(misfit.residual)
    if posterior.single[0] < MAX_NOISE_PROBABILITY:
        wider = hypotheses.with_siblings(misfit.residual, posterior)
        if wider is not hypotheses:
            hypotheses, posterior = wider, wider.posterior(misfit.residual)
    return hypotheses, posterior


def hypothesis_set(
    misfit: WhitenedResiduals, pairs: bool = True, largest_wander: float = np.inf
) -> HypothesisSet:
    """Everything that may explain a misfit of this design."""
    frame = frame_of(misfit).up_to(largest_wander)
    made = [noise_alone(frame), *effect_hypotheses(misfit, frame), *disturbances(misfit, frame)]
    made += unknown_structure(misfit, frame)
    made += axes_changes(misfit, frame) + field_changes(misfit, frame)
    return HypothesisSet(frame, made, all_pairs(made) if pairs else None)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Explanations under one wander of the noise, each as a sum over rows.

    Explanations with the same number of patterns follow one another.

    Attributes:
        weights: of each coordinate, shape (m,).
        patterns: of the explanations, by their number q of patterns, shape (m, g q) each.
        turned: what turns them into independent ones of length one, shape (g, q, q) each.
        gain: what the square of each row adds to the log likelihood, (rows, spreads, sigmas).
        log_det: per explanation, shape (h, spreads, sigmas); more where a spread is less likely
            than the mean of all.
        starts: first row of each explanation, shape (h,).
        order: place of each of the hypotheses among these explanations, shape (h,).
    """

    weights: FloatArray
    patterns: tuple[FloatArray, ...]
    turned: tuple[FloatArray, ...]
    gain: FloatArray
    log_det: FloatArray
    starts: NDArray[np.intp]
    order: NDArray[np.intp]

    def along(self, coordinates: FloatArray) -> FloatArray:
        """Residuals along the rows, which are independent numbers, shape (k, rows).

        Args:
            coordinates: of the residuals, shape (k, m).
        """
        weighted, found = coordinates * self.weights, []
        for patterns, turned in zip(self.patterns, self.turned, strict=True):
            own = (weighted @ patterns).reshape(len(weighted), *turned.shape[:2])
            rows = np.swapaxes(np.swapaxes(own, 0, 1) @ turned, 0, 1)
            found.append(rows.reshape(len(weighted), patterns.shape[1]))
        return np.concatenate(found, axis=1)

    def joined(self, other: "Spectrum") -> "Spectrum":
        """The spectrum of these explanations and of others, under the same wander."""
        both = (self, other)
        counts = np.concatenate([np.diff(one.starts, append=len(one.gain)) for one in both])
        first = np.concatenate([self.starts, len(self.gain) + other.starts])
        by_count = np.argsort(counts, kind="stable")
        counts, first = counts[by_count], first[by_count]
        starts = np.cumsum(counts) - counts
        rows = np.repeat(first - starts, counts) + np.arange(counts.sum())
        place = np.argsort(by_count)
        stacks: dict[int, list[tuple[FloatArray, FloatArray]]] = {}
        for one in both:
            for patterns, turned in zip(one.patterns, one.turned, strict=True):
                stacks.setdefault(turned.shape[1], []).append((patterns, turned))
        every = [stacks[q] for q in sorted(stacks)]
        return Spectrum(
            self.weights,
            tuple(np.concatenate([one for one, _ in each], axis=1) for each in every),
            tuple(np.concatenate([one for _, one in each]) for each in every),
            np.concatenate([one.gain for one in both])[rows],
            np.concatenate([one.log_det for one in both])[by_count],
            starts,
            place[np.concatenate([self.order, len(self.order) + other.order])],
        )

    @cached_property
    def basis(self) -> FloatArray:
        """A residual's coordinates times this are what ``along`` gives, shape (m, rows)."""
        return self.along(np.eye(len(self.weights)))

    def gains(self, coordinates: FloatArray) -> FloatArray:
        """What each explanation adds to the log likelihood of noise alone, (h, spreads, sigmas).

        Args:
            coordinates: of a residual, shape (m,).
        """
        squares, found, first = self.along(coordinates[None])[0] ** 2, [], 0
        for turned in self.turned:  # explanations with the same number of patterns
            rows = slice(first, first := first + turned.shape[0] * turned.shape[1])
            shape = (*turned.shape[:2], *self.gain.shape[1:])
            own = squares[rows].reshape(turned.shape[:2])
            found.append(np.einsum("gq,gqst->gst", own, self.gain[rows].reshape(shape)))
        every = np.concatenate(found)
        every -= self.log_det
        every *= 0.5
        return every[self.order]


def spectra(
    hypotheses: Sequence[Hypothesis],
    each_weights: Sequence[FloatArray],
    inside: FloatArray | None = None,
) -> list[Spectrum]:
    """The spectrum of explanations, each with at least one pattern, under each wander.

    Args:
        hypotheses: the explanations.
        each_weights: of each coordinate, shape (m,), under each wander.
        inside: what is left out of all patterns, orthonormal, shape (m, k), or None.
    """
    counts = np.array([one.patterns.shape[1] for one in hypotheses])
    by_count = np.argsort(counts, kind="stable")
    ordered, counts = [hypotheses[place] for place in by_count.tolist()], counts[by_count]
    alike = [
        [*each] for _, each in groupby([one.patterns for one in ordered], lambda x: x.shape[1])
    ]
    sizes = [each[0].shape[1] for each in alike]
    stacks = [np.concatenate(each, axis=1) for each in alike]
    if inside is not None:
        stacks = [stack - inside @ (inside.T @ stack) for stack in stacks]
    each_of = [
        np.ascontiguousarray(stack.T).reshape(stack.shape[1] // q, q, len(stack))
        for q, stack in zip(sizes, stacks, strict=True)
    ]
    starts = np.cumsum(counts) - counts
    spreads = np.array([one.spreads for one in ordered]) ** 2
    shares = np.array([one.shares for one in ordered])
    spreads, unlikely = spreads[:, :, None] / SQUARES, -2.0 * np.log(shares * shares.shape[1])
    found = []
    for weights in each_weights:
        gain, turned = np.empty((counts.sum(), *spreads.shape[1:])), []
        log_det, first, start = np.empty_like(spreads), 0, 0
        for each in each_of:
            inner = (each * weights) @ np.swapaxes(each, 1, 2)
            if inner.shape[1] == 1:  # most explanations have one pattern, which is independent
                strength, vectors = inner[:, 0], np.ones_like(inner)
            else:
                strength, vectors = np.linalg.eigh(inner)
            strength = np.maximum(strength, 0.0)
            length = np.sqrt(np.maximum(strength, 1e-12 * strength[:, -1:] + 1e-300))
            turned.append(vectors / length[:, None, :])
            own = slice(start, start := start + len(each))
            rows = gain[first : (first := first + strength.size)]
            # in place, because new arrays of this size cost more than what is computed
            ratio = rows.reshape(*strength.shape, *spreads.shape[1:])
            np.multiply(strength[..., None, None], spreads[own, None], out=ratio)
            log_det[own] = np.log1p(ratio).sum(axis=1)
            ratio /= (1.0 + ratio) * SQUARES
        log_det += unlikely[:, :, None]
        known = weights, tuple(stacks), tuple(turned)
        found.append(Spectrum(*known, gain, log_det, starts, np.argsort(by_count)))
    return found
