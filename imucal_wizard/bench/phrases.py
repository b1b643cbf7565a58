"""What the verdicts are put together from: an effect with size and price, the fall of the error."""

import numpy as np

from imucal_wizard.bench.amounts import shown, sizes_text
from imucal_wizard.bench.ladder import Rung
from imucal_wizard.bench.session import Bench
from imucal_wizard.bench.statement import Statement
from imucal_wizard.effects.cost import cost
from imucal_wizard.effects.effect import ACCELEROMETER, GYROSCOPE, MAGNETOMETER, Effect
from imucal_wizard.readings import FloatArray

FOLLOWS = {
    "force": "gravity",
    "temperature": "the temperature",
    "time": "the time",
    "previous": "the pose before",
    "vibration": "how much it is shaken",
    "current": "the current",
}
INPUT = {
    ACCELEROMETER: "the force along an axis",
    GYROSCOPE: "the rate of turn",
    MAGNETOMETER: "the way the field comes from",
}


def named(said: Statement, bench: Bench, term: str) -> list[str]:
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
        return f"up wrong by {degrees(price.tilt_rms)} rms{when}"
    if sensor == MAGNETOMETER:
        when = " in a session whose motors draw up to 10 A" if effect.name == "current" else when
        return f"the heading wrong by {degrees(price.heading_rms)} rms{when}"
    turn = f"a full turn wrong by {degrees(price.turn_rms)} rms"
    rest = f"{degrees(price.rest_rms)} gathered in a minute at rest{when}"
    parts = [turn] if price.turn_rms else []
    parts += [rest] if price.rest_rms else []
    return ", and ".join(parts) or "nothing wrong"


def fall(said: Statement, bench: Bench) -> list[str]:
    """How the error on data held out fell, or would."""
    if said.added:
        below, above = bench.ladder[-1 - len(said.added)], bench.ladder[-1]
        unit = bench.fit.fit.unit
        return [
            (
                f"Added: the error on {left_out(bench)} left out falls from "
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
    change = f"the error on {left_out(bench)} left out from {shown(unit, now)} to "
    if then < now:
        return [f"Adding {first.term} would bring {change}{shown(unit, then)}."]
    return [f"Adding {first.term} would raise {change}{shown(unit, then)}: it is not added."]


def stands(bench: Bench) -> str:
    """Where the error on data held out stands, beside the noise."""
    rung, unit = bench.ladder[-1], bench.fit.fit.unit
    held = shown(unit, rung.rms_held_out)
    return f"{held} on {left_out(bench)} left out, where noise makes {shown(unit, rung.floor)}"


def left_out(bench: Bench) -> str:
    """What is left out to hold the model against."""
    return "rotations" if bench.sensor == GYROSCOPE else "directions"


def change(below: Rung, above: Rung, unit: str) -> str:
    """The errors of two rungs."""
    return f"{shown(unit, below.rms_held_out)} before, {shown(unit, above.rms_held_out)} with it"


def degrees(value: float | None) -> str:
    """An angle in words."""
    return shown("rad", None if value is None else float(np.radians(value)))


def capital(text: str) -> str:
    """With a capital letter in front."""
    return text[:1].upper() + text[1:]
