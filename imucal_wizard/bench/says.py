"""The verdict in plain sentences, for a technician and for a student.

What follows what, which effect does that, how large it is, what it costs to ignore it, and what
would decide where these data do not.
"""

import numpy as np

from imucal_wizard.bench.amounts import amount, detectable, shown, sizes_text
from imucal_wizard.bench.at_one_g import difference_at_one_g
from imucal_wizard.bench.ladder import Rung
from imucal_wizard.bench.separating import Apart, explained, rivals
from imucal_wizard.bench.session import Bench
from imucal_wizard.bench.statement import Statement
from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.effects.cost import cost
from imucal_wizard.effects.effect import ACCELEROMETER, Effect
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.hold_data import BASE

FOLLOWS = {
    "force": "gravity",
    "temperature": "the temperature",
    "time": "the time",
    "previous": "the pose before",
    "vibration": "how much it is shaken",
}
INPUT = {ACCELEROMETER: "the force along an axis", "gyroscope": "the rate of turn"}
BEYOND = {
    "orientation": "forces well over 1 g",
    "time": "a session in which the temperature rises and falls",
    "hold": "holds taken in another order and on another support",
}
"""What decides where still poses do not."""
FASTER = "faster turns, as a rate table makes them,"
FAMILIES = {
    "even-order": "an error that is the same to either side",
    "odd-order": "an error that grows to both sides alike",
    "slow-bias": "a bias that changes slowly",
}


def says(said: Statement) -> str:
    """The sentences of a verdict, the most important first."""
    parts = {
        Verdict.COMPLETE: _complete,
        Verdict.MISSING: _missing,
        Verdict.AMBIGUOUS: _ambiguous,
        Verdict.UNEXPLAINED: _unexplained,
        Verdict.DISTURBED: _disturbed,
        Verdict.INSUFFICIENT: _insufficient,
    }[said.verdict](said)
    if said.waiting:
        parts = [_waits(said), *parts]
    if said.bench is not None:
        parts += _repeatability(said.bench) + _regretted(said.bench)
    return " ".join(parts)


def _complete(said: Statement) -> list[str]:
    bench = said.bench
    if bench is None:
        return []
    if said.waiting:
        return [f"For now its error is {_stands(bench)}."]
    return [f"The {said.sensor}'s model is complete: {_stands(bench)}.", *_would_show(said, bench)]


def _would_show(said: Statement, bench: Bench) -> list[str]:
    """The size from which the plainest effect that is not in the model would have been seen."""
    suspects = {} if said.findings is None else {one.term: one for one in said.findings.suspects}
    for effect in bench.catalogue:
        if effect.name in suspects and effect.kind == "orientation":
            size = detectable(suspects[effect.name])
            unit = effect.parameters(bench.sensor)[0].unit
            if np.isfinite(size):
                return [f"{_capital(effect.name)} would have shown from {amount(size, unit)} on."]
    return []


def _missing(said: Statement) -> list[str]:
    bench, findings = said.bench, said.findings
    if bench is None or findings is None:
        return []
    terms = [term for members in findings.opinion.terms for term in members]
    return [sentence for term in terms for sentence in _named(said, bench, term)] + _fall(
        said, bench
    )


def _named(said: Statement, bench: Bench, term: str) -> list[str]:
    """What follows what, which effect, how large, and what it costs to ignore it."""
    effect = next(one for one in bench.catalogue if one.name == term)
    sizes, errors = _sizes(said, bench, effect)
    follows = FOLLOWS.get(effect.against, INPUT[bench.sensor])
    size = sizes_text(effect, bench.sensor, sizes, errors)
    word = "In the model now" if term in bench.fit.model else "Missing"
    return [
        f"The {bench.sensor}'s error follows {follows}.",
        f"{word}: {term} ({effect.title}), {size}.",
        f"Ignored, it leaves {_price(effect, bench.sensor, sizes)}.",
    ]


