"""The verdict in full, the poses to measure next, and what they bring."""

import numpy as np

from imucal_wizard.bench.next_poses import Explained, separating_poses
from imucal_wizard.bench.pose import NextPose
from imucal_wizard.bench.separating import Apart, explained
from imucal_wizard.effects.effect import Effect
from imucal_wizard.tui.bench.model_rows import unit_words
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.bench.words import says
from imucal_wizard.tui.text import Line, line, number, signed, wrapped

FEW = 6
"""So many poses are proposed where nothing has to be decided."""
_HOW = (
    "Hold each of these for as long as you like, the longer the better (in the wizard b goes back "
    "to the poses), then look again."
)
_NOTHING = (
    "No two explanations have to be told apart. More data show smaller effects: the 8 corners, the "
    "first poses once more at the end (a drift shows only there), a warm device."
)
_NEVER = (
    "No pose at 1 g tells them apart: the difference shows only in stronger forces. For use at 1 g "
    "it does not matter."
)


def next_rows(sight: Sight, width: int) -> list[Line]:
    """The whole verdict, then what to measure next."""
    rows = [*wrapped(says(sight)[1], width), line("")]
    advice = sight.said.advice
    if advice.poses:
        apart = advice.apart[-1] if advice.apart else None
        return [*rows, *_plan_rows(advice.poses, apart, width)]
    poses, apart = to_be_surer(sight)
    if apart is None:
        return [*rows, *wrapped(_NOTHING, width)]
    return [*rows, *_plan_rows(poses, apart, width)]


def to_be_surer(sight: Sight) -> tuple[tuple[NextPose, ...], Apart | None]:
    """The likeliest explanation against the one most like it, where the verdict needs no poses.

    With effects in the model, the newest of them against another of its family.
    """
    pair = _from_model(sight) if sight.fit.terms else _from_suspects(sight)
    if pair is None or sight.missing_base or sight.sensor != "accelerometer":
        return (), None
    first, second = pair
    plan = separating_poses(
        first, second, sight.measured.circumstances, sight.fit.linear.floor, FEW, sight.sensor
    )
    size = float(np.abs(first.size).max())
    unit = first.effect.parameters(sight.sensor)[0].unit
    apart = Apart(
        first.effect.name, second.effect.name, plan.before * size, plan.after * size, size,
        unit, len(plan.proposals),
    )  # fmt: skip
    poses = tuple(NextPose(p.direction, p.why, p.pose, p.warm) for p in plan.proposals)
    return poses, apart


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
            if entry.suspect.p < 0.05 and first is not None and second is not None:
                return first, second
    return None


def _plan_rows(poses: tuple[NextPose, ...], apart: Apart | None, width: int) -> list[Line]:
    rows: list[Line] = []
    if apart is not None:
        head = f"{apart.first} OR {apart.second}?".upper()
        rows = [line(head, "accent"), *gain_rows(apart, width), line("")]
    else:
        rows = [line("MEASURE NEXT", "accent")]
    for k, pose in enumerate(poses):
        rows += pose_rows(k + 1, pose, width, short=apart is not None)
    return [*rows, line(""), *wrapped(_HOW, width, "quiet")] if poses else rows


def gain_rows(apart: Apart, width: int) -> list[Line]:
    """From which size on these two are told apart, now and with the poses."""
    unit = unit_words(apart.unit)
    before = f"{number(apart.before, 2)} {unit}" if np.isfinite(apart.before) else "no size at all"
    now = (
        f"These data tell {apart.first} from {apart.second} from {before} on. Here it is about "
        f"{number(apart.size, 2)}."
    )
    if apart.never or not apart.poses:
        return [*wrapped(now, width), *wrapped(_NEVER, width, "warn")]
    worth = "that decides it" if apart.enough else "that does not decide it yet"
    then = f"With {apart.poses} more poses: from {number(apart.after, 2)} {unit} on; {worth}."
    return [*wrapped(now, width), *wrapped(then, width, "strong")]


def pose_rows(place: int, pose: NextPose, width: int, *, short: bool) -> list[Line]:
    """A pose with its number, its name and what it is good for."""
    name = f"{signed(pose.pose).upper()} UP" if pose.pose else "NO NAME"
    # what all poses are for together has been said above them
    text = pose.why.rpartition(": tells ")[0] or pose.why if short else pose.why
    why = wrapped(text, max(30, width - 20))
    rows: list[Line] = [((f"{place:>3}  ", "key"), (f"{name:<14} ", "strong"), *why[0])]
    return rows + [((" " * 20, ""), *more) for more in why[1:]]
