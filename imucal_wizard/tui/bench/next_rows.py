"""The verdict in full, what to measure next, and what it brings."""

import numpy as np

from imucal_wizard.bench.pose import NextPose
from imucal_wizard.bench.separating import Apart
from imucal_wizard.procedure.poses import spoken, spoken_up
from imucal_wizard.tui.bench.entries import Entry
from imucal_wizard.tui.bench.model_rows import unit_words
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.bench.to_measure import to_measure
from imucal_wizard.tui.bench.words import says
from imucal_wizard.tui.text import Line, Span, line, number, signed, wrapped

_LIVE: Span = ("m asks for exactly these now, one by one, and comes back here.", "accent")
_RECORDING = (
    "This is a recording: to measure these, open the wizard on the device; m there asks for "
    "exactly these, one by one."
)
_NOTHING = (
    "More data show smaller effects: directions that were not held yet, and the first poses once "
    "more (a drift shows only there)."
)
_NEVER = (
    "No few poses at 1 g tell them apart: the difference shows in stronger forces, or in many more "
    "holds."
)
_NEVER_TURNING = "No turn by hand tells them apart: the difference shows only on a rate table."


def next_rows(
    sight: Sight, width: int, *, chosen: Entry | None = None, live: bool = False
) -> list[Line]:
    """The whole verdict, then what to measure next.

    Args:
        sight: what was looked up.
        width: columns there are.
        chosen: the suspect chosen.
        live: there is a device that can be asked for it.
    """
    poses, apart = to_measure(sight, chosen)
    repeated = chosen is not None and chosen.term == "disturbed" and bool(poses)
    rows = [*wrapped(says(sight)[1], width), line("")]
    if apart is not None:
        head = f"{apart.first} OR {apart.second}?".upper()
        rows += [line(head, "accent"), *gain_rows(apart, width), line("")]
    asked = repeated or sight.said.advice.poses or sight.missing_base
    if (apart is None or not apart.poses) and not asked:
        rows += [*wrapped(_NOTHING, width), line("")]
    if not poses:
        return rows
    rows.append(line("MEASURE NEXT", "accent"))
    if live:
        rows.append((_LIVE,))
    else:
        rows += wrapped(_RECORDING, width, "quiet")
    for k, pose in enumerate(poses):
        rows += pose_rows(k + 1, pose, width, short=apart is not None and apart.poses > 0)
    return rows


def gain_rows(apart: Apart, width: int) -> list[Line]:
    """From which size on these two are told apart, now and with the poses."""
    unit = unit_words(apart.unit)
    before = f"{number(apart.before, 2)} {unit}" if np.isfinite(apart.before) else "no size at all"
    now = (
        f"These data tell {apart.first} from {apart.second} from {before} on. Here it is about "
        f"{number(apart.size, 2)}."
    )
    if apart.enough and not apart.poses:
        return wrapped(f"{now} That decides it already.", width, "strong")
    if apart.never or not apart.poses:
        never = _NEVER_TURNING if apart.turning else _NEVER
        return [*wrapped(now, width), *wrapped(never, width, "warn")]
    worth = "that decides it" if apart.enough else "that does not decide it yet"
    if apart.before <= apart.size:
        worth = "they decide it already, and that makes surer"
    then = f"With {apart.things}: from {number(apart.after, 2)} {unit} on; {worth}."
    return [*wrapped(now, width), *wrapped(then, width, "strong")]


def pose_rows(place: int, pose: NextPose, width: int, *, short: bool) -> list[Line]:
    """A pose with its number, its name and what it is good for."""
    name = f"{signed(pose.pose).upper()} UP" if pose.pose else "TILTED"
    if pose.axis:
        name = f"ABOUT {pose.axis.upper()}, {pose.turns}×"
    # what all of them are for together has been said above them
    text = spoken(pose.pose) if pose.pose else spoken_up(pose.direction)
    text += f", {pose.brief}" if pose.brief and not short else ""
    text = pose.brief if pose.axis else text
    text = f"{'warm the device first; ' * pose.warm}{text}"
    why = wrapped(text, max(30, width - 20))
    rows: list[Line] = [((f"{place:>3}  ", "key"), (f"{name:<14} ", "strong"), *why[0])]
    return rows + [((" " * 20, ""), *more) for more in why[1:]]
