"""The verdict on a misfit, in one word, from the probabilities of its explanations.

Every explanation has a probability; explanations that say the same are added up. A family of
effects (effects that 1 g cannot split) is named when the explanations that contain it hold most of
the probability, and when it takes away more of the misfit than an unknown effect that resembles it
would.
"""

import itertools
from collections import defaultdict
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from enum import StrEnum
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.explained_variance import (
    ExplainedVariance,
    discriminability,
    span_of,
)
from imucal_wizard.diagnose.hypotheses import (
    BENT,
    DISTURBED,
    EFFECT,
    NOTHING,
    PAIR,
    UNKNOWN,
    Hypothesis,
)
from imucal_wizard.diagnose.posterior import MAX_NOISE_PROBABILITY, HypothesisSet, Posterior
from imucal_wizard.diagnose.random_walk import wandering
from imucal_wizard.diagnose.referee import Hearing
from imucal_wizard.diagnose.residuals import RowKind, WhitenedResiduals
from imucal_wizard.estimate.lack_of_fit import TEST_LEVEL, LackOfFit

Terms = tuple[str, ...]
_Key = TypeVar("_Key")


@dataclass(frozen=True)
class Label:
    """What an explanation says.

    Attributes:
        kind: of the explanation.
        terms: its effects, sorted.
        families: its families, sorted.
    """

    kind: str
    terms: Terms
    families: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Shares:
    """Probability by label, and what is asked of it.

    Attributes:
        by_label: probability of each label.
        by_hold: probability that a hold or rotation is disturbed, by ``ResidualTable.item``.
    """

    by_label: dict[Label, float]
    by_hold: dict[int, float]

    def present(self) -> dict[str, float]:
        """Probability that each family takes part; kinds without any under their own names."""
        found: dict[str, float] = defaultdict(float)
        for label, share in self.by_label.items():
            for family in set(label.families) or {label.kind}:
                found[family] += share
        return found

    def explanations(self, least: float) -> tuple[Terms, ...]:
        """Sets of effects by their probability, best first."""
        found: dict[Terms, float] = defaultdict(float)
        for label, share in self.by_label.items():
            if label.terms:
                found[label.terms] += share
        return tuple(terms for terms, share in ordered(found) if share > least)

    def members(self, family_of: dict[str, str], family: str) -> list[tuple[str, float]]:
        """Effects of a family, each with its share of where it acts alone in it, best first."""
        found: dict[str, float] = defaultdict(float)
        for label, share in self.by_label.items():
            for term in label.terms if label.families.count(family) == 1 else ():
                if family_of[term] == family:
                    found[term] += share
        total = sum(found.values())
        return [(term, share / total) for term, share in ordered(found)] if total else []

    def together(self, family_of: dict[str, str], family: str) -> dict[Terms, float]:
        """Two effects of a family at once, by their share of the family's probability."""
        found: dict[Terms, float] = defaultdict(float)
        for label, share in self.by_label.items():
            if label.families.count(family) > 1:
                found[tuple(one for one in label.terms if family_of[one] == family)] += share
        present = self.present()[family]
        return {terms: share / present for terms, share in ordered(found)}

    def heard(self, by_terms: Mapping[Terms, float], present: float) -> "Shares":
        """The shares after other data have spoken for and against some explanations.

        These data decide between explanations; whether there is one at all stays as it is. What has
        no name may be whatever the best of them is: it loses nothing.

        Args:
            by_terms: logarithm of the evidence for each set of effects.
            present: the same for the present model.
        """
        unknown = [label for label in self.by_label if label.kind == UNKNOWN]
        spoken = {one: by_terms[one.terms] for one in self.by_label if one.terms in by_terms}
        best = max(present, *spoken.values())
        factor = {
            one: float(np.exp(max(value - best, LEAST_LOG_EVIDENCE)))
            for one, value in spoken.items()
        }
        factor |= dict.fromkeys(unknown, 1.0)
        before = sum(self.by_label[one] for one in factor)
        after = sum(self.by_label[one] * by for one, by in factor.items())
        scale = before / after if after > 0.0 else 0.0
        changed = {one: self.by_label[one] * by * scale for one, by in factor.items()}
        return Shares({**self.by_label, **changed}, self.by_hold)


def ordered(shares: Mapping[_Key, float]) -> list[tuple[_Key, float]]:
    """Items, the largest share first."""
    return sorted(shares.items(), key=lambda item: -item[1])


