"""The shape of a free curve: its abscissa, and the place, width and height of its steep part.

Bias and scale take any straight line of it, so that only changes of slope are reported. The slope
is relative to that of the half of the curve where it is most alike. Where it stays above half of
its largest value lies the part that changes: one such part is a step, two of opposite sense beside
each other are a bump, more are a wave. The curve itself is smoother than what it follows, so that
place and width are those of the likeliest smooth step or bump, by the likelihood of the data that
the coefficients and their covariance carry once their prior is taken out. A width is given only if
at least ``MIN_HOLDS_INSIDE`` holds lie inside it, spread over it: with fewer the curve between the
holds is a guess, and only the holds on either side are named.
"""

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from imucal_wizard.core.quantities import fixed, number, plus_minus, with_unit
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.estimate.distributions import chi_square
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
WIDTHS: FloatArray = np.geomspace(0.02, 1.5, 60)
"""That are tried, in halves of the range: of a step between 10 and 90 % of its height, of a bump at
half its height. The narrowest is below the distance of the nodes of a curve."""
MAX_DEVIATIONS = 3.0
"""Of a normal variable: a step or a bump that leaves more than noise leaves in one of 740 is none.
The nodes of a curve and the shapes tried are no closer to the truth."""
COARSE, FINE = 41, 11
"""Places that are tried for a step or bump: over the range, and between neighbours of the best."""
MAX_WIDTH_LOSS = 3.32
"""Of log likelihood, of the widths of an interval: half the 99 % quantile of χ² with one degree of
freedom. 95 % would be too narrow, because length and size of the curve were chosen with the same
data."""
MIN_SHARE_OF_DATA = 0.01
"""Of the precision along a coefficient: where the data have less, the prior alone is known."""
MIN_SINGULAR_VALUE = 1e-3
"""Singular value, over the largest, below which values at places determine no coefficient."""
PLACES = 101
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
        width: the likeliest, between 10 and 90 % of a step, or at half the height of a bump; None
            where too few holds lie inside.
        width_interval: the least and the largest width that the data do not reject; the least is 0
            where they reject none, however narrow.
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
    width_interval: tuple[float, float]
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
        least, most = (number(one, 1) for one in steep.width_interval)
        wide = f"{least} to {most}" if steep.width_interval[0] > 0.0 else f"at most {most}"
        wide = f"about {most}" if least == most else wide
        inside = f"{steep.inside} {steep.word}s lie inside"
        return f"{what} at {at} {unit}, {wide} {unit} wide ({inside})"


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
    straight = place[:, None] ** np.arange(float(curve.lines))
    typical = curve.typical(sensor, variant)
    steep = _steepest(place, columns, sizes, covariance, measured, straight, typical)
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
    least, most = (span.reach * one for one in steep.width_interval)
    return replace(steep, at=at, between=(low, high), width=width, width_interval=(least, most))


