"""The lesson of an effect: its description, its usual sizes, the cost of ignoring it, and a plot.

The cost is in degrees: of tilt, per rotation, per minute, of heading.

The effect acts during one ordinary session of twenty minutes. The device warms by 20 °C and cools
again, is held in every direction, rotated at 50 to 300 °/s and shaken at times, in a field of 48 µT
with a dip of 65°; its motors draw up to 10 A. The base model (bias, scale, non-orthogonality) is
fitted as the wizard does; what it does not absorb is the cost. Small errors are assumed, so that
they add up linearly.
"""

import inspect
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from imucal_wizard.core.poses import AXES, EDGES, FACES
from imucal_wizard.core.quantities import quantity, with_unit
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import root_mean_square, sample_quantile
from imucal_wizard.core.units import ACCELERATION_UNITS, STANDARD_GRAVITY
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    DEGREE,
    GYROSCOPE,
    MAGNETOMETER,
    MILLI_G,
    Circumstances,
    Effect,
    EffectParameter,
    Story,
    sensed,
)

SESSION_MINUTES = np.array([0.0, 5.0, 10.0, 15.0, 20.0])
SESSION_WARMTH = np.array([-10.0, 0.0, 10.0, 5.0, -5.0])
"""It rises and falls: while it only rose evenly, a thermal lag would be a bias."""
SESSION_SHAKING = np.array([0.0, 0.1, 0.0, 0.2, 0.0])
"""Vibration at these moments, g rms."""
SESSION_AMPERES = np.array([0.0, 8.0, 2.0, 10.0, 5.0])
FIELD, DIP = 48.0, np.radians(65.0)
"""Flux density, µT, and its angle below the horizon."""
SESSION_RATES = np.array([-300.0, -150.0, -50.0, 50.0, 150.0, 300.0])
"""Rates of the rotations, °/s."""
_AT_RATES = f"at {SESSION_RATES[SESSION_RATES > 0].min():.0f} to {SESSION_RATES.max():.0f} °/s"
SESSION_DIRECTIONS = 60


SMALLEST_ANGLE = 5e-5
"""Degrees below which an error is not worth stating."""


@dataclass(frozen=True)
class Cost:
    """What is left of an effect after the base model has been fitted.

    Attributes:
        tilt_rms: error of the up direction, degrees; None for a gyroscope.
        tilt_worst: the largest of them.
        rotation_rms: error of a full rotation at 50 to 300 °/s, degrees; None for an accelerometer.
        rotation_worst: the largest of them.
        rest_rms: angle gathered in a minute at rest, degrees.
        heading_rms: error of the heading, degrees; None but for a magnetometer.
        heading_worst: the largest of them.
    """

    tilt_rms: float | None = None
    tilt_worst: float | None = None
    rotation_rms: float | None = None
    rotation_worst: float | None = None
    rest_rms: float | None = None
    heading_rms: float | None = None
    heading_worst: float | None = None

    def words(self, *, worst: bool = False, among: "Sequence[Cost]" = ()) -> str:
        """``the up direction wrong by 0.068° rms``.

        Args:
            worst: with the largest error, too.
            among: costs of other sizes that the data allow; the middle 90 % of them are told.
        """
        kinds = (
            ("the up direction wrong by", self.tilt_rms, self.tilt_worst, "tilt_rms"),
            ("the heading wrong by", self.heading_rms, self.heading_worst, "heading_rms"),
            (
                f"a full rotation {_AT_RATES} wrong by",
                self.rotation_rms,
                self.rotation_worst,
                "rotation_rms",
            ),
        )
        parts = [
            f"{what} {_told(rms, [getattr(one, name) for one in among])} rms"
            + (f", {_degrees(most)} at worst" if worst else "")
            for what, rms, most, name in kinds
            if rms is not None and most is not None and rms > SMALLEST_ANGLE
        ]
        if self.rest_rms is not None and self.rest_rms > SMALLEST_ANGLE:
            rest = _told(self.rest_rms, [one.rest_rms or 0.0 for one in among])
            parts.append(f"an angle of {rest} after a minute at rest")
        words = ", and ".join(parts) or f"less than {SMALLEST_ANGLE:.5f}°"
        return f"{words} (90 % of the sizes that these data allow)" if among and parts else words


def _told(likeliest: float, among: Sequence[float]) -> str:
    """An angle, or the two between which nine in ten of others lie."""
    if not among:
        return _degrees(likeliest)
    return " to ".join(_degrees(sample_quantile(among, one)) for one in (0.05, 0.95))


