"""How the errors held out change from one model to another, in words."""

from typing import Protocol

from imucal_wizard.core.quantities import number, quantity
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.bench import MIN_FALL_TEXT, Bench, Found, falls
from imucal_wizard.diagnose.verdict import Opinion, Terms
from imucal_wizard.estimate.experiment import Experiment


class Judged(Protocol):
    """A model whose errors held out are known."""

    @property
    def rms_held_out(self) -> float | None:
        """Of holds or rotations, in the sensor's error unit."""

    @property
    def held_out_in_noise(self) -> float | None:
        """Of all rows that judge a model, each in units of its measured noise."""


@dataclass(frozen=True)
class ChangeHeldOut:
    """The errors held out of two models, in words.

    Attributes:
        of: what is left out.
        before: error of the first model.
        after: error of the second one.
        alone: the errors that are reported, in the sensor's unit, where those above are of more
            rows and in units of the noise; else "".
    """

    of: str
    before: str
    after: str
    alone: str = ""


def change_held_out(measured: Experiment, below: Judged, above: Judged) -> ChangeHeldOut:
    """The errors held out of two models, in the unit that shows which model is confirmed.

    In the sensor's unit; in units of the noise where only rows tell it that are not reported.

    Args:
        measured: the rows.
        below: the first model.
        above: the second one.
    """
    errors = below.rms_held_out, above.rms_held_out
    in_noise = below.held_out_in_noise, above.held_out_in_noise
    before, after = (quantity(one, measured.error_unit) for one in errors)
    if falls(*errors) is falls(*in_noise) or None in in_noise:
        return ChangeHeldOut(measured.left_out, before, after)
    words = (one.group_word for one in measured.sources if one.confirms)
    every = " and ".join(f"{one}s" for one in dict.fromkeys(words))
    alone = f" ({measured.left_out} alone: {before} to {after})"
    before, after = (f"{number(one or 0.0, 3)} times the noise" for one in in_noise)
    return ChangeHeldOut(every, before, after, alone)


def why_not_confirmed(bench: Bench) -> str:
    """Which data held out do not confirm the newest term of a model, in words."""
    below, above = bench.ladder[-2:]
    if falls(below.held_out_in_noise, above.held_out_in_noise):
        before, after = (number(one.late_in_noise or 0.0, 3) for one in (below, above))
        return (
            "the first two thirds of the measurements do not predict the last third better with "
            f"it: the error there is {before} times the noise before, {after} times with it"
        )
    one = change_held_out(bench.measured, below, above)
    return (
        f"held-out data do not confirm it: {one.before} before, {one.after} with it{one.alone}, "
        f"and an effect is confirmed by a fall of more than {MIN_FALL_TEXT}"
    )


def reasons_of(bench: Bench, added: Terms, opinion: Opinion) -> tuple[Found, ...]:
    """Why the newest terms of a model were added.

    Args:
        bench: that of the sensor.
        added: the newest terms.
        opinion: the one that led to it.
    """
    below, above = bench.ladder[-1 - len(added)], bench.ladder[-1]
    change, found = change_held_out(bench.measured, below, above), []
    for name in added:
        # two of a family may have been added where one was named first
        named = zip(opinion.families, opinion.terms, strict=True)
        own, members = next((one for one in named if name in one[1]), ("", (name,)))
        decided_by = f"{change.of} left out"
        family = f"the plainest of {', '.join(members)}: " if len(members) > 1 else ""
        fall = f"the error held out falls from {change.before} to {change.after}{change.alone}"
        reason = f"{family}{fall}"
        if own in opinion.decided:
            decided_by += " and the gyroscope's closure"
        like = tuple(one for one in members if one != name)
        if len(added) < 2:
            like += tuple(" with ".join(both) for both in opinion.together)
        found.append(Found(name, reason, decided_by, like))
    return tuple(found)


def beside_noise(bench: Bench) -> str:
    """The error on data held out, beside the noise."""
    rung, unit = bench.ladder[-1], bench.fit.unit
    held, noise = quantity(rung.rms_held_out, unit), quantity(rung.floor, unit)
    return f"{held} on {bench.measured.left_out} left out; noise alone gives {noise}"
