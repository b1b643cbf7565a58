"""The lesson of an effect, for a student: what, equation, picture, sizes, what it takes, cost."""

import numpy as np

from imucal_wizard.effects.effect import Effect
from imucal_wizard.effects.lesson import lesson
from imucal_wizard.effects.signature import picture
from imucal_wizard.tui.bench.scatter import scatter
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.bench.views import View
from imucal_wizard.tui.text import Line, line, wrapped

PLOT = 11
"""Rows of the picture."""
_BASE = {
    "bias": "What the sensor reads when it should read nothing. It shifts every reading by the "
    "same amount. Turn the device over: half of the sum of both readings is the bias.",
    "scale": "How much the sensor reads per unit of what it measures. Turn the device over: half "
    "of the difference of both readings is one g in the sensor's own unit.",
    "non-orthogonality": "The three axes are not exactly at right angles, so each feels a little "
    "of what belongs to the others. Poses between the faces (edges) show it.",
    "soft-iron": "Iron and nickel near the chip gather the field and bend it, more along one line "
    "than across it: the sphere of the readings becomes an ellipsoid. Scale, and axes that are not "
    "at right angles, look the same and are among it. A circle on each of the six faces shows it.",
    "disturbed": "One hold that is simply wrong: somebody touched the table, or the device had not "
    "come to rest. No effect of the sensor fits it and all the others. Never delete it because it "
    "is inconvenient: measure that pose again, and you will know.",
}


def rows_for(sight: Sight, term: str, width: int) -> list[Line]:
    """The lesson of an effect, of a part of the base, or of a disturbed hold."""
    known = {effect.name: effect for effect in sight.catalogue}
    if term in known:
        return lesson_rows(known[term], sight.sensor, width)
    return plain_rows(term, width)


def lesson_rows(effect: Effect, sensor: str, width: int) -> list[Line]:
    """All there is to tell about an effect."""
    told = lesson(effect, sensor)
    rows = [*_heading(effect.title), *wrapped(told.what, width), line("")]
    rows += _part("equation", told.equation, width)
    rows += [line(f"    {effect.equation}", "key"), line("")]
    rows += _part("what it looks like", told.signature, width)
    rows += [*signature_rows(effect, sensor, width), line("")]
    rows += _part("usual sizes", told.sizes, width)
    rows += [line(""), *_part("what it takes to see it", told.needs, width)]
    rows += [line(""), *_part("what it costs to ignore it", told.cost, width)]
    if effect.family:
        rows += [line(""), *_part("family", f"{effect.family}: at 1 g the members of this family "
                                  "are nearly the same; only more force, or much more data, tells "
                                  "them apart.", width)]  # fmt: skip
    return rows


def plain_rows(term: str, width: int) -> list[Line]:
    """The same for a part of the base or a disturbed hold."""
    return [*_heading(term), *wrapped(_BASE.get(term, "Nothing is told of it."), width)]


def signature_rows(effect: Effect, sensor: str, width: int) -> list[Line]:
    """The picture of what it leaves in the residuals of an ordinary session."""
    drawn = picture(effect, sensor)
    places = np.arange(len(drawn.x))
    view = View("", "", drawn.x_label, "", drawn.x, drawn.y, places, None)
    head = line(f"  what the base model leaves of it: {drawn.y_label}", "quiet")
    return [head, *scatter(view, min(width, 90), PLOT)]


def _heading(text: str) -> list[Line]:
    return [line(text.upper(), "accent"), line("")]


def _part(name: str, text: str, width: int) -> list[Line]:
    return [line(name, "strong"), *wrapped(text, width)]
