"""What the evidence carries, in one word: and it is as ready to say "cannot tell" as to name.

Every explanation has a probability. A family of effects (effects that 1 g cannot split) is named
when the explanations that contain it hold most of the probability, when it takes away more of the
misfit than chance or an unknown effect's shadow does, and when noise alone does not make such a
misfit more than once in a hundred designs.
"""

from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from imucal_wizard.bench.evidence import Jury, Weighed
from imucal_wizard.bench.hypotheses import DISTURBED, NOTHING, UNKNOWN
from imucal_wizard.bench.labels import Shares, Terms, ordered, shares_of
from imucal_wizard.bench.misfit import Misfit, RowKind
from imucal_wizard.bench.pairs import BENT
from imucal_wizard.bench.rivals import own_share
from imucal_wizard.bench.strength import Best

NAMED = 0.75
"""Share of the probability that explanations with a family must hold for it to be named."""
STRONG = 90.0
"""Misfit, in squares of the noise, that a named family takes away beside all others. An effect at
twice the size that these data detect takes away about 140; an unknown effect that merely resembles
it, less."""
CLEAR = 30.0
"""What would be seen of another characteristic than a bent one, in the same squares, for a bent one
to be named: as strong as it must be for that, but not stronger than ``OVERWHELMING``."""
OVERWHELMING = 500.0
"""A bent characteristic as strong as this is named on any poses: a rippled one so large is rare."""
HEAVY = 36.0
"""The same for a disturbed hold."""
STRANGE = 0.1
"""Probability of unknown structure above which nothing is named. Even on corners and repeats
some rippled characteristics are bent ones within the noise."""
NOISE = 0.1
"""Probability of noise alone above which nothing is claimed."""
LOUD = 3.0
"""Noise, in units of that within the holds, that is believed only when poses were repeated."""
REMAINS = 0.3
"""Share of a magnetometer's misfit, rms, that may be left by all effects together: effects so large
that they are not linear leave some."""
REPEATS = 6
"""Repeats that show how large the noise is."""
LISTED = 0.02
"""Explanations below this share of the probability are not listed."""
MEMBER = 0.95
"""Share within its family that one effect needs to be told apart from the others."""


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
        wandering: probability that the bias wanders between holds, which is noise and no drift.
    """

    verdict: Verdict
    families: tuple[str, ...]
    terms: tuple[Terms, ...]
    explanations: tuple[Terms, ...]
    holds: tuple[int, ...]
    p: float
    noise: float
    wandering: float


def judge(misfit: Misfit, jury: Jury, weighed: Weighed, p: float) -> Opinion:
    """Weigh all explanations of a misfit.

    Args:
        misfit: what is left.
        jury: the explanations of this design.
        weighed: their probabilities.
        p: chance that noise alone makes any suspect look as good as the best one here.
    """
    shares = shares_of(jury, weighed)
    best = Best(misfit, jury, weighed)
    own = own_share(misfit, jury.frame)
    verdict, families = decide(evidence_of(misfit, shares, best, own))
    if {*families} - {DISTURBED} and beyond_all_effects(misfit, best):
        verdict, families = Verdict.UNEXPLAINED, ()
    holds: tuple[int, ...] = ()
    if DISTURBED in families:
        families = tuple(one for one in families if one != DISTURBED)
        holds = tuple(hold for hold, _ in ordered(shares.by_hold)[:1])
    family_of = {candidate.term: candidate.family for candidate in misfit.candidates}
    terms = tuple(_within(shares, family_of, family) for family in families)
    if families and verdict is Verdict.MISSING and any(len(members) > 1 for members in terms):
        verdict = Verdict.AMBIGUOUS
    listed = shares.explanations(LISTED)
    noise, wandering = best.noise, weighed.wandering
    return Opinion(verdict, families, terms, listed, holds, p, noise, wandering)


def beyond_all_effects(misfit: Misfit, best: Best) -> bool:
    """Whether a magnetometer's misfit is not that of its effects, were there all of them at once.

    The field of a room is many times the noise, and some effect takes away a little of it. The
    other sensors have no such surroundings.
    """
    if not (misfit.kind >= RowKind.FIELD).any():
        return False
    return best.left_by_all > max(LOUD, REMAINS * best.left)


@dataclass(frozen=True)
class Evidence:
    """What the decision is made from.

    Attributes:
        present: probability that each family takes part.
        taken: squares of the noise that each likely family takes away beside the others.
        strongest: the same for the likeliest effects together.
        noise: in units of that within the holds.
        repeats: visits to a direction beyond the first: they show how large the noise is.
        own_share: of another characteristic, that no bent one imitates (see ``rivals``).
    """

    present: dict[str, float]
    taken: dict[str, float]
    strongest: float
    noise: float
    repeats: int
    own_share: float


def evidence_of(misfit: Misfit, shares: Shares, best: Best, own: float) -> Evidence:
    """Everything that the decision is made from."""
    present = shares.present()
    likely = sorted(set(present) - {NOTHING, UNKNOWN})
    taken = best.taken_away(tuple(one for one in likely if present[one] > 0.5))
    if (misfit.kind >= RowKind.FIELD).any():
        # a direction of the field that comes again comes from another place of the room, and a
        # field that wanders is the room's: neither shows how large the sensor's noise is
        return Evidence(present, taken, best.strongest(), max(best.noise, best.left), 0, own)
    rest = misfit.visit >= 0
    repeats = len(np.unique(misfit.visit[rest])) - len(np.unique(misfit.group[rest]))
    return Evidence(present, taken, best.strongest(), best.noise, repeats, own)


def decide(evidence: Evidence) -> tuple[Verdict, tuple[str, ...]]:
    """The verdict, and the families named; a disturbed hold counts as one."""
    present, taken = evidence.present, evidence.taken
    if present[NOTHING] > NOISE:
        loud = evidence.noise > LOUD and evidence.repeats < REPEATS
        return (Verdict.UNEXPLAINED if loud else Verdict.COMPLETE), ()
    named = tuple(
        family
        for family, squares in taken.items()
        if present[family] > NAMED and squares > needed(family, evidence.own_share)
    )
    if present.get(UNKNOWN, 0.0) > STRANGE:
        return Verdict.UNEXPLAINED, ()
    if named:
        return (Verdict.DISTURBED if named == (DISTURBED,) else Verdict.MISSING), named
    if evidence.strongest > STRONG:
        return Verdict.AMBIGUOUS, ()
    return Verdict.UNEXPLAINED, ()


def needed(family: str, own_share: float) -> float:
    """Squares of the noise that a family must take away to be named."""
    if family == DISTURBED:
        return HEAVY
    if family not in BENT:
        return STRONG
    return float(np.clip(CLEAR / max(own_share, 1e-9), STRONG, OVERWHELMING))


def _within(shares: Shares, family_of: dict[str, str], family: str) -> Terms:
    """Members of a family by probability, until one has nearly all of it."""
    members = shares.members(family_of, family)
    if members[0][1] > MEMBER:
        return (members[0][0],)
    return tuple(term for term, share in members if share > LISTED)