@dataclass(frozen=True, eq=False)
class _Data:
    """What the data say of the coefficients c: log likelihood = pull·c − ½ |root c|².

    Attributes:
        root: shape (p, p).
        pull: shape (p,).
    """

    root: FloatArray
    pull: FloatArray

    @property
    def largest(self) -> float:
        """Log likelihood of the best curve of all."""
        return 0.5 * float(np.linalg.norm(np.linalg.pinv(self.root.T) @ self.pull) ** 2)

    def multiples(self, columns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """The best multiple of each of these columns (p, n), and its standard error, each (n,)."""
        precision = np.maximum(((self.root @ columns) ** 2).sum(axis=0), 1e-300)
        return self.pull @ columns / precision, precision**-0.5


def _without_prior(typical: FloatArray, sizes: FloatArray, covariance: FloatArray) -> _Data:
    """The data behind coefficients that a Gaussian prior was joined to.

    Their precision is that of the data and of the prior together.
    """
    values, vectors = np.linalg.eigh(covariance)
    kept = values > 1e-12 * max(float(values.max(initial=0.0)), 1e-300)
    spread = vectors[:, kept] * np.sqrt(values[kept])
    back = vectors[:, kept] / np.sqrt(values[kept])
    prior = (spread / typical[:, None] ** 2).T @ spread
    share, turned = np.linalg.eigh(np.eye(len(prior)) - prior)
    told = share > MIN_SHARE_OF_DATA
    axes = (back @ turned[:, told]).T
    return _Data(np.sqrt(share[told])[:, None] * axes, axes.T @ (axes @ sizes))


def _steepest(
    place: FloatArray,
    columns: FloatArray,
    sizes: FloatArray,
    covariance: FloatArray,
    measured: Measured,
    straight: FloatArray,
    typical: FloatArray,
) -> SteepPart | None:
    """The part where the curve changes, in places of the range; None where none stands out.

    Args:
        place: at which the curve is drawn, shape (n,).
        columns: the curve there per coefficient, shape (n, p).
        sizes: of the coefficients, shape (p,).
        covariance: of the sizes, shape (p, p).
        measured: where.
        straight: what the base model takes, shape (n, 1 or 2).
        typical: prior standard deviation of the coefficients, shape (p,).
    """
    step, held = place[1] - place[0], np.clip(measured.places, -1.0, 1.0)
    slopes = np.diff(columns, axis=0) / step
    if straight.shape[1] > 1:
        own = slopes @ sizes
        alike = np.argsort(np.abs(own - median(own)), kind="stable")[: len(own) // 2]
        slopes = slopes - slopes[alike].mean(axis=0)
    rises = []
    for first, last in _steep_stretches(slopes @ sizes):
        rise = step * slopes[first:last].sum(axis=0)
        if abs(rise @ sizes) > MIN_RISE_IN_ERRORS * np.sqrt(rise @ covariance @ rise):
            rises.append(float(rise @ sizes))
    if not rises or len(rises) > 2 or (len(rises) == 2 and rises[0] * rises[1] > 0.0):
        return None
    # where less than the whole range was measured, values there determine no rough coefficient
    scaled = np.hstack([columns * typical, straight])
    solved = typical[:, None] * np.linalg.pinv(scaled, rcond=MIN_SINGULAR_VALUE)[: len(typical)]
    data = _without_prior(typical, sizes, covariance)
    if not data.root.size:  # no errors are known
        return None
    likeliest = [_likeliest(place, solved, data, bump=bump) for bump in (False, True)]
    bump = bool(likeliest[1].gains.max() > likeliest[0].gains.max())
    one = likeliest[bump]
    best = int(one.gains.argmax())
    at, width = float(one.at[best]), float(WIDTHS[best])
    (kept,) = np.nonzero(one.gains > one.gains[best] - MAX_WIDTH_LOSS)
    least, most = int(kept[0]) - 1, int(kept[-1]) + 1
    left_over = 2.0 * (data.largest - float(one.gains[best]))
    freedom = len(data.root)
    if most == len(WIDTHS) or left_over > freedom * chi_square(MAX_DEVIATIONS, freedom):
        return None  # it is as wide as the range, or neither a step nor a bump
    interval = float(WIDTHS[least]) if least >= 0 else 0.0, float(WIDTHS[most])
    weights = np.exp(one.gains[kept] - one.gains[best])
    height = float(np.average(one.height[kept], weights=weights))
    spread = one.error[kept] ** 2 + (one.height[kept] - height) ** 2
    left, right = at - 0.5 * width, at + 0.5 * width
    inside = held[(held >= left) & (held <= right)]
    below, above = held[held < left], held[held > right]
    gaps = np.diff([left, *inside, right])
    known = len(inside) >= MIN_HOLDS_INSIDE and float(gaps.max()) <= MAX_GAP * width
    return SteepPart(
        at=at,
        rise=abs(height),
        rise_error=float(np.sqrt(np.average(spread, weights=weights))),
        width=width if known else None,
        width_interval=interval,
        between=(
            float(below[-1] if len(below) else held[0]),
            float(above[0] if len(above) else held[-1]),
        ),
        inside=len(inside),
        bump=bump,
        sharp=known and bool(interval[1] <= MAX_SHARP_WIDTH * (held[-1] - held[0])),
        word=measured.word,
    )


@dataclass(frozen=True, eq=False)
class _Likeliest:
    """Smooth steps or bumps of each of ``WIDTHS``, all of its shape.

    Attributes:
        gains: log likelihood.
        at: the best place.
        height: the best height.
        error: its standard error.
    """

    gains: FloatArray
    at: FloatArray
    height: FloatArray
    error: FloatArray


def _likeliest(place: FloatArray, solved: FloatArray, data: _Data, *, bump: bool) -> _Likeliest:
    """The likeliest place and height of a smooth step or bump of each width.

    Args:
        place: at which the curve is drawn, shape (n,).
        solved: coefficients per value there, shape (p, n).
        data: what they say of the coefficients.
        bump: ``exp(−4 ln 2 (u − at)² / width²)``, else ``½ tanh(ln 9 (u − at) / width)``.
    """

    def best_of(ats: FloatArray) -> _Likeliest:
        apart = (place[:, None, None] - ats) / WIDTHS[:, None]
        shape = np.exp(-4.0 * np.log(2.0) * apart**2)
        shape = shape if bump else 0.5 * np.tanh(np.log(9.0) * apart)
        height, error = (
            one.reshape(len(WIDTHS), -1)
            for one in data.multiples(solved @ shape.reshape(len(place), -1))
        )
        # of a part that lies outside what was measured the height is a guess
        room = np.minimum(ats - place[0], place[-1] - ats) >= 0.5 * WIDTHS[:, None]
        gains = np.where(room, 0.5 * (height / error) ** 2, 0.0)
        best = np.arange(len(WIDTHS)), gains.argmax(axis=1)
        return _Likeliest(gains[best], ats[best[1]], height[best], error[best])

    ats = np.linspace(place[0], place[-1], COARSE)
    coarse = best_of(ats)
    near = coarse.at[int(coarse.gains.argmax())] + (ats[1] - ats[0]) * np.linspace(-1.0, 1.0, FINE)
    fine = best_of(np.clip(near, place[0], place[-1]))
    closer = fine.gains >= coarse.gains
    return _Likeliest(
        *(
            np.where(closer, getattr(fine, name), getattr(coarse, name))
            for name in ("gains", "at", "height", "error")
        )
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
