"""What to measure next, whatever the verdict: the poses, and between which two they decide."""

from dataclasses import replace

import numpy as np

from imucal_wizard.bench.field_advice import circles, field_advice
from imucal_wizard.bench.more_poses import again, more_of_all
from imucal_wizard.bench.next_poses import Explained, separating_poses
from imucal_wizard.bench.pose import NextPose
from imucal_wizard.bench.separating import (
    Apart,
    explained,
    posing_apart,
    proposed,
    turning_apart,
    turns_for,
)
from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.effects.effect import Effect
from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.tui.bench.entries import Entry
from imucal_wizard.tui.bench.sight import Sight

FEW = 6
"""So many poses are proposed where nothing has to be decided."""
PROBABLE = 0.05
"""A suspect of this p-value is worth being told from another."""


def to_measure(
    sight: Sight, chosen: Entry | None = None
) -> tuple[tuple[NextPose, ...], Apart | None]:
    """What the verdict asks for; else what makes surer; else more of everything.

    Args:
        sight: what was looked up.
        chosen: the suspect chosen; where that is a disturbed hold, this hold is to be repeated.
    """
    repeated = _again(sight, chosen)
    if repeated:
        return repeated, None
    advice = sight.said.advice
    if advice.poses:
        return advice.poses, advice.apart[-1] if advice.apart else None
    poses, apart = to_be_surer(sight)
    bench = sight.said.bench
    if poses or bench is None:
        return poses, apart
    if isinstance(bench.measured, FieldData):
        return circles("more of them show smaller effects"), None
    return more_of_all(bench), apart


def _again(sight: Sight, chosen: Entry | None) -> tuple[NextPose, ...]:
    bench, suspect = sight.said.bench, None if chosen is None else chosen.suspect
    if bench is None or suspect is None or suspect.hold is None:
        return ()
    opinion = replace(sight.findings.opinion, holds=(suspect.hold,))
    findings = replace(sight.findings, opinion=opinion)
    if isinstance(bench.measured, FieldData):
        return field_advice(bench.measured, findings, Verdict.DISTURBED)
    return again(bench, findings)


def to_be_surer(sight: Sight) -> tuple[tuple[NextPose, ...], Apart | None]:
    """The likeliest explanation against the one most like it, where the verdict needs no poses.

    With effects in the model, the newest of them against another of its family.
    """
    pair = _from_model(sight) if sight.fit.terms else _from_suspects(sight)
    bench = sight.said.bench
    if pair is None or bench is None or sight.missing_base:
        return (), None
    first, second = pair
    if isinstance(sight.measured, FieldData):
        return (), None
    if isinstance(sight.measured, TurnData):
        apart = turning_apart(bench, sight.measured, first, second)
        return turns_for(bench, first, apart) if apart.poses else (), apart
    plan = separating_poses(
        first, second, sight.measured.circumstances, sight.fit.linear.floor, FEW, sight.sensor
    )
    return proposed(plan), posing_apart(first, second, plan, sight.sensor)


def _from_model(sight: Sight) -> tuple[Explained, Explained] | None:
    term, size = sight.fit.terms[-1], sight.fit.sizes[-1]
    c, family = sight.measured.circumstances, term.effect.family
    for other in sight.catalogue:
        if family is None or other.family != family or other.name in sight.fit.model:
            continue
        if other.lacking(sight.sensor, c) is None:
            return Explained(term.effect, term.variant, size), _any_size(sight, other)
    return None


def _any_size(sight: Sight, effect: Effect) -> Explained:
    """An effect of which only the pattern counts."""
    variant = effect.variants(sight.measured.circumstances)[0]
    return Explained(effect, variant, np.ones(len(effect.parameters(sight.sensor))))


def _from_suspects(sight: Sight) -> tuple[Explained, Explained] | None:
    bench = sight.said.bench
    for entry in sight.entries if bench is not None else ():
        if bench is not None and entry.suspect is not None and entry.suspect.like:
            first = explained(bench, sight.findings, entry.term)
            second = explained(bench, sight.findings, entry.suspect.like[0])
            if entry.suspect.p < PROBABLE and first is not None and second is not None:
                return first, second
    return None