def _degrees(value: float) -> str:
    return quantity(float(np.radians(value)), "rad", 2)


def cost_of_ignoring(
    effect: Effect, sensor: str, sizes: FloatArray, variant: float | None = None
) -> Cost:
    """Cost of ignoring this effect with sizes (p,), in shown units, and this setting."""
    prices = {ACCELEROMETER: _tilt, GYROSCOPE: _rotation, MAGNETOMETER: _heading}
    return prices[sensor](effect, sizes, variant)


def session_of(sensor: str) -> Circumstances:
    """The ordinary session as this sensor sees it."""
    return _SESSIONS[sensor]()


def left_by_magnitude(force: FloatArray, error: FloatArray) -> FloatArray:
    """What a fit of ``|x| = g`` leaves of an error of the specific force, shape (n, 3), m/s².

    Such a fit sees only the component along the force; the nine parameters that explain it best
    take part of the other components away and add to them. The same of a field and ``|m| = B``.
    """
    gains = [force[:, k, None] * np.eye(3)[i] for i in range(3) for k in range(i, 3)]
    base = np.stack([*(np.tile(row, (len(force), 1)) for row in np.eye(3)), *gains], axis=2)
    radial = np.einsum("nip,ni->np", base, force)
    taken = np.linalg.lstsq(radial, (error * force).sum(axis=1), rcond=None)[0]
    return np.asarray(error - base @ taken, np.float64)


def left_by_rotations(rate: FloatArray, error: FloatArray) -> FloatArray:
    """What a fit of the rotations leaves of an error of the rate, shape (n, 3), rad/s.

    The readings at rest, far more exact than rotations, determine the bias; the rotations determine
    the nine gains.
    """
    moving = rate.any(axis=1)
    left = error - error[~moving].mean(axis=0)
    gains = np.linalg.lstsq(rate[moving], left[moving], rcond=None)[0]
    return np.asarray(left - rate @ gains, np.float64)


def _tilt(effect: Effect, sizes: FloatArray, variant: float | None) -> Cost:
    c = session_poses()
    left = left_by_magnitude(c.force, effect.error(ACCELEROMETER, c, sizes, variant))
    up = c.force / np.linalg.norm(c.force, axis=1, keepdims=True)
    across = left - up * (left * up).sum(axis=1, keepdims=True)
    tilt = np.degrees(np.linalg.norm(across, axis=1) / c.gravity)
    return Cost(tilt_rms=root_mean_square(tilt), tilt_worst=float(tilt.max()))


def _rotation(effect: Effect, sizes: FloatArray, variant: float | None) -> Cost:
    c = session_rotations()
    left = left_by_rotations(c.rate, effect.error(GYROSCOPE, c, sizes, variant))
    size, speed = np.linalg.norm(left, axis=1), np.linalg.norm(c.rate, axis=1)
    moving = speed > 0.0
    turn = 360.0 * size[moving] / speed[moving]
    return Cost(
        rotation_rms=root_mean_square(turn),
        rotation_worst=float(turn.max()),
        rest_rms=60.0 * root_mean_square(size[~moving]) / DEGREE,
    )


def _heading(effect: Effect, sizes: FloatArray, variant: float | None) -> Cost:
    c, unit = session_poses(), effect.field_unit
    c = replace(c, magnetic=unit.size * c.magnetic, field_unit=unit)
    left = left_by_magnitude(c.magnetic, effect.error(MAGNETOMETER, c, sizes, variant))
    east = np.cross(c.magnetic, c.force)
    east /= np.linalg.norm(east, axis=1, keepdims=True)
    turned = np.degrees((left * east).sum(axis=1) / (unit.size * FIELD * np.cos(DIP)))
    return Cost(heading_rms=root_mean_square(turned), heading_worst=float(np.abs(turned).max()))


@cache
def session_poses() -> Circumstances:
    """The ordinary session's poses: every direction at every moment."""
    k = np.arange(SESSION_DIRECTIONS) + 0.5
    z = 1.0 - 2.0 * k / SESSION_DIRECTIONS
    longitude = np.pi * (1.0 + np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - z**2)
    up = np.stack([ring * np.cos(longitude), ring * np.sin(longitude), z], axis=1)
    return _session(up, np.zeros_like(up))