def _sizes(said: Statement, bench: Bench, effect: Effect) -> tuple[FloatArray, FloatArray]:
    """As fitted where the effect is in the model, else as it would come out."""
    for term, sizes, errors in zip(bench.fit.terms, bench.fit.sizes, bench.fit.errors, strict=True):
        if term.name == effect.name:
            return sizes, errors
    suspects = () if said.findings is None else said.findings.suspects
    for one in suspects:
        if one.term == effect.name and one.trial is not None:
            return one.trial.size, one.trial.standard_error
    count = len(effect.parameters(bench.sensor))
    return np.zeros(count), np.full(count, np.nan)


def _price(effect: Effect, sensor: str, sizes: FloatArray) -> str:
    price = cost(effect, sensor, sizes)
    when = (
        "" if effect.kind == "orientation" else " in a session of 20 minutes that warms it by 20 °C"
    )
    if sensor == ACCELEROMETER:
        return f"up wrong by {_degrees(price.tilt_rms)} rms{when}"
    turn = f"a full turn wrong by {_degrees(price.turn_rms)} rms"
    return f"{turn}, and {_degrees(price.rest_rms)} gathered in a minute at rest{when}"


def _fall(said: Statement, bench: Bench) -> list[str]:
    """How the error on data held out fell, or would."""
    if said.added:
        below, above = bench.ladder[-1 - len(said.added)], bench.ladder[-1]
        unit = bench.fit.fit.unit
        return [
            (
                f"Added: the error on {_left_out(bench)} left out falls from "
                f"{shown(unit, below.rms_held_out)} to {shown(unit, above.rms_held_out)}, where "
                f"{shown(unit, above.floor)} would be noise."
            )
        ]
    return _would_fall(said, bench)


def _would_fall(said: Statement, bench: Bench) -> list[str]:
    if said.findings is None or not said.findings.suspects:
        return []
    first = said.findings.suspects[0]
    if first.trial is None:
        return []
    unit, now, then = bench.fit.fit.unit, bench.fit.rms_held_out, first.trial.rms_held_out
    if now is None or then is None:
        return []
    change = f"the error on {_left_out(bench)} left out from {shown(unit, now)} to "
    if then < now:
        return [f"Adding {first.term} would bring {change}{shown(unit, then)}."]
    return [f"Adding {first.term} would raise {change}{shown(unit, then)}: it is not added."]


def _ambiguous(said: Statement) -> list[str]:
    bench, findings = said.bench, said.findings
    if bench is None or findings is None:
        return []
    opinion = findings.opinion
    if said.waiting:
        seen = " with ".join(_or(members) for members in opinion.terms)
        return [f"What is left looks like {seen}."] if seen else []
    if opinion.families:
        kinds = " and ".join(FAMILIES.get(name, name) for name in opinion.families)
        first = f"The {said.sensor} shows {kinds}"
        choice = "; and ".join(_or(members) for members in opinion.terms)
        parts = [f"{first}: {choice}, and these data cannot tell which."]
    else:
        listed = "; ".join(" with ".join(terms) for terms in opinion.explanations[:4])
        parts = [
            (
                f"The {said.sensor}'s misfit has several explanations that these data cannot tell "
                f"apart: {listed}."
            )
        ]
    for term in said.added:
        parts += _named(said, bench, term)
    parts += _fall(said, bench) if said.added or opinion.families else []
    return parts + _matters(said, bench) + _decides(said, bench)


def _or(members: tuple[str, ...]) -> str:
    return members[0] if len(members) == 1 else f"{', '.join(members[:-1])} or {members[-1]}"


def _matters(said: Statement, bench: Bench) -> list[str]:
    """Whether at 1 g it matters which of the two likeliest it is."""
    if bench.sensor != ACCELEROMETER or said.findings is None:
        return []
    pair = [explained(bench, said.findings, term) for term in rivals(said.findings)[:2]]
    known = [one for one in pair if one is not None and one.effect.kind == "orientation"]
    if len(known) < 2:
        return []
    angle = difference_at_one_g(known[0], known[1])
    noise = np.degrees(bench.ladder[-1].floor / bench.measured.gravity)
    names = " or ".join(one.effect.name for one in known)
    if angle <= noise:
        return [
            (
                f"For use at 1 g and below it does not matter whether it is {names}: up differs by "
                f"{_degrees(angle)}, within the noise. It matters at 2 g and more."
            )
        ]
    return [f"Whether it is {names} turns up by {_degrees(angle)} rms: it matters at 1 g too."]


