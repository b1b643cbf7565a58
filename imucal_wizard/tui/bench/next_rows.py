"""The poses that would tell two explanations apart, and what they bring."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.bench.next_poses import Explained, Plan, separating_poses
from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.effects.effect import ACCELEROMETER, Effect
from imucal_wizard.solver.extended.fit import Measured
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.bench.words import hold_words, pose_at
from imucal_wizard.tui.text import Line, line, number, signed, wrapped

_HOW = (
    "Hold each of these for as long as you like, the longer the better (in the wizard b goes back "
    "to the poses), then look again."
)


@dataclass(frozen=True, eq=False)
class Rivals:
    """Two explanations that look alike, and the poses that would tell them apart."""

    first: str
    second: str
    plan: Plan


def rivals_of(sight: Sight) -> Rivals | None:
    """The likeliest explanation against the one most like it; None where there are no two.

    With effects in the model already, the newest of them against others of its family.
    """
    if sight.sensor != ACCELEROMETER:
        return None
    if sight.findings.opinion.verdict is Verdict.COMPLETE:
        pair = _from_model(sight)
    else:
        pair = _from_opinion(sight) or _from_suspects(sight)
    if pair is None:
        return None
    first, second = pair
    known, linear = sight.measured.circumstances, sight.fit.linear
    plan = separating_poses(first, second, known, linear.floor)
    return Rivals(first.effect.name, second.effect.name, plan)


def _effect(sight: Sight, name: str) -> Effect | None:
    return next((effect for effect in sight.catalogue if effect.name == name), None)


def _explained(sight: Sight, name: str) -> Explained | None:
    """A suspect as an explanation, with the size it would have."""
    entry = next((entry for entry in sight.entries if entry.term == name), None)
    if (
        entry is None
        or entry.effect is None
        or entry.suspect is None
        or entry.suspect.trial is None
    ):
        return None
    variant = None if entry.suspect.candidate is None else entry.suspect.candidate.variant
    return Explained(entry.effect, variant, entry.suspect.trial.size)


def _from_opinion(sight: Sight) -> tuple[Explained, Explained] | None:
    opinion = sight.findings.opinion
    several = [members for members in opinion.terms if len(members) > 1]
    single = [terms[0] for terms in opinion.explanations if len(terms) == 1]
    names = several[0] if several else single if not opinion.terms else ()
    found = [one for one in (_explained(sight, name) for name in names[:2]) if one is not None]
    return (found[0], found[1]) if len(found) == 2 else None


def _from_model(sight: Sight) -> tuple[Explained, Explained] | None:
    if not sight.fit.terms:
        return None
    term, size = sight.fit.terms[-1], sight.fit.sizes[-1]
    for other in sight.catalogue:
        alike = other.family is not None and other.family == term.effect.family
        if alike and other.name not in sight.fit.model and _seen(other, sight.measured):
            columns = len(other.parameters(sight.sensor))
            return Explained(term.effect, term.variant, size), Explained(
                other, other.variants(sight.measured.circumstances)[0], np.ones(columns)
            )
    return None


def _seen(effect: Effect, measured: Measured) -> bool:
    return effect.lacking(ACCELEROMETER, measured.circumstances) is None


def _from_suspects(sight: Sight) -> tuple[Explained, Explained] | None:
    for entry in sight.entries:
        if entry.suspect is not None and entry.suspect.p < 0.05 and entry.suspect.like:
            first = _explained(sight, entry.term)
            second = _explained(sight, entry.suspect.like[0])
            if first is not None and second is not None:
                return first, second
    return None


def next_rows(sight: Sight, width: int) -> list[Line]:
    """What to measure next, in words and numbers."""
    opinion = sight.findings.opinion
    if opinion.holds:
        rows = [line("MEASURE AGAIN", "accent"), line("")]
        for hold in opinion.holds:
            text = f"{hold_words(sight, hold)}: it alone does not fit the others."
            rows += wrapped(text, width)
        return rows
    rivals = rivals_of(sight)
    if rivals is None:
        return _general(sight, width)
    head = f"{rivals.first} OR {rivals.second}?".upper()
    rows = [line(head, "accent"), line("")]
    rows += gain_rows(rivals, width)
    rows.append(line(""))
    for k, proposal in enumerate(rivals.plan.proposals):
        warm = "device warmed up by 15 °C" if proposal.warm else ""
        rows.append(
            (
                (f"  {k + 1}  ", "key"),
                (f"{signed(proposal.pose).upper() + ' UP':<14}", "strong"),
                (f"{_told(proposal.why):<54} ", ""),
                (warm, "warn"),
            )
        )
    if rivals.plan.proposals:
        rows += [line(""), *wrapped(_HOW, width, "quiet")]
    return rows


def gain_rows(rivals: Rivals, width: int) -> list[Line]:
    """Before and after, in shares of the size that was found."""
    plan = rivals.plan
    before = _times(plan.before)
    rows = wrapped(f"To tell them apart with the data there are, {rivals.first} would have to be "
                   f"{before} what was found.", width)  # fmt: skip
    if not plan.proposals:
        return rows + wrapped("No pose at 1 g changes that: the difference shows only in stronger "
                              "forces (shaking, a centrifuge). For use at 1 g it does not matter.",
                              width, "warn")  # fmt: skip
    enough = "that is enough" if plan.after <= 1.0 else "better, but not enough yet: take more"
    count = len(plan.proposals)
    return rows + wrapped(
        f"With these {count} poses besides, {_times(plan.after)}: {enough}.", width, "strong"
    )


def _times(share: float) -> str:
    return f"{number(share, 2)} times" if np.isfinite(share) else "any number of times"


def _told(why: str) -> str:
    return why.partition(":")[0].partition(", the device")[0]


def _general(sight: Sight, width: int) -> list[Line]:
    """Nothing to choose between: what reveals more in general."""
    rest = {row.index for row in sight.fit.linear.rows if row.kind != "rotation"}
    poses = len({pose_at(sight, index) for index in rest})
    text = (
        "There are no two explanations to tell apart here. More data show smaller effects: "
        "the 8 corners, the first poses once more at the end (a drift shows only there), a warm "
        f"device. There are {poses} different poses so far."
    )
    return [line("NOTHING TO TELL APART", "accent"), line(""), *wrapped(text, width)]