@cache
def session_rotations() -> Circumstances:
    """The ordinary session's rotations about axes and diagonals at faces and edges, and rests."""
    gravities = np.array([*FACES.values(), *EDGES.values()])
    between = np.array([[1.0, 1.0, 0.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0]]) / np.sqrt(2.0)
    axes = np.vstack([np.eye(3), between])
    rates = np.vstack([np.zeros((1, 3)), *(speed * DEGREE * axes for speed in SESSION_RATES)])
    return _session(np.repeat(gravities, len(rates), axis=0), np.tile(rates, (len(gravities), 1)))


def _session(up: FloatArray, rate: FloatArray) -> Circumstances:
    """All these directions and rates at each moment of the session, after different poses."""
    moments, n = len(SESSION_MINUTES), len(up)
    force = STANDARD_GRAVITY * up
    before = np.vstack([np.roll(force, 7 * (moment + 1), axis=0) for moment in range(moments)])
    return Circumstances(
        force=np.tile(force, (moments, 1)),
        rate=np.tile(rate, (moments, 1)),
        temperature=np.repeat(25.0 + SESSION_WARMTH, n),
        time=np.repeat(60.0 * SESSION_MINUTES, n),
        previous=before,
        vibration=np.repeat((SESSION_SHAKING * STANDARD_GRAVITY) ** 2, n),
        magnetic=np.tile(_field(up), (moments, 1)),
        current=np.repeat(SESSION_AMPERES, n),
    )


_SESSIONS = {
    ACCELEROMETER: session_poses,
    GYROSCOPE: session_rotations,
    MAGNETOMETER: session_poses,
}


def _field(up: FloatArray) -> FloatArray:
    """Field in the body frame, every pose with another heading, µT, shape (n, 3)."""
    first = np.cross(up, np.eye(3)[np.abs(up).argmin(axis=1)])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    # the golden angle is that of the longitudes: headings by it would follow the directions
    turn = 2.0 * np.pi * np.sqrt(2.0) * np.arange(len(up))[:, None]
    north = np.cos(turn) * first + np.sin(turn) * np.cross(up, first)
    return np.asarray(FIELD * (np.cos(DIP) * north - np.sin(DIP) * up))


MIN_SHARE_IN_MAGNITUDE = 1e-6
"""Share of an error in the magnitude, below which the magnitude does not show it."""


@dataclass(frozen=True, eq=False)
class Picture:
    """Points to draw, in the order of ``x``.

    Attributes:
        x: what the effect depends on, shape (n,).
        y: residual after the base model has been fitted, mg, °/s or µT, shape (n,).
        x_label: with its unit.
        y_label: with its unit.
    """

    x: FloatArray
    y: FloatArray
    x_label: str
    y_label: str


def picture(effect: Effect, sensor: str, sizes: FloatArray | None = None) -> Picture:
    """The residuals that this effect leaves.

    Args:
        effect: any.
        sensor: ``accelerometer`` (residual of the magnitude), ``gyroscope`` (of the rate, on the
            axis that the first parameter moves most) or ``magnetometer`` (of the magnitude; where
            that shows nothing, of the component along gravity).
        sizes: in shown units, shape (p,); a consumer part's on the first parameter when not given.
    """
    c = session_of(sensor)
    if sizes is None:
        parameters = effect.parameters(sensor)
        sizes = parameters[0].typical * np.eye(len(parameters))[0]
    error = effect.error(sensor, c, sizes)
    axis = int(np.argmax((error**2).sum(axis=0)))
    y, y_label = _RESIDUALS[sensor](c, error, axis)
    x, x_label = abscissa(effect, sensor, c, _input_axis(effect, sensor, axis))
    order = np.argsort(x, kind="stable")
    return Picture(x[order], np.asarray(y[order], np.float64), x_label, y_label)


def _of_force(c: Circumstances, error: FloatArray, _axis: int) -> tuple[FloatArray, str]:
    left = left_by_magnitude(c.force, error)
    return (left * c.force).sum(axis=1) / (c.gravity * MILLI_G), "|a| − g, mg"


def _of_rate(c: Circumstances, error: FloatArray, axis: int) -> tuple[FloatArray, str]:
    return left_by_rotations(c.rate, error)[:, axis] / DEGREE, f"rate about {AXES[axis]}, °/s"


def _of_field(c: Circumstances, error: FloatArray, _axis: int) -> tuple[FloatArray, str]:
    left = left_by_magnitude(c.magnetic, error)
    size = np.linalg.norm(c.magnetic, axis=1)
    along = (left * c.magnetic).sum(axis=1) / size
    if np.abs(along).max() > MIN_SHARE_IN_MAGNITUDE * np.abs(error).max():
        return np.asarray(along), "|m| − B, µT"
    return (left * c.force).sum(axis=1) / c.gravity, "m along up, µT"


