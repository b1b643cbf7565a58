"""Which poses tell the explanations apart that these data leave open, and by how much."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from imucal_wizard.bench.misfit import RowKind
from imucal_wizard.bench.next_poses import Explained, Plan, separating_poses
from imucal_wizard.bench.pose import NextPose, turns
from imucal_wizard.bench.session import Bench, Findings
from imucal_wizard.effects.effect import GYROSCOPE
from imucal_wizard.readings import FloatArray

MOST = 12
"""Poses proposed at most: what an operator does in three or four minutes."""
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
        poses: how many are proposed.
    """

    first: str
    second: str
    before: float
    after: float
    size: float
    unit: str
    poses: int

    @property
    def enough(self) -> bool:
        """The poses proposed would decide it at the size that it seems to have."""
        return self.after <= self.size

    @property
    def never(self) -> bool:
        """No still pose at 1 g makes a difference."""
        return not np.isfinite(self.after)


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
        if bench.sensor == GYROSCOPE and not (_at_rest(bench, a) or _at_rest(bench, b)):
            return tuple(turns(_axes(bench, a), f"tells {first} from {second}")), ()
        plan = separating_poses(
            a, b, bench.measured.circumstances, _noise(bench, findings), MOST, bench.sensor
        )
        apart.append(_apart(bench, a, b, plan))
        if plan.proposals:
            gain = brings(apart[-1])
            poses = [
                NextPose(p.direction, f"{p.why}; {gain}", p.pose, p.warm) for p in plan.proposals
            ]
            return tuple(poses), tuple(apart)
    return (), tuple(apart)


def brings(apart: Apart) -> str:
    """What the poses bring, in words."""
    count = {1: "this pose", 2: "both poses"}.get(apart.poses, f"all {apart.poses} poses")
    before = "no size" if not np.isfinite(apart.before) else f"{apart.before:.2g}"
    return f"{count} together: from {apart.after:.2g} instead of {before} {apart.unit}"


def _apart(bench: Bench, a: Explained, b: Explained, plan: Plan) -> Apart:
    size = float(np.abs(a.size).max())
    return Apart(
        a.effect.name,
        b.effect.name,
        plan.before * size,
        plan.after * size,
        size,
        a.effect.parameters(bench.sensor)[0].unit,
        len(plan.proposals),
    )


def _noise(bench: Bench, findings: Findings) -> FloatArray:
    """Noise of each hold, in SI, shape (n,)."""
    misfit = findings.misfit
    rest = misfit.sigma[misfit.kind != RowKind.ROTATION]
    per_hold = rest.reshape(len(bench.measured.circumstances), -1)
    return np.asarray(np.sqrt((per_hold**2).mean(axis=1)) * findings.opinion.noise)


def _at_rest(bench: Bench, explained: Explained) -> bool:
    """Whether an effect shows in a gyroscope's readings at rest."""
    where = bench.measured.circumstances
    columns = explained.effect.columns(bench.sensor, where, explained.variant)
    return bool(np.nan_to_num(columns).any())


def _axes(bench: Bench, explained: Explained) -> str:
    """The axis on which the effect is largest."""
    name = explained.effect.parameters(bench.sensor)[int(np.abs(explained.size).argmax())].name
    return name[:1] if name[:1] in "xyz" else "xyz"
