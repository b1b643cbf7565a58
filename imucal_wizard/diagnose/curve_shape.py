"""What a free curve shows: what it depends on, where it is steep, how wide, how large.

The curve is drawn where holds are, freed there from what the base model absorbs. It is cut at its
highs and lows; of the high stretches, one that is far steeper than the others is where it changes,
two of opposite sense beside each other are a bump, and more of them are a wave. A width is told
only if at least ``MIN_HOLDS_INSIDE`` holds lie inside it, spread over it: with fewer the curve
between the holds is a guess, and only the holds on either side are told.
"""

import itertools
from dataclasses import replace

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quantities import fixed, number, plus_minus
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.unknown_shape import TEMPERATURE_REACH, UnknownShape

MIN_HOLDS_INSIDE = 3
"""A step seen by fewer has any width."""
MAX_GAP = 0.5
"""Largest gap without a hold, as a share of a width that is told: three holds in the
same pose show no more than one."""
MAX_SHARP_WIDTH = 0.4
"""Width of a steep part that is called sharp, in halves of the curve's range."""
MIN_MAIN_SHARE = 0.6
"""Share of the whole span that a stretch must have to be told."""
MIN_STEEP_SHARE = 0.5
"""Share of the steepest such stretch's slope from which on another one is as steep."""
MIN_RISE_IN_ERRORS = 3.0
"""A rise of fewer standard errors is not told."""
SMALL_SHARE = 0.15
"""Of the span, which a turn must exceed to be one."""
STEP_SHARES = (0.1, 0.9)
"""Of its height, between which the width of a step is told."""
PLACES = 201
"""At which the curve is drawn."""


@dataclass(frozen=True)
class SteepPart:
    """Where a curve changes most, in its shown unit.

    Attributes:
        at: its middle.
        width: between 10 and 90 % of a step, or at half the height of a bump; None where too few
            holds lie inside.
        between: the holds on either side.
        inside: how many holds lie inside the width.
        bump: it goes up and down again, or down and up.
        sharp: it is narrow, and the holds show that it is.
    """

    at: float
    width: float | None
    between: tuple[float, float]
    inside: int
    bump: bool
    sharp: bool


@dataclass(frozen=True, eq=False)
class CurveShape:
    """A free curve with its errors.

    Attributes:
        term: its name.
        axis: ``x``, ``y`` or ``z``.
        against: ``force``, ``time`` or ``temperature``.
        x: g, minutes or °C, shape (n,).
        y: mg, without what the base model absorbs, shape (n,).
        standard_error: mg, shape (n,).
        span: from the lowest to the highest point, mg.
        span_error: mg.
        turns: highs and lows between its ends.
        steep: where it changes most; None where no single part stands out.
    """

    term: str
    axis: str
    against: str
    x: FloatArray
    y: FloatArray
    standard_error: FloatArray
    span: float
    span_error: float
    turns: int
    steep: SteepPart | None

    @property
    def unit(self) -> str:
        """Of x."""
        return {"force": "g", "time": "min"}.get(self.against, "°C")

    @property
    def over(self) -> str:
        """What it depends on, in words."""
        return f"the force along {self.axis}" if self.against == "force" else f"the {self.against}"

    @property
    def unknown(self) -> str:
        """What is not known of it."""
        absorbed = "bias and scale" if self.against == "force" else "the bias"
        return f"the curve is known only up to {absorbed}, and between the poses it is a guess"

    def words(self) -> str:
        """Where it is steep, how wide, and its size."""
        size = f"{plus_minus(self.span, self.span_error)} mg from its lowest to its highest point"
        return f"{self._where()}, {size}"

    def _where(self) -> str:
        steep, unit = self.steep, self.unit
        if steep is None:
            if self.turns > 1:
                return f"waving over its whole range, with {self.turns} turns"
            return "bent over its whole range"
        low, high, at = (fixed(one, DECIMALS[unit]) for one in (*steep.between, steep.at))
        kind = "a bump" if steep.bump else "changing"
        if steep.width is None:
            return (
                f"{kind} between {low} and {high} {unit}, where the holds are too few or too far "
                "apart to show its width"
            )
        sharp = "a sharp bump" if steep.bump else "sharp"
        what = sharp if steep.sharp else "a bump" if steep.bump else "steepest"
        wide = f"about {number(steep.width, 1)} {unit} wide ({steep.inside} holds lie inside)"
        return f"{what} at {at} {unit}, {wide}"


DECIMALS = {"g": 2, "min": 1, "°C": 1}


def curve_shape(
    curve: UnknownShape,
    variant: float | None,
    sizes: FloatArray,
    covariance: FloatArray,
    holds: Circumstances,
) -> CurveShape:
    """The shape of a curve with its coefficients.

    Args:
        curve: which.
        variant: its setting.
        sizes: mg, shape (p,).
        covariance: of the sizes, mg², shape (p, p).
        holds: in which it was measured.
    """
    held = np.sort(np.clip(curve.place(holds), -1.0, 1.0))
    place = np.linspace(held[0], held[-1], PLACES)
    straight = place[:, None] ** np.arange(curve.lines)
    columns = curve.shape(place, variant)
    columns -= straight @ np.linalg.lstsq(straight, columns, rcond=None)[0]
    y, spread = columns @ sizes, columns @ covariance @ columns.T
    low, high = int(y.argmin()), int(y.argmax())
    turns = _turning_points(y)
    steep = _steepest(place, y, spread, held, turns)
    return CurveShape(
        term=curve.name,
        axis=AXES[curve.axis],
        against="force" if curve.against == "input" else curve.against,
        x=_shown(curve, holds, place),
        y=y,
        standard_error=np.sqrt(np.maximum(np.diag(spread), 0.0)),
        span=float(y[high] - y[low]),
        span_error=_error_between(spread, low, high),
        turns=len(turns) - 2,
        steep=None if steep is None else _in_unit(steep, curve, holds),
    )