_RESIDUALS = {ACCELEROMETER: _of_force, GYROSCOPE: _of_rate, MAGNETOMETER: _of_field}
"""Residual and its label, of each sensor; the axis is the one that the effect moves most."""
_INPUTS = {
    ACCELEROMETER: "force along {}, g",
    GYROSCOPE: "rate about {}, °/s",
    MAGNETOMETER: "field along {}, µT",
}


def abscissa(effect: Effect, sensor: str, c: Circumstances, axis: int) -> tuple[FloatArray, str]:
    """What the residuals of this effect are drawn over, shape (n,), and its label."""
    letter, g = AXES[axis], ACCELERATION_UNITS["g"]
    if effect.against == "temperature":
        return c.temperature, "temperature, °C"
    if effect.against == "time":
        return c.time / 60.0, "time, min"
    if effect.against == "vibration":
        return c.vibration / g**2, "mean square vibration, g²"
    if effect.against == "previous":
        return c.previous[:, axis] / g, f"force along {letter} in the hold before, g"
    if effect.against == "current":
        return c.current, f"current, {c.current_unit}"
    of = ACCELEROMETER if effect.against == "force" else sensor
    return sensed(of, c)[:, axis], _INPUTS[of].format(letter)


def _input_axis(effect: Effect, sensor: str, output: int) -> int:
    """The last axis in the first parameter's name: what moves it; else the output axis."""
    name = effect.parameters(sensor)[0].name
    return AXES.index(name[-1]) if name and set(name) <= set(AXES) else output


_ALIASES = (
    "Exactly the same error in such data, for some sizes: {}. Then only another kind of test "
    "separates them."
)
_ONE_G = (
    "Nearly the same error at 1 g: {}. Forces above 1 g separate them; sometimes more poses or a "
    "gyroscope's rotations do."
)
_ONE_SPEED = (
    "Nearly the same error in rotations at one speed or about tilted axes alone: {}. Rotations at "
    "several speeds, about the axes of the sensor and about tilted ones, separate them."
)
_ALIKE = {ACCELEROMETER: _ONE_G}
_ONE_CHANGE = (
    "Nearly the same error during a single slow change: {}. A session with repeated poses, in "
    "which the temperature rises and falls, separates them."
)
_SETTLING = (
    "Exactly the same error while the temperature settles exponentially: {}. A temperature that "
    "rises and falls again separates them."
)
_DISTURBED = (
    "One hold or rotation that differs from all others, because somebody touched the table or the "
    "device was not at rest. It is disturbed if the others agree with one another without it. Do "
    "not delete it; measure it again."
)
BASE_LESSONS: dict[str, dict[str, str]] = {
    ACCELEROMETER: {
        "bias": "The reading when the input is zero. It shifts every reading by the same amount. "
        "Turn the device over: half the sum of the two readings is the bias.",
        "scale": "The reading per unit of force. Turn the device over: half the difference of the "
        "two readings is one g in the sensor's own unit.",
        "non-orthogonality": "The three axes are not exactly at right angles, so each axis "
        "measures a small part of the force along the others. Poses between the faces (edges) "
        "show it.",
        "disturbed": _DISTURBED,
    },
    GYROSCOPE: {
        "bias": "The reading at rest. It shifts every reading by the same amount, so that an angle "
        "integrated from the rate grows steadily. Let the device rest in several poses: the mean "
        "reading is the bias.",
        "scale": "The reading per unit of rate. Rotate the device by one full circle against a "
        "stop: the integrated angle, less that of the bias, over 360° is the scale.",
        "non-orthogonality": "The three axes are not exactly at right angles, nor parallel to "
        "those of the accelerometer, so each axis measures a small part of the rate about the "
        "others. Rotations about all three axes show it.",
        "disturbed": _DISTURBED,
    },
    MAGNETOMETER: {
        "bias": "The offset of the chip and the field of magnetised parts that turn with it (hard "
        "iron): it moves the centre of the sphere of readings. Turn an axis towards the field and "
        "then away from it: half the sum of the two readings is the bias.",
        "soft-iron": "Iron and nickel near the chip concentrate the field, more in one direction "
        "than in others: the sphere of the readings becomes an ellipsoid. Scale and "
        "non-orthogonality have the same effect and are included. A circle on each of the six "
        "faces shows it.",
        "disturbed": _DISTURBED,
    },
}
"""For each sensor, the lesson of each term of its base, and of a disturbed hold or rotation."""


