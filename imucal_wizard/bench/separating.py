"""Which poses tell the explanations apart that these data leave open, and by how much."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from imucal_wizard.bench.misfit import RowKind
from imucal_wizard.bench.next_poses import Explained, Plan, separating_poses
from imucal_wizard.bench.next_turns import turns_apart
from imucal_wizard.bench.pose import SENSES, SPEEDS, NextPose, turns
from imucal_wizard.bench.session import Bench, Findings
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.turn_data import TurnData

MOST = 12
"""Poses proposed at most: what an operator does in three or four minutes."""
HELPS = 0.9
"""Turns that bring less than a tenth are not asked for."""
PAIRS = 6
"""Pairs of explanations compared at most."""


@dataclass(frozen=True)
class Apart:
    """What it takes to tell two explanations apart.

    Attributes:
        first: the likelier effect.
        second: the other one.
        before: size of the first at which these data tell it from the second, in ``unit``;
            infinite when no size would do.
        after: the same with the poses proposed.
        size: what the first is estimated to be.
        unit: shown unit of the first effect.
        poses: how many are proposed: poses, or turns where only these help.
        turning: they are turns.
    """

    first: str
    second: str
    before: float
    after: float
    size: float
    unit: str
    poses: int
    turning: bool = False

    @property
    def enough(self) -> bool:
        """The poses proposed would decide it at the size that it seems to have."""
        return self.after <= self.size

    @property
    def never(self) -> bool:
        """Nothing that can be asked for makes a difference."""
        return not np.isfinite(self.after)

    @property
    def things(self) -> str:
        """What is proposed, with its number: ``6 more poses``."""
        word = "turn" if self.turning else "pose"
        return f"{self.poses} more {word}{'s' * (self.poses > 1)}"


def rivals(findings: Findings) -> tuple[str, ...]:
    """The effects among which these data cannot choose, the likeliest first."""
    opinion = findings.opinion
    for members in opinion.terms:
        if len(members) > 1:
            return members
    found = [term for terms in opinion.explanations for term in terms]
    return tuple(dict.fromkeys(found))


def explained(bench: Bench, findings: Findings, term: str) -> Explained | None:
    """An effect at the size it would have; None for what is no suspect."""
    suspect = next((one for one in findings.suspects if one.term == term), None)
    effect = next((one for one in bench.catalogue if one.name == term), None)
    if suspect is None or effect is None or suspect.candidate is None or suspect.trial is None:
        return None
    return Explained(effect, suspect.candidate.variant, suspect.trial.size)


def separating(bench: Bench, findings: Findings) -> tuple[tuple[NextPose, ...], tuple[Apart, ...]]:
    """Poses for the likeliest two; where none helps, for the next two."""
    apart: list[Apart] = []
    for first, second in list(combinations(rivals(findings), 2))[:PAIRS]:
        a, b = explained(bench, findings, first), explained(bench, findings, second)
        if a is None or b is None:
            continue
        if isinstance(bench.measured, TurnData) and not _seen_at_rest(bench, a, b):
            apart.append(turning_apart(bench, bench.measured, a, b))
            if apart[-1].poses:
                return turns_for(bench, a, apart[-1]), tuple(apart)
            continue
        plan = separating_poses(
            a, b, bench.measured.circumstances, _noise(bench, findings), MOST, bench.sensor
        )
        apart.append(posing_apart(a, b, plan, bench.sensor))
        if plan.proposals:
            return proposed(plan, f"; {brings(apart[-1])}"), tuple(apart)
    return (), tuple(apart)


def proposed(plan: Plan, gain: str = "") -> tuple[NextPose, ...]:
    """The poses of a plan, each with what it is good for and what all of them bring."""
    return tuple(
        NextPose(p.direction, f"{p.why}{gain}", p.pose, p.warm, brief=p.why.partition(": ")[2])
        for p in plan.proposals
    )


def turns_for(bench: Bench, explained: Explained, apart: Apart) -> tuple[NextPose, ...]:
    """Turns about the axis on which an effect is largest, with what they bring."""
    why = f"tells {apart.first} from {apart.second}; {brings(apart)}"
    return tuple(turns(_axis(bench, explained), why))


def turning_apart(bench: Bench, data: TurnData, a: Explained, b: Explained) -> Apart:
    """What turns about the axis on which the first effect is largest would bring."""
    before, after = turns_apart(data, bench.fit, a, b, _axis(bench, a))
    helps = after < HELPS * before
    size = float(np.abs(a.size).max())
    return Apart(
        a.effect.name,
        b.effect.name,
        before * size,
        after * size,
        size,
        a.effect.parameters(bench.sensor)[0].unit,
        len(SPEEDS) * len(SENSES) if helps else 0,
        turning=True,
    )


def brings(apart: Apart) -> str:
    """What the poses bring, in words."""
    word = "turns" if apart.turning else "poses"
    count = {1: "this pose", 2: f"both {word}"}.get(apart.poses, f"all {apart.poses} {word}")
    before = "no size" if not np.isfinite(apart.before) else f"{apart.before:.2g}"
    return f"{count} together: from {apart.after:.2g} instead of {before} {apart.unit}"


def posing_apart(a: Explained, b: Explained, plan: Plan, sensor: str) -> Apart:
    """What the poses of a plan would bring."""
    size = float(np.abs(a.size).max())
    return Apart(
        a.effect.name,
        b.effect.name,
        plan.before * size,
        plan.after * size,
        size,
        a.effect.parameters(sensor)[0].unit,
        len(plan.proposals),
    )


def _noise(bench: Bench, findings: Findings) -> FloatArray:
    """Noise of each hold, in SI, shape (n,)."""
    misfit = findings.misfit
    rest = misfit.sigma[misfit.kind != RowKind.ROTATION]
    per_hold = rest.reshape(len(bench.measured.circumstances), -1)
    return np.asarray(np.sqrt((per_hold**2).mean(axis=1)) * findings.opinion.noise)


def _seen_at_rest(bench: Bench, *explanations: Explained) -> bool:
    """Whether one of these effects shows in a gyroscope's readings at rest."""
    where = bench.measured.circumstances
    columns = (one.effect.columns(bench.sensor, where, one.variant) for one in explanations)
    return any(bool(np.nan_to_num(column).any()) for column in columns)


def _axis(bench: Bench, explained: Explained) -> str:
    """The axis on which the effect is largest."""
    name = explained.effect.parameters(bench.sensor)[int(np.abs(explained.size).argmax())].name
    return name[:1] if name[:1] in "xyz" else "x"