def _shares_of(hypotheses: HypothesisSet, posterior: Posterior) -> Shares:
    """Probability by label."""
    by_label: dict[Label, float] = defaultdict(float)
    by_hold: dict[int, float] = defaultdict(float)
    for one, share in zip(hypotheses.single, posterior.single, strict=True):
        by_label[_label(one)] += float(share)
        for member in one.members or (one,):
            if member.kind == DISTURBED and member.variant is not None:
                by_hold[int(member.variant)] += float(share)
    _add_pairs(hypotheses, posterior, by_label, by_hold)
    return Shares(dict(by_label), dict(by_hold))


def _label(one: Hypothesis) -> Label:
    return Label(one.kind, one.terms, one.families)


def _add_pairs(
    hypotheses: HypothesisSet,
    posterior: Posterior,
    by_label: dict[Label, float],
    by_hold: dict[int, float],
) -> None:
    pairs = hypotheses.pairs
    if pairs is None:
        return
    labels = [_label(one) for one in pairs.members]
    distinct = sorted(set(labels), key=lambda label: (label.families, label.terms))
    known = {label: k for k, label in enumerate(distinct)}
    number: NDArray[np.intp] = np.array([known[label] for label in labels])
    size = len(distinct)
    table = np.zeros((size, size))
    np.add.at(table, (number[pairs.first], number[pairs.second]), posterior.paired)
    for i, j in zip(*np.nonzero(table), strict=True):
        a, b = distinct[i], distinct[j]
        both = Label(
            PAIR,
            tuple(sorted((*a.terms, *b.terms))),
            tuple(sorted((*a.families, *b.families))),
        )
        by_label[both] += float(table[i, j])
    held = np.array([one.variant if one.kind == DISTURBED else -1.0 for one in pairs.members])
    for places in (pairs.first, pairs.second):
        totals = np.zeros(len(held))
        np.add.at(totals, places, posterior.paired)
        for place in np.flatnonzero(held >= 0.0):
            by_hold[int(held[place])] += float(totals[place])


LEAST_LOG_EVIDENCE = -500.0
"""Of an explanation over the best one; with less it would have no probability at all, and a family
whose members all have so little would have none."""
MIN_FAMILY_PROBABILITY = 0.75
"""Share of the probability that explanations with a family must hold for it to be named. A choice:
larger, and there are fewer wrong names and more verdicts without any; smaller, the other way
round (`python -m benchmarks.wrong_names` counts both)."""
MIN_MISFIT_TAKEN = 90.0
"""Squares of the noise that a named family takes away beside all others. An effect twice as large
as these data detect takes away about 140; an unknown effect that merely resembles it, less."""
MIN_MISFIT_OF_RIPPLES = 30.0
"""What would be seen of another characteristic than a bent one, in the same squares, for a bent one
to be named: as strong as it must be for that, but not stronger than ``MAX_MISFIT_NEEDED``."""
MAX_MISFIT_NEEDED = 500.0
"""A bent characteristic as strong as this is named on any poses: a rippled one so large is rare."""
MIN_MISFIT_DISTURBED = 36.0
"""The same for a disturbed hold."""
MAX_UNKNOWN_PROBABILITY = 0.1
"""Probability of unknown structure above which nothing is named. Even on corners and repeats
some rippled characteristics are bent ones within the noise."""
MIN_LEFT_OF_FIELD = 3.0
"""What all effects together leave of a magnetometer's misfit, rms in units of the noise, below
which the room is no better explanation."""
MAX_SHARE_LEFT = 0.3
"""Share of a magnetometer's misfit, rms, that may be left by all effects together: effects so large
that they are not linear leave some."""
MIN_LISTED_PROBABILITY = 0.02
"""Explanations below this share of the probability are not listed. A choice: smaller, and lists are
longer by what is hardly possible; larger, and the right explanation is left out more often."""
MIN_MEMBER_PROBABILITY = 0.95
"""Share within its family that one effect needs to be named instead of the family."""