@dataclass(frozen=True)
class Lesson:
    """The text of an effect; sizes and costs are computed."""

    what: str
    equation: str
    signature: str
    sizes: str
    needs: str
    cost: str
    remedy: str = ""
    confirm: str = ""
    source: str = ""
    alike: str = ""


_CHOICE = "*"


def lookalikes(effect: Effect, sensor: str, catalogue: Iterable[Effect]) -> str:
    """The effects of this sensor that ordinary data can hardly separate from this one, or ""."""
    others = [one for one in catalogue if one.name != effect.name and sensor in one.sensors]
    same = [one.name for one in others if one.name in effect.aliases]
    settling = [one.name for one in others if one.name in effect.aliases_while_settling]
    near = [
        one.name
        for one in others
        if effect.family and one.family == effect.family and one.name not in (*same, *settling)
    ]
    alike = _ALIKE.get(sensor, _ONE_SPEED)
    alike = _ONE_CHANGE if effect.kind == "time" else alike
    found = ((_ALIASES, same), (_SETTLING, settling), (alike, near))
    return " ".join(words.format(", ".join(names)) for words, names in found if names)


def lesson(effect: Effect, sensor: str, catalogue: Iterable[Effect] = ()) -> Lesson:
    """The lesson about this effect on this sensor, beside the other effects of a catalogue."""
    story = effect.stories.get(sensor) or _plain_story(effect)
    return Lesson(
        what=story.what,
        equation=story.equation,
        signature=story.signature,
        sizes=usual_sizes_text(effect.parameters(sensor)[0]),
        needs=story.needs,
        cost=cost_text(effect, sensor),
        remedy=story.remedy,
        confirm=story.confirm,
        source=story.source,
        alike=lookalikes(effect, sensor, catalogue),
    )


def usual_sizes_text(parameter: EffectParameter) -> str:
    """``consumer 0.5 to 5 mg/g², …``; a star marks a typical choice that no data sheet gives."""
    if not parameter.grades:
        return f"about {with_unit(_plain(parameter.typical), parameter.unit)}, a guess"
    parts = [
        f"{grade} {_plain(low)} to {_plain(high)}{_CHOICE if grade in parameter.chosen else ''}"
        for grade, (low, high) in parameter.grades.items()
    ]
    note = f" ({_CHOICE} a typical choice, from no data sheet)" if parameter.chosen else ""
    return f"{with_unit(', '.join(parts), parameter.unit)}{note}"


def cost_text(effect: Effect, sensor: str) -> str:
    """What a consumer part's size on the first parameter costs, in degrees."""
    parameters = effect.parameters(sensor)
    first, sizes = parameters[0], np.zeros(len(parameters))
    sizes[0] = first.typical
    size = with_unit(_plain(first.typical), first.unit)
    size += f" on {first.name} alone" if len(parameters) > 1 else ""
    price = cost_of_ignoring(effect, sensor, sizes).words(worst=True)
    when = session_words(effect)
    return f"With the base model fitted, {size} leaves {price}{f', {when}' if when else ''}."


def _plain(value: float) -> str:
    """A usual size: "0.8", "1500"."""
    return f"{float(f'{value:.3g}'):g}"


_WARMED = "in a session of 20 minutes in which the temperature rises by 20 °C and falls again"
_CONDITIONS = {
    "time": "in a session of 20 minutes",
    "temperature": _WARMED,
    "vibration": f"in a session with vibration of up to {SESSION_SHAKING.max():.1f} g rms",
    "current": f"in a session whose motors draw up to {SESSION_AMPERES.max():.0f} A",
}
"""Conditions of the cost, by what the error depends on."""


def session_words(effect: Effect) -> str:
    """The conditions of the cost: "in a session of …"; "" where only the direction counts."""
    return _CONDITIONS.get(effect.against, "")


def _plain_story(effect: Effect) -> Story:
    # a guard around a user's effect carries the words of what it guards
    doc = vars(effect).get("__doc__", type(effect).__doc__)
    text = inspect.cleandoc(doc) if doc else f"Its author gives no description: {effect.title}."
    return Story(
        what=text,
        equation=effect.equation,
        signature="Its author gives no description. Look at the residuals over the quantity on "
        "which it depends.",
        needs="Data in which the quantity on which it depends varies.",
    )
