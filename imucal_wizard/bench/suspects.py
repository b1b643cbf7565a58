"""The suspects: every effect of the catalogue against what is left, and the honest odds.

The odds of a suspect are its marginal likelihood against "nothing but noise". How large such odds
become by chance, for the best of all suspects, is simulated on this very design; the p-value of a
suspect is the share of these simulations that beat it.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.bench.evidence import Jury
from imucal_wizard.bench.hypotheses import DISTURBED, NOTHING, Hypothesis
from imucal_wizard.bench.misfit import Candidate, Misfit
from imucal_wizard.bench.trial import Trial, try_effect
from imucal_wizard.readings import FloatArray

SIMULATIONS = 400
"""Enough for a threshold at one per cent: four of them lie beyond it."""
ALIKE = 0.9
"""Correlation of two effects' visible patterns above which they look the same here."""
POWER = 1.645
"""Standard deviations beyond the threshold at which an effect is seen 95 times in 100."""


@dataclass(frozen=True, eq=False)
class Suspect:
    """One effect against what is left.

    Attributes:
        term: name of the effect, or ``disturbed``.
        candidate: the variant that explains most; None for a disturbed hold.
        log_odds: logarithm of its marginal likelihood against nothing.
        p: share of simulations of noise alone in which any suspect reaches these odds.
        trial: what adding it would do; None for a disturbed hold.
        detectable: smallest size that these data would show, shown unit; infinite when blind.
        like: terms that look the same here.
        hold: index of the hold accused, for a disturbed one.
    """

    term: str
    candidate: Candidate | None
    log_odds: float
    p: float
    trial: Trial | None
    detectable: float
    like: tuple[str, ...]
    hold: int | None = None


def rank(misfit: Misfit, jury: Jury, chance: FloatArray | None = None) -> tuple[Suspect, ...]:
    """All suspects, the likeliest first.

    Args:
        misfit: what is left.
        jury: the explanations of this design.
        chance: what ``best_by_chance`` gave for this design, when it is known already.
    """
    evidence = jury.log_evidence(misfit.residual)
    nothing = _first(jury, NOTHING)
    noise = jury.sigma(misfit.residual, int(np.argmax(evidence + jury.log_prior)))
    members = _members(jury)
    chance = best_by_chance(jury) if chance is None else chance
    threshold = float(np.quantile(chance, 0.99))
    found = []
    for term, places in members.items():
        odds = _log_odds(evidence, jury, places, nothing)
        p = (1.0 + float((chance >= odds).sum())) / (1.0 + len(chance))
        best = jury.hypotheses[max(places, key=lambda place: evidence[place])]
        if term == DISTURBED:
            hold = None if best.which[0] is None else int(best.which[0])
            found.append(Suspect(term, None, odds, p, None, np.inf, (), hold))
            continue
        candidate = _candidate(misfit, best)
        found.append(
            Suspect(
                term,
                candidate,
                odds,
                p,
                try_effect(misfit, (candidate,), noise),
                _detectable(jury, candidate, threshold, noise),
                _alike(jury, misfit, candidate),
            )
        )
    return tuple(sorted(found, key=lambda suspect: -suspect.log_odds))


def _first(jury: Jury, kind: str) -> int:
    return next(i for i, h in enumerate(jury.hypotheses) if h.kind == kind)


def _members(jury: Jury) -> dict[str, list[int]]:
    """Places of the single-effect explanations of each term, and of disturbed holds."""
    members: dict[str, list[int]] = {}
    for place, hypothesis in enumerate(jury.hypotheses):
        if hypothesis.kind == "effect":
            members.setdefault(hypothesis.terms[0], []).append(place)
        elif hypothesis.kind == DISTURBED:
            members.setdefault(DISTURBED, []).append(place)
    return members


def _log_odds(evidence: FloatArray, jury: Jury, places: list[int], nothing: int) -> float:
    """Marginal likelihood of a term over its variants and axes, against nothing."""
    weights = jury.log_prior[places]
    share = weights - np.logaddexp.reduce(weights)
    return float(np.logaddexp.reduce(evidence[places] + share) - evidence[nothing])


def best_by_chance(jury: Jury, seed: int = 0) -> FloatArray:
    """The best odds of any term in simulations of noise alone on this design, shape (simulations,).

    Args:
        jury: the explanations of this design.
        seed: of the simulation.
    """
    members, nothing = _members(jury), _first(jury, NOTHING)
    rng = np.random.default_rng(seed)
    places = [place for own in members.values() for place in own]
    single = Jury(jury.across, [jury.hypotheses[place] for place in (nothing, *places)])
    evidence = single.log_evidences(rng.standard_normal((SIMULATIONS, len(jury.across))))
    best = np.full(SIMULATIONS, -np.inf)
    first = 1
    for own in members.values():
        rows = slice(first, first + len(own))
        first += len(own)
        share = single.log_prior[rows] - np.logaddexp.reduce(single.log_prior[rows])
        odds = np.logaddexp.reduce(evidence[:, rows] + share, axis=1) - evidence[:, 0]
        best = np.maximum(best, odds)
    return best


def _candidate(misfit: Misfit, hypothesis: Hypothesis) -> Candidate:
    return next(
        c
        for c in misfit.candidates
        if c.term == hypothesis.terms[0] and c.variant == hypothesis.which[0]
    )


def _detectable(jury: Jury, candidate: Candidate, threshold: float, noise: float) -> float:
    """Size on one axis that clears the threshold 95 times in 100, worst axis that is visible.

    One pattern of strength λ has log odds ``½ z² λ/(λ + 1) − ½ log(1 + λ)``, less its share of the
    term's prior; solved for z.
    """
    patterns = np.linalg.norm(jury.across.T @ candidate.columns, axis=0)
    whole = np.linalg.norm(candidate.columns, axis=0)
    visible = patterns > 0.02 * np.maximum(whole, 1e-300)
    if not visible.any():
        return float(np.inf)
    strength = (patterns[visible] * candidate.typical[visible]) ** 2
    needed = max(threshold, 0.0) + np.log(4.0 * len(patterns)) + 0.5 * np.log1p(strength)
    z = np.sqrt(2.0 * needed * (1.0 + 1.0 / strength)) + POWER
    return float((z * noise / patterns[visible]).max())


def _alike(jury: Jury, misfit: Misfit, candidate: Candidate) -> tuple[str, ...]:
    """Other terms one of whose patterns is nearly one of this effect's."""
    own = _unit(jury.across.T @ candidate.columns)
    alike = []
    for other in misfit.candidates:
        if other.term != candidate.term and other.term not in alike:
            theirs = _unit(jury.across.T @ other.columns)
            if own.size and theirs.size and float(np.abs(own.T @ theirs).max()) > ALIKE:
                alike.append(other.term)
    return tuple(alike)


def _unit(patterns: FloatArray) -> FloatArray:
    length = np.linalg.norm(patterns, axis=0)
    seen = length > 1e-6 * max(float(length.max(initial=0.0)), 1e-300)
    return np.asarray(patterns[:, seen] / length[seen])