MIN_ACCUSED = 0.5
"""Probability from which on a hold is among those called disturbed."""
MIN_UNKNOWN_LEFT = 0.5
"""Probability of unknown structure in what a name leaves, from which on the name is not given."""
MIN_EXPLAINED_LEFT = 0.9
"""Probability of the effects of the catalogue in what a name leaves, below which the name is not
given if directions differ by more than visits: something that has no name is left there."""
MIN_SHARE_OF_UNKNOWN = 0.01
"""The least of that structure, as a share of the squares that the name takes away: scales and
biases that are wrong by 5 % leave so much of an effect that is quadratic in the input."""
MAX_SHARE_LEFT_BY_NAME = 0.03
"""What is left, as a share of what was taken away, below which a name stands although more than
noise is left: the two effects of the catalogue that are most alike without being aliases leave that
much of each other (1 − 0.986²). More of it, and something else was given the name of what it
resembles."""
MAX_SHARE_LEFT_BY_PROBABLE = 0.1
"""The same below which what has no name for certain is probably this effect: the rest may be
another, smaller error of the sensor. A choice, about three times that of a name: larger, and more
is called probable that only resembles the cause. Holds are called disturbed beside slow noise that
the repeats show if it is no more than this share: larger, and holds are accused of an error that
is in all of them."""
MAX_HEARD = 6
"""Explanations of which another sensor is asked, the likeliest first: each costs a fit."""
MIN_PROBABLE = 0.5
"""Probability from which on an effect that is not certain enough to be named is called probable."""


class Verdict(StrEnum):
    """The words of the contract."""

    COMPLETE = "complete"
    MISSING = "missing"
    AMBIGUOUS = "ambiguous"
    UNEXPLAINED = "unexplained"
    NOT_REPEATABLE = "not-repeatable"
    DISTURBED = "disturbed"
    INSUFFICIENT = "insufficient"
    WAITING = "waiting"


@dataclass(frozen=True)
class Names:
    """What is named of a misfit.

    Attributes:
        families: the families named, sorted; empty without a name. One of which two effects act
            is there twice.
        terms: for each of them its members by probability, the likeliest first.
        together: two effects of one family that may act where one of it is named.
    """

    families: tuple[str, ...]
    terms: tuple[Terms, ...]
    together: tuple[Terms, ...]

    @property
    def twice(self) -> bool:
        """Whether two effects of one family are named."""
        return len({*self.families}) < len(self.families)

    @property
    def open(self) -> bool:
        """Whether it stays open which effects these are."""
        return bool(self.together) or any(len(members) > 1 for members in self.terms)


@dataclass(frozen=True)
class Opinion(Names):
    """What is to be said of a misfit.

    Attributes:
        verdict: the word.
        explanations: sets of terms that each leave only noise, best first.
        holds: disturbed holds or rotations, see ``ResidualTable.item``.
        noise: the noise in units of what was measured within the holds.
        wandering: probability that what is left follows the time as a wandering bias does, which
            is noise and no drift; asked where poses do not repeat, else 0.
        lack: whether measured noise makes what is left.
        shapeless: what is left has no shape: noise alone, however large, explains it.
        probable: members of the families named, or of the likeliest one that is not certain enough
            to be named, the likeliest first; empty where none is likelier than everything else, or
            much is left beside it.
        heard: what the gyroscope says of the explanations, where it was asked.
        shares: of the probability of each family among whose members it has decided, by its
            likeliest member.
    """

    verdict: Verdict
    explanations: tuple[Terms, ...]
    holds: tuple[int, ...]
    noise: float
    wandering: float
    lack: LackOfFit
    shapeless: bool
    probable: Terms
    heard: Hearing | None = None
    shares: Mapping[str, float] = field(default_factory=dict)

    @property
    def decided(self) -> tuple[str, ...]:
        """The families named among whose members the gyroscope has decided.

        A name that is withdrawn takes this with it. Two effects of a family leave no choice.
        """
        named = self.families
        return tuple(one for one in named if one in self.shares and named.count(one) == 1)

    @property
    def one_effect(self) -> bool:
        """Whether one effect and noise are all that is left, and no other explanation holds."""
        return self.verdict is Verdict.MISSING and len(self.families) == 1

    @property
    def refuted(self) -> bool:
        """Whether the gyroscope speaks against every explanation it was asked of."""
        return self.heard is not None and self.heard.against_all

    def closures(self, terms: Terms) -> tuple[float, float] | None:
        """The gyroscope's error held out without and with these effects, rad, where it is known."""
        one = None if self.heard is None else self.heard.with_terms.get(terms)
        if self.heard is None or one is None or one.closure is None:
            return None
        return None if self.heard.now.closure is None else (self.heard.now.closure, one.closure)