def _decides(said: Statement, bench: Bench) -> list[str]:
    """What would tell the explanations apart."""
    kinds = {effect.name: effect.kind for effect in bench.catalogue}
    return [
        _would_decide(one, FASTER if one.turning else BEYOND[kinds[one.first]])
        for one in said.advice.apart
        if one.never or one.poses
    ]


def _would_decide(one: Apart, beyond: str) -> str:
    pair = f"{one.first} from {one.second}"
    if one.never:
        what = "turn" if one.turning else "still pose at 1 g"
        return f"No {what} tells {pair}, whatever their size; {beyond} would."
    before = "at no size" if not np.isfinite(one.before) else f"from {amount(one.before, one.unit)}"
    poses = f"{one.things}, listed as the next ones,"
    here = f"it is about {amount(one.size, one.unit)} here"
    after = amount(one.after, one.unit)
    if one.enough:
        return f"These data tell {pair} {before} on; {poses} would from {after} on, and {here}."
    what = "Turns" if one.turning else "Still poses at 1 g"
    return (
        f"{what} hardly tell {pair}: these data do {before} on, {poses} from {after} "
        f"on, and {here}. {_capital(beyond)} would."
    )


def _unexplained(said: Statement) -> list[str]:
    bench = said.bench
    if bench is None:
        return []
    left = [term for term in BASE if term not in bench.fit.base]
    if left:
        return [f"More than noise is left: {_stands(bench)}. Put back {' and '.join(left)} first."]
    known = ", ".join(term.name for term in bench.fit.terms)
    none = (
        f"No effect known here explains what {known} leaves, so nothing more is named."
        if known
        else "No effect known here explains it, so none is named and none added."
    )
    return [
        (
            f"More than noise is left: {_stands(bench)}. {none} Corners and repeats would show "
            "whether it is the sensor or the way it was held."
        )
    ]


def _disturbed(said: Statement) -> list[str]:
    places = [f"hold {hold + 1}" for hold in said.holds]
    places += [f"rotation {number + 1}" for number in said.rotations]
    return [
        (
            f"{_capital(' and '.join(places) or 'one hold')} explains what is left better than any "
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


def _stands(bench: Bench) -> str:
    rung, unit = bench.ladder[-1], bench.fit.fit.unit
    held = shown(unit, rung.rms_held_out)
    return f"{held} on {_left_out(bench)} left out, where noise makes {shown(unit, rung.floor)}"


def _left_out(bench: Bench) -> str:
    return "directions" if bench.sensor == ACCELEROMETER else "rotations"


def _repeatability(bench: Bench) -> list[str]:
    floors = bench.ladder[-1].floors
    if floors.repeatable is not False:
        return []
    return [
        (
            f"The same pose does not repeat: {shown(floors.unit, floors.repeats)} from hold to "
            f"hold, {shown(floors.unit, floors.within)} within them."
        )
    ]


def _regretted(bench: Bench) -> list[str]:
    """A term added by hand that data held out do not confirm."""
    if len(bench.ladder) < 2 or bench.ladder[-1].added is None or bench.confirmed():
        return []
    below, above, unit = bench.ladder[-2], bench.ladder[-1], bench.fit.fit.unit
    return [
        (
            f"{_capital(above.added or '')} was added by hand, and data held out do not confirm "
            f"it: {_change(below, above, unit)}. Take it out again."
        )
    ]


def _change(below: Rung, above: Rung, unit: str) -> str:
    return f"{shown(unit, below.rms_held_out)} before, {shown(unit, above.rms_held_out)} with it"


def _degrees(value: float | None) -> str:
    return shown("rad", None if value is None else float(np.radians(value)))


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
