"""The verdict in plain sentences, for a technician and for a student.

What follows what, which effect does that, how large it is, what it costs to ignore it, and what
would decide where these data do not.
"""

import numpy as np

from imucal_wizard.bench.amounts import amount, detectable, shown
from imucal_wizard.bench.field_advice import ELSEWHERE
from imucal_wizard.bench.open_verdict import ambiguous
from imucal_wizard.bench.phrases import capital, change, fall, named, stands
from imucal_wizard.bench.session import Bench
from imucal_wizard.bench.statement import Statement
from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.effects.effect import MAGNETOMETER
from imucal_wizard.solver.extended.field_data import FieldData


def says(said: Statement) -> str:
    """The sentences of a verdict, the most important first."""
    parts = {
        Verdict.COMPLETE: _complete,
        Verdict.MISSING: _missing,
        Verdict.AMBIGUOUS: ambiguous,
        Verdict.UNEXPLAINED: _unexplained,
        Verdict.DISTURBED: _disturbed,
        Verdict.INSUFFICIENT: _insufficient,
    }[said.verdict](said)
    if said.waiting:
        parts = [_waits(said), *parts]
    if said.bench is not None:
        parts += _assumed(said.bench) + _repeatability(said, said.bench) + _regretted(said.bench)
    return " ".join(parts)


def _complete(said: Statement) -> list[str]:
    bench = said.bench
    if bench is None:
        return []
    if said.waiting:
        return [f"For now its error is {stands(bench)}."]
    return [f"The {said.sensor}'s model is complete: {stands(bench)}.", *_would_show(said, bench)]


def _would_show(said: Statement, bench: Bench) -> list[str]:
    """The size from which the plainest effect that is not in the model would have been seen."""
    suspects = {} if said.findings is None else {one.term: one for one in said.findings.suspects}
    for effect in bench.catalogue:
        if effect.name in suspects and effect.kind == "orientation":
            size = detectable(suspects[effect.name])
            unit = effect.parameters(bench.sensor)[0].unit
            if np.isfinite(size):
                return [f"{capital(effect.name)} would have shown from {amount(size, unit)} on."]
    return []


def _missing(said: Statement) -> list[str]:
    bench, findings = said.bench, said.findings
    if bench is None or findings is None:
        return []
    terms = [term for members in findings.opinion.terms for term in members]
    return [sentence for term in terms for sentence in named(said, bench, term)] + fall(said, bench)


def _unexplained(said: Statement) -> list[str]:
    bench = said.bench
    if bench is None:
        return []
    left = [term for term in bench.whole if term not in bench.fit.base]
    if left:
        return [f"More than noise is left: {stands(bench)}. Put back {' and '.join(left)} first."]
    rival = _rival(said, bench)
    if rival is not None:
        other, known = rival
        return [
            (
                f"More than noise is left: {stands(bench)}. {capital(other)} explains it, an "
                f"effect of the same kind as {known}: perhaps that was the wrong one. Take "
                f"{known} out and look again."
            )
        ]
    known = ", ".join(term.name for term in bench.fit.terms)
    none = (
        f"No effect known here explains what {known} leaves, so nothing more is named."
        if known
        else "No effect known here explains it, so none is named and none added."
    )
    advice = "Corners and repeats would show whether it is the sensor or the way it was held."
    if bench.sensor == MAGNETOMETER:
        advice = (
            f"Repeat the circles {ELSEWHERE}: what is the room's field and not the sensor's is "
            "another one there."
        )
    return [f"More than noise is left: {stands(bench)}. {none} {advice}"]


def _rival(said: Statement, bench: Bench) -> tuple[str, str] | None:
    """The effect that explains what one of its family in the model leaves, and that one."""
    likeliest = [] if said.findings is None else said.findings.opinion.explanations[:1]
    family = {one.name: one.family for one in bench.catalogue if one.family is not None}
    added = {family[term.name]: term.name for term in bench.fit.terms if term.name in family}
    for members in likeliest:
        if len(members) == 1 and family.get(members[0]) in added:
            return members[0], added[family[members[0]]]
    return None


def _disturbed(said: Statement) -> list[str]:
    places = [f"hold {hold + 1}" for hold in said.holds]
    places += [f"the field from {start:.0f} to {end:.0f} s" for start, end in said.stretches]
    places += [f"rotation {number + 1}" for number in said.rotations]
    return [
        (
            f"{capital(' and '.join(places) or 'one hold')} explains what is left better than any "
            f"physics does: something moved. Measure it again; nothing has been deleted."
        )
    ]


def _insufficient(said: Statement) -> list[str]:
    carried = "" if said.bench is None else f" They carry {', '.join(said.bench.fit.model)}."
    return [f"The {said.sensor}'s data are too few for this model: {said.lacking}.{carried}"]


def _waits(said: Statement) -> str:
    return (
        "The accelerometer's own model is not complete yet; what it lacks tilts the gyroscope's "
        f"reference and would be blamed on the {said.sensor}. Nothing is settled here until the "
        "accelerometer is."
    )


def _assumed(bench: Bench) -> list[str]:
    """On what the sizes rest where counts of an unknown field were read."""
    data = bench.measured
    if not isinstance(data, FieldData) or not data.assumed:
        return []
    return [
        f"Nothing tells how strong the field is: all sizes rest on {data.field:.0f} µT (--field)."
    ]


def _repeatability(said: Statement, bench: Bench) -> list[str]:
    """That a pose does not read the same again, where nothing that is missing can be the cause.

    No pose is held again exactly alike: an effect that is not in the model spoils the repeats, too.
    """
    floors = bench.ladder[-1].floors
    if floors.repeatable is not False or said.verdict not in _BY_ITSELF:
        return []
    repeats, within = (shown(floors.unit, size) for size in (floors.repeats, floors.within))
    if bench.sensor == MAGNETOMETER:
        where = f"{repeats} from one time to another, {within} within each"
        return [f"The same direction does not repeat: {where}."]
    if said.verdict is Verdict.COMPLETE:
        return [
            (
                f"A pose held again differs by {repeats}, noise within a hold makes {within}: what "
                "is slower than a hold (noise that wanders, warmth, the seat) is counted as noise "
                "here."
            )
        ]
    return [f"The same pose does not repeat: {repeats} from hold to hold, {within} within them."]


_BY_ITSELF = (Verdict.COMPLETE, Verdict.UNEXPLAINED)
"""Verdicts in which no known effect is left that would spoil the repeats."""


def _regretted(bench: Bench) -> list[str]:
    """A term added by hand that data held out do not confirm."""
    if len(bench.ladder) < 2 or bench.ladder[-1].added is None or bench.confirmed():
        return []
    below, above, unit = bench.ladder[-2], bench.ladder[-1], bench.fit.fit.unit
    return [
        (
            f"{capital(above.added or '')} was added by hand, and data held out do not confirm "
            f"it: {change(below, above, unit)}. Take it out again."
        )
    ]