def judge_misfit(
    misfit: WhitenedResiduals,
    hypotheses: HypothesisSet,
    posterior: Posterior,
    hearing: Callable[[tuple[Terms, ...]], Hearing | None] | None = None,
    lack: LackOfFit | None = None,
) -> Opinion:
    """Weigh all explanations of a misfit.

    Args:
        misfit: what is left.
        hypotheses: the explanations of this design.
        posterior: their probabilities.
        hearing: what another sensor says of explanations, where there is one.
        lack: whether measured noise makes what the present model leaves, where the misfit was made
            linear at another one.
    """
    lack = lack or misfit.lack_of_fit()
    weighed = _weigh(misfit, hypotheses, posterior, hearing)
    own = discriminability(misfit, hypotheses.frame)
    evidence = _evidence_of(weighed.shares, weighed.best, own, lack)
    verdict, families, holds = _decide(misfit, hypotheses, weighed, evidence)
    names = weighed.names(families)
    if verdict is Verdict.MISSING and names.families and names.open:
        verdict = Verdict.AMBIGUOUS
    listed = weighed.listed(verdict, names)
    open_ = verdict is Verdict.AMBIGUOUS and not (names.together or names.twice)
    if open_ and not _several_hold(listed, names.families, weighed.best, lack):
        verdict = nameless(lack)
    walks = 0.0
    if lack.not_repeatable:
        walks = wandering(misfit, hypotheses.frame, weighed.best.coordinates)
    return Opinion(
        verdict=verdict,
        families=names.families,
        terms=names.terms,
        explanations=listed,
        holds=holds,
        noise=weighed.best.noise,
        wandering=walks,
        lack=lack,
        shapeless=evidence.shapeless,
        probable=weighed.probable(names, lack),
        heard=weighed.heard,
        shares=weighed.decided(names),
        together=names.together,
    )


@dataclass(frozen=True, eq=False)
class _Weighed:
    """The probabilities of the explanations, and what is named of them.

    Attributes:
        shares: after the other sensor has spoken, where there is one.
        alone: before it has spoken.
        best: what the likeliest explanations take away.
        family_of: the family of each effect.
        heard: what the other sensor says.
    """

    shares: Shares
    alone: Shares
    best: ExplainedVariance
    family_of: dict[str, str]
    heard: Hearing | None

    def names(self, families: tuple[str, ...]) -> Names:
        """The effects of these families."""
        named = [
            _named(self.shares, self.family_of, family, self.best, self.heard)
            for family in families
        ]
        return Names(
            tuple(one for one, own in zip(families, named, strict=True) for _ in own.members),
            tuple(members for one in named for members in one.members),
            tuple(two for one in named for two in one.together),
        )

    def listed(self, verdict: Verdict, names: Names) -> tuple[Terms, ...]:
        """Sets of effects that may be what is seen, the likeliest first."""
        found = list(self.shares.explanations(MIN_LISTED_PROBABILITY))
        found += [one for one in names.together if one not in found]
        if verdict is Verdict.AMBIGUOUS and names.terms:
            every = (tuple(sorted({*one})) for one in itertools.product(*names.terms))
            apart = dict.fromkeys(one for one in every if len(one) == len(names.terms))
            found += [one for one in apart if one not in found]
        return tuple(found)

    def probable(self, names: Names, lack: LackOfFit) -> Terms:
        """The members of the family named, or of the likeliest one that is not certain enough."""
        likely = [
            item for item in self.shares.present().items() if item[0] in self.family_of.values()
        ]
        first, share = max(likely, key=lambda item: item[1], default=("", 0.0))
        asked = names.families or (first,) * (share > MIN_PROBABLE)
        # two together fit much that is neither of them
        if len(asked) != 1 or (self.heard is not None and self.heard.against_all):
            return ()
        left = self.best.lack_beside(self.best.own_span(asked[0]))
        alone = 1.0 - sum(self.shares.together(self.family_of, asked[0]).values())
        if share_left(lack, left) >= MAX_SHARE_LEFT_BY_PROBABLE or alone <= MIN_PROBABLE:
            return ()
        return names.terms[0] if names.terms else _within(self.shares, self.family_of, first)

    def decided(self, names: Names) -> dict[str, float]:
        """The families among whose members the other sensor has decided.

        Returns:
            Of each of them the share of its probability that its likeliest member has.
        """
        return {
            family: self.shares.members(self.family_of, family)[0][1]
            for family, members in zip(names.families, names.terms, strict=True)
            if self.heard is not None
            and names.families.count(family) == 1
            and len(_within(self.alone, self.family_of, family)) > len(members)
        }


