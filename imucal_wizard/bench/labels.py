"""Explanations that say the same, taken together: which effects, which families, which hold."""

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.bench.evidence import Jury, Weighed
from imucal_wizard.bench.hypotheses import DISTURBED, Hypothesis

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
        by_hold: probability that a hold or rotation is disturbed, by its index.
    """

    by_label: dict[Label, float]
    by_hold: dict[int, float]

    def present(self) -> dict[str, float]:
        """Probability that each family takes part; kinds without any under their own names."""
        found: dict[str, float] = defaultdict(float)
        for label, share in self.by_label.items():
            for family in label.families or (label.kind,):
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
        """Effects of a family, each with its share of the family's probability, best first."""
        found: dict[str, float] = defaultdict(float)
        for label, share in self.by_label.items():
            for term in label.terms:
                if family_of[term] == family:
                    found[term] += share
        total = sum(found.values())
        return [(term, share / total) for term, share in ordered(found)] if total else []


def ordered(shares: Mapping[_Key, float]) -> list[tuple[_Key, float]]:
    """Items, the largest share first."""
    return sorted(shares.items(), key=lambda item: -item[1])


def shares_of(jury: Jury, weighed: Weighed) -> Shares:
    """Probability by label."""
    by_label: dict[Label, float] = defaultdict(float)
    by_hold: dict[int, float] = defaultdict(float)
    for one, share in zip(jury.hypotheses, weighed.single, strict=True):
        by_label[_label(one)] += float(share)
        if one.kind == DISTURBED and one.variant is not None:
            by_hold[int(one.variant)] += float(share)
    _add_pairs(jury, weighed, by_label, by_hold)
    return Shares(dict(by_label), dict(by_hold))


def _label(one: Hypothesis) -> Label:
    return Label(one.kind, one.terms, one.families)


def _add_pairs(
    jury: Jury, weighed: Weighed, by_label: dict[Label, float], by_hold: dict[int, float]
) -> None:
    pairs = jury.pairs
    if pairs is None:
        return
    labels = [_label(one) for one in pairs.members]
    distinct = sorted(set(labels), key=lambda label: (label.families, label.terms))
    number: NDArray[np.intp] = np.array([distinct.index(label) for label in labels])
    size = len(distinct)
    table = np.zeros((size, size))
    np.add.at(table, (number[pairs.first], number[pairs.second]), weighed.paired)
    for i, j in zip(*np.nonzero(table), strict=True):
        a, b = distinct[i], distinct[j]
        both = Label(
            "pair",
            tuple(sorted((*a.terms, *b.terms))),
            tuple(sorted((*a.families, *b.families))),
        )
        by_label[both] += float(table[i, j])
    held = np.array([one.variant if one.kind == DISTURBED else -1.0 for one in pairs.members])
    for places in (pairs.first, pairs.second):
        totals = np.zeros(len(held))
        np.add.at(totals, places, weighed.paired)
        for place in np.flatnonzero(held >= 0.0):
            by_hold[int(held[place])] += float(totals[place])