def rms_size(sizes: FloatArray, errors: FloatArray) -> tuple[float, float]:
    """Size of a curve, rms over its whole range, and its standard error, from the coefficients.

    Args:
        sizes: mg, shape (p,).
        errors: standard errors, shape (p,).
    """
    rms = float(np.sqrt((sizes**2).sum()))
    return rms, float(np.sqrt(((sizes * errors) ** 2).sum())) / max(rms, 1e-300)


def _shown(curve: UnknownShape, holds: Circumstances, place: FloatArray) -> FloatArray:
    """Places of the range −1 to 1 in g, minutes or °C."""
    if curve.against == "input":
        return np.asarray(place * holds.gravity / STANDARD_GRAVITY)
    if curve.against == "time":
        return np.asarray((place + 1.0) * holds.reference_time / 60.0)
    return np.asarray(holds.reference_temperature + TEMPERATURE_REACH * place)


def _in_unit(steep: SteepPart, curve: UnknownShape, holds: Circumstances) -> SteepPart:
    """A part that is told in places of the range, in the shown unit."""
    width = 0.0 if steep.width is None else steep.width
    at, low, high, first, last = _shown(
        curve, holds, np.array([steep.at, *steep.between, 0.0, width])
    ).tolist()
    return replace(
        steep,
        at=at,
        between=(low, high),
        width=None if steep.width is None else last - first,
    )


def _error_between(spread: FloatArray, a: int, b: int) -> float:
    """Standard error of the difference of two points of the curve."""
    return float(np.sqrt(max(spread[a, a] + spread[b, b] - 2.0 * spread[a, b], 0.0)))


def _steepest(
    place: FloatArray, y: FloatArray, spread: FloatArray, held: FloatArray, turns: list[int]
) -> SteepPart | None:
    """The part where the curve changes most, in places of the range; None where none stands out."""
    span = float(np.ptp(y))
    high = [
        (a, b)
        for a, b in itertools.pairwise(turns)
        if abs(y[b] - y[a]) >= MIN_MAIN_SHARE * span
        and abs(y[b] - y[a]) > MIN_RISE_IN_ERRORS * _error_between(spread, a, b)
    ]
    ends = [[_crossing(place, y, a, b, share) for share in STEP_SHARES] for a, b in high]
    slopes = [
        abs(y[b] - y[a]) / max(right - left, place[1] - place[0])
        for (a, b), (left, right) in zip(high, ends, strict=True)
    ]
    least = MIN_STEEP_SHARE * max(slopes, default=0.0)
    tall = [one for one, slope in zip(high, slopes, strict=True) if slope >= least]
    bump = len(tall) == 2 and tall[0][1] == tall[1][0]
    if not tall or (len(tall) > 1 and not bump):
        return None
    if bump:
        (first, top), (_, last) = tall
        left = _crossing(place, y, first, top, 0.5)
        right = _crossing(place, y, last, top, 0.5)
    else:
        left, right = ends[high.index(tall[0])]
    inside = int(((held >= left) & (held <= right)).sum())
    width = right - left
    below, above = held[held < left], held[held > right]
    steps = np.diff([left, *held[(held >= left) & (held <= right)], right])
    known = inside >= MIN_HOLDS_INSIDE and float(steps.max()) <= MAX_GAP * width
    return SteepPart(
        at=0.5 * (left + right),
        width=width if known else None,
        between=(
            float(below[-1] if len(below) else held[0]),
            float(above[0] if len(above) else held[-1]),
        ),
        inside=inside,
        bump=bump,
        sharp=known and width <= MAX_SHARP_WIDTH,
    )


def _turning_points(y: FloatArray) -> list[int]:
    """Places of the ends and of the highs and lows that differ by more than a small part."""
    least = SMALL_SHARE * float(np.ptp(y))
    turns, best, sense = [0], 0, 0
    for k in range(1, len(y)):
        rise = float(y[k] - y[best])
        if sense * rise > 0.0 or (sense == 0 and abs(rise) > least):
            sense, best = (sense or int(np.sign(rise))), k
        elif sense and -sense * rise > least:
            turns.append(best)
            sense, best = -sense, k
    return [*turns, best, len(y) - 1] if best != len(y) - 1 else [*turns, best]


def _crossing(place: FloatArray, y: FloatArray, a: int, b: int, share: float) -> float:
    """Where the curve has gone this share of the way from one turning point to another."""
    way = np.arange(a, b + 1) if b > a else np.arange(a, b - 1, -1)
    gone = (y[way] - y[a]) / (y[b] - y[a])
    return float(place[way[int(np.argmax(gone >= share))]])