def _weigh(
    misfit: WhitenedResiduals,
    hypotheses: HypothesisSet,
    posterior: Posterior,
    hearing: Callable[[tuple[Terms, ...]], Hearing | None] | None,
) -> _Weighed:
    """The probabilities of the explanations, with what another sensor says of them."""
    alone, best = (
        _shares_of(hypotheses, posterior),
        ExplainedVariance(misfit, hypotheses, posterior),
    )
    shares, heard = alone, None if hearing is None else _heard(hearing, alone, best)
    if heard is not None and not heard.lacks_all:
        by_terms = {terms: one.log_evidence for terms, one in heard.with_terms.items()}
        shares = alone.heard(by_terms, heard.now.log_evidence)
    family_of = {candidate.term: candidate.family for candidate in misfit.candidates}
    return _Weighed(shares, alone, best, family_of, heard)


def _decide(
    misfit: WhitenedResiduals,
    hypotheses: HypothesisSet,
    weighed: _Weighed,
    evidence: "Evidence",
) -> tuple[Verdict, tuple[str, ...], tuple[int, ...]]:
    """The verdict, the families named without a disturbed hold, and the disturbed holds."""
    lack = evidence.lack
    verdict, families = decide_verdict(evidence)
    if {*families} - {DISTURBED} and _beyond_all_effects(misfit, weighed.best):
        verdict, families = Verdict.UNEXPLAINED, ()
    if {*families} - {DISTURBED} and _leaves_structure(hypotheses, weighed.best, families, lack):
        verdict, families = nameless(lack), ()
    holds = _accused(weighed.shares) if DISTURBED in families else ()
    named = tuple(one for one in families if one != DISTURBED)
    if holds:
        holds = _needed_for_agreement(misfit, hypotheses, weighed.best, holds, named)
    if verdict is Verdict.DISTURBED and not holds:
        # where the others do not agree either, there is no reason to accuse one of them
        verdict = nameless(lack)
    return verdict, named, holds


def _needed_for_agreement(
    misfit: WhitenedResiduals,
    hypotheses: HypothesisSet,
    best: ExplainedVariance,
    holds: tuple[int, ...],
    named: tuple[str, ...],
) -> tuple[int, ...]:
    """Those of the likely holds or rotations that must be left out for the others to agree.

    The noise within the holds must make what the others leave beside the families named and how
    far their repeats differ, and be a likely explanation of it. Visits that differ by more excuse
    what is left only where it is little beside what these holds carry: an error in every visit is
    no disturbance of some. None where the others do not agree without all of these.
    """
    across = hypotheses.frame.across
    of_named = [across @ best.own_span(family) for family in named]
    columns = np.column_stack([np.zeros((len(misfit), 0)), *of_named])

    lack = misfit.lack_beside(columns)

    def agree_without(items: tuple[int, ...]) -> bool:
        own = misfit.whitened(np.eye(len(misfit))[:, misfit.table.spoilt(items)])
        inside = span_of(across.T @ np.column_stack([columns, own]))
        beside = hypotheses.beside(best.coordinates, inside, best.largest_wander)
        noise = misfit.lack_without(items, columns)
        if not noise.within_noise or beside[NOTHING] <= MAX_NOISE_PROBABILITY:
            return False
        excused = noise.p < TEST_LEVEL or noise.visits_differ
        return not excused or share_left(lack, noise) <= MAX_SHARE_LEFT_BY_PROBABLE

    if not agree_without(holds):
        return ()
    for one in reversed(holds):
        others = tuple(other for other in holds if other != one)
        if others and agree_without(others):
            holds = others
    return holds


def _heard(
    hearing: Callable[[tuple[Terms, ...]], Hearing | None],
    shares: Shares,
    best: ExplainedVariance,
) -> Hearing | None:
    """What another sensor says of the likely explanations and the aliases of the likeliest one.

    Where it speaks against all of them, it is asked of others, too.
    """
    if shares.present()[NOTHING] > MAX_NOISE_PROBABILITY:
        return None
    asked = shares.explanations(MIN_LISTED_PROBABILITY)[:MAX_HEARD]
    plainest = [one[0] for one in asked[:1] if len(one) == 1]
    alike = [(alias,) for term in plainest for alias in best.aliases(term)]
    found = hearing((*asked, *(one for one in alike if one not in asked)))
    if found is None or not found.unlikely:
        return found
    # of aliases, the prior may leave the right one little
    others = [one for one in shares.explanations(0.0) if one not in found.with_terms]
    more = hearing(tuple(others[:MAX_HEARD]))
    return found if more is None else Hearing(found.now, found.with_terms | more.with_terms)


