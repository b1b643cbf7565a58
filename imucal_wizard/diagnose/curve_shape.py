"""The shape of a free curve: its abscissa, and the place, width and height of its steep part.

Bias and scale take any straight line of it, so that only changes of slope are reported. The slope
is relative to that of the half of the curve where it is most alike. Where it stays above half of
its largest value lies the part that changes: one such part is a step, two of opposite sense beside
each other are a bump, more are a wave. A width is given only if at least ``MIN_HOLDS_INSIDE`` holds
lie inside it, spread over it: with fewer the curve between the holds is a guess, and only the holds
on either side are named.
"""

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from imucal_wizard.core.quantities import fixed, number, plus_minus, with_unit
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.model.unknown_shape import Range, UnknownShape

MIN_HOLDS_INSIDE = 3
"""With fewer, steps of many widths fit as well."""
MAX_GAP = 0.5
"""Largest gap without a hold, as a share of a width that is given: three holds in the
same pose show no more than one."""
MAX_SHARP_WIDTH = 0.2
"""Width of a steep part that is called sharp, as a share of what was measured."""
MIN_STEEP_SHARE = 0.5
"""Share of the largest slope from which on a part is as steep."""
MIN_SLOPE_OF_PART = 0.1
"""Share of the largest slope of a part at which it ends."""
MIN_RISE_IN_ERRORS = 3.0
"""A rise of fewer standard errors is not reported."""
STEP_SHARES = (0.1, 0.9)
"""Of its height, between which the width of a step is measured."""
PLACES = 201
"""At which the curve is drawn."""


@dataclass(frozen=True)
class Measured:
    """Where a curve was measured.

    Attributes:
        places: in its range from −1 to 1, in order, one of each hold, rotation or direction.
        span: what these are in the shown unit.
        word: what each of them is called.
    """

    places: FloatArray
    span: Range
    word: str


@dataclass(frozen=True)
class SteepPart:
    """Where a curve changes most, in its shown unit.

    Attributes:
        at: its middle.
        rise: height of the step or bump.
        rise_error: its standard error.
        width: between 10 and 90 % of a step, or at half the height of a bump; None where too few
            holds lie inside.
        between: the holds on either side.
        inside: how many holds lie inside the width.
        bump: it goes up and down again, or down and up.
        sharp: it is narrow, and the holds show that it is.
        word: what is measured in place of holds: rotations, directions of a field.
    """

    at: float
    rise: float
    rise_error: float
    width: float | None
    between: tuple[float, float]
    inside: int
    bump: bool
    sharp: bool
    word: str


@dataclass(frozen=True, eq=False)
class CurveShape:
    """A free curve with its errors.

    Attributes:
        term: its name.
        axis: ``x``, ``y`` or ``z``.
        against: what it runs over: ``force``, ``rate``, ``field``, ``time``, ``temperature`` or
            ``current``.
        over: the same with its axis, in words.
        absorbed: what the base model takes of it, in words.
        x_unit: of x.
        unit: of y.
        x: shape (n,).
        y: without the part that the base model takes, shape (n,).
        standard_error: shape (n,).
        span: from the lowest to the highest point.
        span_error: its standard error.
        steep: where it changes most; None where no single part stands out.
    """

    term: str
    axis: str
    against: str
    over: str
    absorbed: str
    x_unit: str
    unit: str
    x: FloatArray
    y: FloatArray
    standard_error: FloatArray
    span: float
    span_error: float
    steep: SteepPart | None

    @property
    def unknown(self) -> str:
        """What is not known of it."""
        return f"the curve is known only up to {self.absorbed}, and between the poses it is a guess"

    def words(self) -> str:
        """Where it is steep, how wide, and its size."""
        if self.steep is not None:
            rise = plus_minus(self.steep.rise, self.steep.rise_error)
            return f"{self._where()}, {with_unit(rise, self.unit)} high"
        span = with_unit(plus_minus(self.span, self.span_error), self.unit)
        return f"{self._where()}, {span} between its lowest and its highest point"

    def _where(self) -> str:
        steep, unit = self.steep, self.x_unit
        if steep is None:
            return "bent over its whole range"
        low, high, at = (fixed(one, DECIMALS.get(unit, 0)) for one in (*steep.between, steep.at))
        kind = "a bump" if steep.bump else "changing"
        if steep.width is None:
            return (
                f"{kind} between {low} and {high} {unit}, where the {steep.word}s are too few or "
                "too far apart to show its width"
            )
        sharp = "a sharp bump" if steep.bump else "sharp"
        what = sharp if steep.sharp else "a bump" if steep.bump else "steepest"
        wide = (
            f"about {number(steep.width, 1)} {unit} wide ({steep.inside} {steep.word}s lie inside)"
        )
        return f"{what} at {at} {unit}, {wide}"


DECIMALS = {"g": 2, "min": 1, "°C": 1, "µT": 1, "A": 1}
"""Of a place, by its unit."""


