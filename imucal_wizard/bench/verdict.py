"""What the evidence carries, in one word: and it is as ready to say "cannot tell" as to name.

Every explanation has a probability. A family of effects (effects that 1 g cannot split) is named
when the explanations that contain it hold most of the probability, when it takes away more of the
misfit than chance or an unknown effect's shadow does, and when noise alone does not make such a
misfit more than once in a hundred designs.
"""

from collections import defaultdict
from dataclasses import dataclass
from enum import StrEnum
from typing import TypeVar

import numpy as np

from imucal_wizard.bench.evidence import Jury
from imucal_wizard.bench.hypotheses import DISTURBED, NOTHING, UNKNOWN, WANDER
from imucal_wizard.bench.misfit import Misfit
from imucal_wizard.readings import FloatArray

NAMED = 0.75
"""Share of the probability that explanations with a family must hold for it to be named."""
STRONG = 60.0
"""Misfit, in squares of the noise, that a named explanation takes away. An effect at twice the size
that these data detect takes away about 120; an unknown effect that merely resembles it, less."""
RARE = 0.01
"""Noise alone may make a claim once in a hundred recordings."""
LISTED = 0.02
"""Explanations below this share of the probability are not listed."""
MEMBER = 0.95
"""Share within its family that one effect needs to be told apart from the others."""


_Key = TypeVar("_Key")


class Verdict(StrEnum):
    """The words of the contract."""

    COMPLETE = "complete"
    MISSING = "missing"
    AMBIGUOUS = "ambiguous"
    UNEXPLAINED = "unexplained"
    DISTURBED = "disturbed"
    INSUFFICIENT = "insufficient"


@dataclass(frozen=True)
class Opinion:
    """What is to be said of a misfit.

    Attributes:
        verdict: the word.
        families: the families named, sorted; empty without a name.
        terms: for each of them its members by probability, the likeliest first.
        explanations: sets of terms that each leave only noise, best first.
        holds: indices of disturbed holds or rotations.
        p: chance that noise alone makes anything look as good.
        noise: the noise in units of what was measured within the holds.
    """

    verdict: Verdict
    families: tuple[str, ...]
    terms: tuple[tuple[str, ...], ...]
    explanations: tuple[tuple[str, ...], ...]
    holds: tuple[int, ...]
    p: float
    noise: float


def judge(misfit: Misfit, jury: Jury, p: float) -> Opinion:
    """Weigh all explanations of a misfit.

    Args:
        misfit: what is left.
        jury: the explanations of this design.
        p: chance that noise alone makes any suspect look as good as the best one here.
    """
    posterior = jury.posterior(misfit.residual)
    best = int(np.argmax(posterior))
    noise = jury.sigma(misfit.residual, best)
    present = _present(jury, posterior)
    explanations = _explanations(jury, posterior)
    if p > RARE or max(present[NOTHING], present[WANDER]) > 1.0 - NAMED:
        return Opinion(Verdict.COMPLETE, (), (), explanations, (), p, noise)
    if present[DISTURBED] > NAMED:
        holds = _disturbed(jury, posterior)
        return Opinion(Verdict.DISTURBED, (), (), explanations, holds, p, noise)
    named = tuple(
        sorted(
            family
            for family, share in present.items()
            if share > NAMED and family not in (NOTHING, WANDER, DISTURBED, UNKNOWN)
        )
    )
    if named and _taken_away(misfit, jury, posterior, named) >= STRONG:
        terms = tuple(_within(jury, posterior, family) for family in named)
        sure = all(len(members) == 1 for members in terms)
        verdict = Verdict.MISSING if sure else Verdict.AMBIGUOUS
        return Opinion(verdict, named, terms, explanations, (), p, noise)
    if present[UNKNOWN] < 1.0 - NAMED and _strongest(misfit, jury, posterior) >= STRONG:
        return Opinion(Verdict.AMBIGUOUS, (), (), explanations, (), p, noise)
    return Opinion(Verdict.UNEXPLAINED, (), (), explanations, (), p, noise)


def _sorted(shares: dict[_Key, float]) -> list[tuple[_Key, float]]:
    return sorted(shares.items(), key=lambda item: -item[1])


def _present(jury: Jury, posterior: FloatArray) -> dict[str, float]:
    """Probability that each family takes part; kinds without terms under their own names."""
    present: dict[str, float] = defaultdict(float)
    for hypothesis, share in zip(jury.hypotheses, posterior, strict=True):
        for family in hypothesis.families or (hypothesis.kind,):
            present[family] += float(share)
    return present


def _explanations(jury: Jury, posterior: FloatArray) -> tuple[tuple[str, ...], ...]:
    """Sets of terms by their probability, those that are not listed left out."""
    shares: dict[tuple[str, ...], float] = defaultdict(float)
    for hypothesis, share in zip(jury.hypotheses, posterior, strict=True):
        if hypothesis.terms:
            shares[tuple(sorted(hypothesis.terms))] += float(share)
    return tuple(terms for terms, share in _sorted(shares) if share > LISTED)


def _within(jury: Jury, posterior: FloatArray, family: str) -> tuple[str, ...]:
    """Members of a family by probability, until one has nearly all of it."""
    shares: dict[str, float] = defaultdict(float)
    for hypothesis, share in zip(jury.hypotheses, posterior, strict=True):
        if family in hypothesis.families:
            for term in hypothesis.terms:
                if len(hypothesis.terms) == 1 or _belongs(jury, term, family):
                    shares[term] += float(share)
    total = sum(shares.values())
    order = [term for term, share in _sorted(shares) if share > LISTED * total]
    return tuple(order[:1] if shares[order[0]] > MEMBER * total else order)


def _belongs(jury: Jury, term: str, family: str) -> bool:
    return any(h.terms == (term,) and h.families == (family,) for h in jury.hypotheses)


def _disturbed(jury: Jury, posterior: FloatArray) -> tuple[int, ...]:
    """The hold or rotation that is accused."""
    shares: dict[int, float] = defaultdict(float)
    for hypothesis, share in zip(jury.hypotheses, posterior, strict=True):
        if hypothesis.kind == DISTURBED and hypothesis.which[0] is not None:
            shares[int(hypothesis.which[0])] += float(share)
    return tuple(hold for hold, _ in _sorted(shares)[:1])


def _taken_away(
    misfit: Misfit, jury: Jury, posterior: FloatArray, families: tuple[str, ...]
) -> float:
    """Squares of the noise that the likeliest explanation with these families takes away."""
    places = [i for i, h in enumerate(jury.hypotheses) if set(families) <= set(h.families)]
    if not places:
        return 0.0
    return _explained(misfit, jury, max(places, key=lambda place: posterior[place]))


def _strongest(misfit: Misfit, jury: Jury, posterior: FloatArray) -> float:
    """The same for the likeliest explanation by effects."""
    places = [i for i, h in enumerate(jury.hypotheses) if h.terms]
    if not places:
        return 0.0
    return _explained(misfit, jury, max(places, key=lambda place: posterior[place]))


def _explained(misfit: Misfit, jury: Jury, place: int) -> float:
    hypothesis = jury.hypotheses[place]
    noise = jury.sigma(misfit.residual, place)
    projected = hypothesis.basis.T @ (jury.across.T @ misfit.residual)
    return float((projected**2).sum() / noise**2)