def _accused(shares: Shares) -> tuple[int, ...]:
    """The holds or rotations that are probably disturbed, at least the likeliest one."""
    by_share = ordered(shares.by_hold)
    found = tuple(hold for hold, share in by_share if share > MIN_ACCUSED)
    return found or (by_share[0][0],)


def _several_hold(
    listed: tuple[Terms, ...],
    families: tuple[str, ...],
    best: ExplainedVariance,
    lack: LackOfFit,
) -> bool:
    """Whether more than one of the explanations holds, so that the data leave it open."""
    # the same with something more is no other explanation
    plain = [one for one in listed if not any({*other} < {*one} for other in listed)]
    if len(plain) < 2:
        return False
    if families:
        return True
    # explanations hold only where they leave no more than a name may leave
    left = best.lack_beside(best.span(()))
    return left.within_noise or share_left(lack, left) <= MAX_SHARE_LEFT_BY_NAME


def _leaves_structure(
    hypotheses: HypothesisSet,
    best: ExplainedVariance,
    families: tuple[str, ...],
    lack: LackOfFit,
) -> bool:
    """Whether the families named leave structure without a name.

    Structure that other effects explain does not count: they are added in the next step.
    """
    inside = best.span(families)
    left = best.lack_beside(inside)
    if share_left(lack, left) <= MIN_SHARE_OF_UNKNOWN:
        return False
    beside = hypotheses.beside(best.coordinates, inside, best.largest_wander)
    if left.between_directions and beside[EFFECT] < MIN_EXPLAINED_LEFT:
        return True
    return beside[UNKNOWN] > MIN_UNKNOWN_LEFT


def nameless(lack: LackOfFit) -> Verdict:
    """The verdict on more than noise to which no name is given."""
    return Verdict.NOT_REPEATABLE if lack.not_repeatable else Verdict.UNEXPLAINED


def unconfirmed(opinion: Opinion) -> Opinion:
    """The opinion where data held out do not confirm what it names: that is only probable.

    Not even that where it is two effects, leaves much, or the gyroscope is against it.
    """
    return replace(opinion, verdict=nameless(opinion.lack), families=(), terms=())


def share_left(before: LackOfFit, after: LackOfFit) -> float:
    """What the names that were given leave beside noise, as a share of what they take away.

    Squares in units of the noise, as in the fit: a noisy hold counts less than a quiet one.
    """
    taken = before.ratio**2 - after.ratio**2
    return max(after.ratio**2 - 1.0, 0.0) / taken if taken > 0.0 else np.inf


def _beyond_all_effects(misfit: WhitenedResiduals, best: ExplainedVariance) -> bool:
    """Whether a magnetometer's misfit is not that of its effects, were there all of them at once.

    The field of a room is many times the noise, and some effect takes away a little of it. The
    other sensors have no such surroundings.
    """
    if not (misfit.kind >= RowKind.FIELD).any():
        return False
    return best.left_by_all > max(MIN_LEFT_OF_FIELD, MAX_SHARE_LEFT * best.left)


@dataclass(frozen=True)
class Evidence:
    """What the decision is made from.

    Attributes:
        present: probability that each family takes part.
        taken: squares of the noise that each likely family takes away beside the others.
        strongest: the same for the likeliest effects together.
        discriminability: see ``explained_variance.discriminability``.
        lack: whether measured noise makes what is left.
    """

    present: dict[str, float]
    taken: dict[str, float]
    strongest: float
    discriminability: float
    lack: LackOfFit

    @property
    def shapeless(self) -> bool:
        """Whether noise alone, however large, may be all there is."""
        return self.present[NOTHING] > MAX_NOISE_PROBABILITY


def _evidence_of(shares: Shares, best: ExplainedVariance, own: float, lack: LackOfFit) -> Evidence:
    """Everything that the decision is made from."""
    present = shares.present()
    likely = sorted(set(present) - {NOTHING, UNKNOWN})
    taken = best.taken_away(tuple(one for one in likely if present[one] > 0.5))
    return Evidence(present, taken, best.strongest(), own, lack)