def curve_shape(
    curve: UnknownShape,
    sensor: str,
    variant: float | None,
    sizes: FloatArray,
    covariance: FloatArray,
    measured: Measured,
) -> CurveShape:
    """The shape of a curve with its coefficients.

    Args:
        curve: which.
        sensor: whose.
        variant: its setting.
        sizes: shown unit, shape (p,).
        covariance: of the sizes, shape (p, p).
        measured: where.
    """
    span, held = measured.span, np.clip(measured.places, -1.0, 1.0)
    place = np.linspace(held[0], held[-1], PLACES)
    columns = curve.shape(place, variant)
    steep = _steepest(place, columns, sizes, covariance, measured, straight=curve.lines > 1)
    straight = place[:, None] ** np.arange(curve.lines)
    columns -= straight @ np.linalg.lstsq(straight, columns, rcond=None)[0]
    y, spread = columns @ sizes, columns @ covariance @ columns.T
    low, high = int(y.argmin()), int(y.argmax())
    between = spread[low, low] + spread[high, high] - 2.0 * spread[low, high]
    return CurveShape(
        term=curve.name,
        axis=curve.letter,
        against=curve.influence(sensor).partition("-")[0],
        over=curve.over(sensor),
        absorbed=curve.absorbed,
        x_unit=span.unit,
        unit=curve.units[sensor].unit,
        x=span.middle + span.reach * place,
        y=y,
        standard_error=np.sqrt(np.maximum(np.diag(spread), 0.0)),
        span=float(y[high] - y[low]),
        span_error=float(np.sqrt(max(between, 0.0))),
        steep=None if steep is None else _in_unit(steep, span),
    )


def rms_size(
    sizes: FloatArray, errors: FloatArray, covariance: FloatArray | None = None
) -> tuple[float, float]:
    """Size of a curve, rms over its whole range, and its standard error, from the coefficients.

    Args:
        sizes: shown unit, shape (p,).
        errors: standard errors, shape (p,).
        covariance: of the sizes, shape (p, p); where it is left out, they count as independent.
    """
    rms = float(np.sqrt((sizes**2).sum()))
    spread = np.diag(errors**2) if covariance is None else covariance
    return rms, float(np.sqrt(max(float(sizes @ spread @ sizes), 0.0))) / max(rms, 1e-300)


def _in_unit(steep: SteepPart, span: Range) -> SteepPart:
    """A part given in places of the range, in the shown unit."""
    at, low, high = (span.middle + span.reach * one for one in (steep.at, *steep.between))
    width = None if steep.width is None else span.reach * steep.width
    return replace(steep, at=at, between=(low, high), width=width)


def _steepest(
    place: FloatArray,
    columns: FloatArray,
    sizes: FloatArray,
    covariance: FloatArray,
    measured: Measured,
    *,
    straight: bool,
) -> SteepPart | None:
    """The part where the curve changes, in places of the range; None where none stands out.

    Args:
        place: at which the curve is drawn, shape (n,).
        columns: the curve there per coefficient, shape (n, p).
        sizes: of the coefficients, shape (p,).
        covariance: of the sizes, shape (p, p).
        measured: where.
        straight: the base model takes any straight line.
    """
    step, held = place[1] - place[0], np.clip(measured.places, -1.0, 1.0)
    slopes = np.diff(columns, axis=0) / step
    if straight:
        own = slopes @ sizes
        alike = np.argsort(np.abs(own - median(own)), kind="stable")[: len(own) // 2]
        slopes = slopes - slopes[alike].mean(axis=0)
    own = slopes @ sizes
    parts = []
    for first, last in _steep_stretches(own):
        rise = step * slopes[first:last].sum(axis=0)
        height, error = float(rise @ sizes), float(np.sqrt(rise @ covariance @ rise))
        if abs(height) > MIN_RISE_IN_ERRORS * error:
            parts.append((first, last, height, error))
    bump = len(parts) == 2 and parts[0][2] * parts[1][2] < 0.0
    if not parts or (len(parts) > 1 and not bump):
        return None

    def crossing(part: tuple[int, int, float, float], share: float) -> float:
        first, last, height, _ = part
        gone = step * np.cumsum(own[first:last]) / height
        return float(place[first + 1 + int(np.argmax(gone >= share))])

    shares = (0.5, 0.5) if bump else STEP_SHARES
    left, right = crossing(parts[0], shares[0]), crossing(parts[-1], shares[1])
    highest = max(parts, key=lambda part: abs(part[2]))
    inside = held[(held >= left) & (held <= right)]
    below, above = held[held < left], held[held > right]
    width = right - left
    gaps = np.diff([left, *inside, right])
    known = len(inside) >= MIN_HOLDS_INSIDE and float(gaps.max()) <= MAX_GAP * width
    return SteepPart(
        at=0.5 * (left + right),
        rise=abs(highest[2]),
        rise_error=highest[3],
        width=width if known else None,
        between=(
            float(below[-1] if len(below) else held[0]),
            float(above[0] if len(above) else held[-1]),
        ),
        inside=len(inside),
        bump=bump,
        sharp=known and bool(width <= MAX_SHARP_WIDTH * (held[-1] - held[0])),
        word=measured.word,
    )


def _steep_stretches(slopes: FloatArray) -> Iterator[tuple[int, int]]:
    """First and last place of each stretch of one sense that is about as steep as the steepest."""
    largest = float(np.abs(slopes).max(initial=0.0))
    ends = np.flatnonzero(np.diff(np.sign(slopes))) + 1
    for first, last in itertools.pairwise([0, *ends.tolist(), len(slopes)]):
        own = np.abs(slopes[first:last])
        if largest > 0.0 and own.max() >= MIN_STEEP_SHARE * largest:
            peak, least = int(own.argmax()), MIN_SLOPE_OF_PART * float(own.max())
            before = np.flatnonzero(own[:peak] < least)
            after = np.flatnonzero(own[peak:] < least)
            begin = first + (int(before[-1]) + 1 if len(before) else 0)
            yield begin, first + peak + int(after[0]) if len(after) else last
