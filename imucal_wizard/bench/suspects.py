"""The suspects: every effect of the catalogue against what is left, and the honest odds."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.bench.chance import Chances, log_odds, members
from imucal_wizard.bench.detectable import BLIND, detectable
from imucal_wizard.bench.evidence import Jury, Weighed
from imucal_wizard.bench.hypotheses import DISTURBED, Hypothesis
from imucal_wizard.bench.misfit import Candidate, Misfit
from imucal_wizard.bench.trial import Trial, try_effect
from imucal_wizard.readings import FloatArray

ALIKE = 0.9
"""Correlation of two effects' visible patterns above which they look the same here."""


@dataclass(frozen=True, eq=False)
class Suspect:
    """One effect against what is left.

    Attributes:
        term: name of the effect, or ``disturbed``.
        candidate: the variant that explains most; None for a disturbed hold.
        log_odds: logarithm of its marginal likelihood against noise alone.
        p: share of simulations of noise alone in which any suspect reaches these odds.
        trial: what adding it would do; None for a disturbed hold.
        detectable: smallest size of each parameter alone that these data would show, shown unit;
            infinite where they are blind, shape (p,); empty for a disturbed hold.
        like: terms that look the same here.
        hold: index of the hold accused, for a disturbed one.
    """

    term: str
    candidate: Candidate | None
    log_odds: float
    p: float
    trial: Trial | None
    detectable: FloatArray
    like: tuple[str, ...]
    hold: int | None = None


def rank(
    misfit: Misfit, jury: Jury, weighed: Weighed, chances: Chances | None = None
) -> tuple[Suspect, ...]:
    """All suspects, the likeliest first.

    Args:
        misfit: what is left.
        jury: the explanations of this design.
        weighed: their probabilities.
        chances: simulations of this design, when some were made already.
    """
    chances = Chances(jury) if chances is None else chances
    threshold = chances.threshold(weighed.noise)
    noise = noise_of(weighed)
    walk = jury.frame.walked(weighed.wander)
    alike = _alike(misfit, jury)
    found = []
    for term, places in members(jury).items():
        odds = float(log_odds(weighed.evidence, jury, places))
        p = chances.p(odds, weighed.noise)
        best = jury.hypotheses[max(places, key=lambda place: weighed.evidence[place])]
        if term == DISTURBED:
            hold = None if best.variant is None else int(best.variant)
            found.append(Suspect(term, None, odds, p, None, np.zeros(0), (), hold))
            continue
        candidate = _candidate(misfit, best)
        found.append(
            Suspect(
                term,
                candidate,
                odds,
                p,
                try_effect(misfit, (candidate,), noise, walk),
                detectable(jury, candidate, threshold, noise, weighed.wander),
                alike[term],
            )
        )
    return tuple(sorted(found, key=lambda suspect: -suspect.log_odds))


def noise_of(weighed: Weighed) -> float:
    """Expected noise over all explanations."""
    return float(weighed.single @ weighed.sigma + weighed.paired @ weighed.sigma_paired)


def _candidate(misfit: Misfit, hypothesis: Hypothesis) -> Candidate:
    return next(
        c
        for c in misfit.candidates
        if c.term == hypothesis.terms[0] and c.variant == hypothesis.variant
    )


def _alike(misfit: Misfit, jury: Jury) -> dict[str, tuple[str, ...]]:
    """Terms one of whose visible patterns is nearly one of this term's, for every term."""
    terms = list(dict.fromkeys(one.term for one in misfit.candidates))
    if not terms:
        return {}
    number = np.concatenate(
        [np.full(len(one.names), terms.index(one.term)) for one in misfit.candidates]
    )
    patterns = jury.frame.across.T @ np.concatenate([c.columns for c in misfit.candidates], axis=1)
    whole = np.concatenate([np.linalg.norm(c.columns, axis=0) for c in misfit.candidates])
    length = np.linalg.norm(patterns, axis=0)
    seen = length > BLIND * np.maximum(whole, 1e-300)
    unit, number = patterns[:, seen] / length[seen], number[seen]
    near = np.argwhere(np.abs(unit.T @ unit) > ALIKE)
    found = np.zeros((len(terms), len(terms)), np.bool_)
    found[number[near[:, 0]], number[near[:, 1]]] = True
    np.fill_diagonal(found, False)
    return {
        a: tuple(b for b, same in zip(terms, row, strict=True) if same)
        for a, row in zip(terms, found, strict=True)
    }
