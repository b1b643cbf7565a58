"""The lesson of an effect: its author's story, its usual sizes, and its computed cost."""

import inspect

import numpy as np

from imucal_wizard.effects.cost import Cost, cost
from imucal_wizard.effects.effect import ACCELEROMETER, MAGNETOMETER, Effect, EffectParameter
from imucal_wizard.effects.story import Lesson, Story

_CHOICE = "*"
_SESSION = ", in a session of 20 minutes that warms the device by 20 °C,"
_DRAWING = ", in a session whose motors draw up to 10 A,"


def lesson(effect: Effect, sensor: str) -> Lesson:
    """All there is to tell a student about this effect on this sensor."""
    story = effect.stories.get(sensor) or _plain_story(effect)
    return Lesson(
        what=story.what,
        equation=story.equation,
        signature=story.signature,
        sizes=sizes_text(effect.parameters(sensor)[0]),
        needs=story.needs,
        cost=cost_text(effect, sensor),
    )


def sizes_text(parameter: EffectParameter) -> str:
    """``consumer 0.5 to 5 mg/g², …``; a star marks a typical choice that no data sheet gives."""
    if not parameter.grades:
        return f"about {_amount(f'{parameter.typical:.3g}', parameter.unit)}, a guess"
    parts = [
        f"{grade} {low:.3g} to {high:.3g}{_CHOICE if grade in parameter.chosen else ''}"
        for grade, (low, high) in parameter.grades.items()
    ]
    note = f" ({_CHOICE} a typical choice, from no data sheet)" if parameter.chosen else ""
    return f"{_amount(', '.join(parts), parameter.unit)}{note}"


def cost_text(effect: Effect, sensor: str) -> str:
    """What a consumer part's size on the first parameter costs, in degrees."""
    parameters = effect.parameters(sensor)
    first, sizes = parameters[0], np.zeros(len(parameters))
    sizes[0] = first.typical
    size = f"{_amount(f'{first.typical:.3g}', first.unit)} on {first.name} alone"
    when = "" if effect.kind == "orientation" else _SESSION
    when = _DRAWING if effect.against == "current" else when
    price = cost(effect, sensor, sizes)
    return f"{size}{when} leaves {_spoken(price, sensor)}, however well the base model is fitted"


def _amount(value: str, unit: str) -> str:
    """A value with its unit; ``2 × 1e-3`` where the unit is a number itself."""
    return f"{value} × {unit}" if unit[:1].isdigit() else f"{value} {unit}".rstrip()


def _spoken(price: Cost, sensor: str) -> str:
    if sensor == ACCELEROMETER:
        return f"up wrong by {_degrees(price.tilt_rms)} rms, {_degrees(price.tilt_worst)} at worst"
    if sensor == MAGNETOMETER:
        worst = _degrees(price.heading_worst)
        return f"the heading wrong by {_degrees(price.heading_rms)} rms, {worst} at worst"
    turn = f"a full turn wrong by {_degrees(price.turn_rms)} rms, {_degrees(price.turn_worst)}"
    return f"{turn} at worst, and adds {_degrees(price.rest_rms)} a minute at rest"


def _degrees(value: float | None) -> str:
    return "0°" if value is None or value < 5e-5 else f"{value:.2g}°"


def _plain_story(effect: Effect) -> Story:
    # a guard around a user's effect carries the words of what it guards
    doc = vars(effect).get("__doc__", type(effect).__doc__)
    told = inspect.cleandoc(doc) if doc else f"Its author does not tell: {effect.title}."
    return Story(
        what=told,
        equation=effect.equation,
        signature="Its author does not tell; look at the residuals over what it depends on.",
        needs="Data in which what it depends on varies.",
    )