def decide_verdict(evidence: Evidence) -> tuple[Verdict, tuple[str, ...]]:
    """The verdict, and the families named; a disturbed hold counts as one."""
    present, taken = evidence.present, evidence.taken
    without_name = nameless(evidence.lack)
    if evidence.shapeless:
        return (Verdict.COMPLETE if evidence.lack.within_noise else without_name), ()
    named = tuple(
        family
        for family, squares in taken.items()
        if present[family] > MIN_FAMILY_PROBABILITY
        and squares > needed(family, evidence.discriminability)
    )
    if present.get(UNKNOWN, 0.0) > MAX_UNKNOWN_PROBABILITY:
        return without_name, ()
    if named:
        return (Verdict.DISTURBED if named == (DISTURBED,) else Verdict.MISSING), named
    if evidence.strongest > MIN_MISFIT_TAKEN:
        return Verdict.AMBIGUOUS, ()
    return without_name, ()


def needed(family: str, discriminability: float) -> float:
    """Squares of the noise that a family must take away to be named."""
    if family == DISTURBED:
        return MIN_MISFIT_DISTURBED
    if family not in BENT:
        return MIN_MISFIT_TAKEN
    return float(
        np.clip(
            MIN_MISFIT_OF_RIPPLES / max(discriminability, 1e-9), MIN_MISFIT_TAKEN, MAX_MISFIT_NEEDED
        )
    )


@dataclass(frozen=True)
class Named:
    """What is named of a family.

    Attributes:
        members: for each effect that acts, those that it may be, the likeliest first.
        together: two effects that may act where one is named, the likeliest first.
    """

    members: tuple[Terms, ...]
    together: tuple[Terms, ...] = ()


def _named(
    shares: Shares,
    family_of: dict[str, str],
    family: str,
    best: ExplainedVariance,
    heard: Hearing | None,
) -> Named:
    """One effect of a family, or two where one does not explain what these data show."""
    together = shares.together(family_of, family)
    both, likely = sum(together.values()), list(together)[:1]
    if both > MIN_FAMILY_PROBABILITY and best.taken_beside(likely[0]) > MIN_MISFIT_TAKEN:
        least = MIN_LISTED_PROBABILITY * both
        if together[likely[0]] > MIN_MEMBER_PROBABILITY * both:
            least = np.inf
        others = [{*terms} for terms, share in together.items() if share > least]
        each = tuple(
            (one, *(name for two in others if other in two for name in two - {one, other}))
            for one, other in (likely[0], likely[0][::-1])
        )
        return Named(each, tuple(best.instead_of_both(likely[0])))
    if both > MIN_FAMILY_PROBABILITY and not shares.members(family_of, family):
        return Named(tuple((one,) for one in likely[0]))
    members = _with_aliases(_within(shares, family_of, family), best, heard)
    # the same effect with another one beside it is no other explanation, unless it is likely
    open_ = both > 1.0 - MIN_FAMILY_PROBABILITY
    listed = [two for two, share in together.items() if open_ and share > MIN_LISTED_PROBABILITY]
    return Named((members,), tuple(dict.fromkeys([*listed, *best.instead_of(members[0])])))


def _within(shares: Shares, family_of: dict[str, str], family: str) -> Terms:
    """Members of a family by probability, until one has nearly all of it."""
    members = shares.members(family_of, family)
    if members and members[0][1] > MIN_MEMBER_PROBABILITY:
        return (members[0][0],)
    return tuple(term for term, share in members if share > MIN_LISTED_PROBABILITY)


def _with_aliases(members: Terms, best: ExplainedVariance, heard: Hearing | None) -> Terms:
    """The members, and what makes exactly the same as the first of them at these poses.

    Unless another sensor decides against it. Courses of a bias that are one and the same course
    tilt gravity alike, and no sensor decides between them.
    """
    spoken = {} if heard is None or heard.lacks_all else heard.with_terms
    found = list(members)
    for alias in best.aliases(members[0]):
        own, other = spoken.get((members[0],)), spoken.get((alias,))
        refuted = False
        if own is not None and other is not None:
            against = own.log_evidence - other.log_evidence
            refuted = against > -np.log(1.0 - MIN_MEMBER_PROBABILITY)
        if alias not in members and not refuted:
            found.append(alias)
    settling = best.aliases_while_settling(members[0])
    return (*found, *(one for one in settling if one not in found))
