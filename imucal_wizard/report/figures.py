"""Figures of the calibration report as SVG with a text alternative.

A few dots and lines need no plotting library: drawn here they take the font of the page, stay text
that can be searched, and a report opens without a second of imports.
"""

import math
from collections.abc import Sequence
from html import escape

import numpy as np

from imucal_wizard.core.quantities import fixed, number, with_unit
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import root_mean_square

WIDTH, HEIGHT = 640, 240
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 16, 14, 44
MAX_TICKS = 8
MAX_BAND_RATIO = 6.0
"""Limit over the largest value beyond which it is not drawn: it would flatten the values."""


@dataclass(frozen=True, eq=False)
class Figure:
    """A figure with what it says in words.

    Attributes:
        title: what is shown.
        text: the text alternative, in sentences.
        svg: the drawing.
    """

    title: str
    text: str
    svg: str


@dataclass(frozen=True)
class _Axis:
    """One axis: where a value lies, and its ticks."""

    low: float
    high: float
    start: float
    end: float
    logarithmic: bool = False
    whole: bool = False

    def at(self, value: float) -> float:
        low, high = self.low, self.high
        if self.logarithmic:
            value, low, high = (math.log10(one) for one in (value, low, high))
        return self.start + (value - low) / ((high - low) or 1.0) * (self.end - self.start)

    def ticks(self) -> list[float]:
        if self.logarithmic:
            first, last = math.ceil(math.log10(self.low)), math.floor(math.log10(self.high))
            return [10.0**power for power in range(first, last + 1)]
        rough = max((self.high - self.low) / MAX_TICKS, float(self.whole))
        power = 10.0 ** math.floor(math.log10(rough))
        step = next(s * power for s in (1.0, 2.0, 5.0, 10.0) if s * power >= rough * 0.999)
        count = math.ceil(self.low / step)
        return [k * step for k in range(count, math.floor(self.high / step + 1e-9) + 1)]


def _frame(x: _Axis, y: _Axis, x_label: str, y_label: str) -> list[str]:
    """Axes with ticks and labels."""
    centre, middle = (_LEFT + WIDTH - _RIGHT) / 2, (_TOP + HEIGHT - _BOTTOM) / 2
    turned = f"rotate(-90 14 {middle:.0f})"
    parts = [f'<path class="axis" d="M{_LEFT} {_TOP}V{HEIGHT - _BOTTOM}H{WIDTH - _RIGHT}"/>']
    parts.append(_words(centre, HEIGHT - 6, x_label))
    parts.append(_words(14, middle, y_label, f' transform="{turned}"'))
    for value in y.ticks():
        at = y.at(value)
        parts.append(f'<path class="grid" d="M{_LEFT} {at:.1f}H{WIDTH - _RIGHT}"/>')
        parts.append(f'<text x="{_LEFT - 6}" y="{at + 4:.1f}" class="end">{_tick(value)}</text>')
    for value in x.ticks():
        at = x.at(value)
        parts.append(_words(at, HEIGHT - _BOTTOM + 16, _tick(value)))
    return parts


def _words(x: float, y: float, text: str, more: str = "") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" class="mid"{more}>{escape(text)}</text>'


def _tick(value: float) -> str:
    if value and not 1e-3 <= abs(value) < 1e5:
        return number(value, 2)
    places = 0 if value == 0 else max(0, 1 - math.floor(math.log10(abs(value))))
    text = fixed(value, places)
    return text.rstrip("0").rstrip(".") if "." in text else text


def _drawn(identity: str, title: str, text: str, parts: Sequence[str]) -> Figure:
    head = (
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-labelledby="{identity}-t '
        f'{identity}-d" xmlns="http://www.w3.org/2000/svg"><title id="{identity}-t">'
        f'{escape(title)}</title><desc id="{identity}-d">{escape(text)}</desc>'
    )
    return Figure(title, text, head + "".join(parts) + "</svg>")


def residual_figure(
    identity: str,
    title: str,
    values: FloatArray,
    names: Sequence[str],
    unit: str,
    limit: float | None,
    x_label: str,
) -> Figure:
    """Errors one by one, with the limit of use where it is near.

    Args:
        identity: unique in the document.
        title: what is shown.
        values: shape (n,), in ``unit``.
        names: of the values, for the text.
        unit: display unit.
        limit: in ``unit``, or None.
        x_label: what the values are counted in.
    """
    largest = int(np.abs(values).argmax())
    rms = root_mean_square(values)
    reach = float(np.abs(values).max()) or 1.0
    near = limit is not None and limit < MAX_BAND_RATIO * reach
    reach = 1.12 * max(reach, limit if near and limit is not None else 0.0)
    signed = bool((values < 0.0).any())
    x = _Axis(0.4, len(values) + 0.6, _LEFT, WIDTH - _RIGHT, whole=True)
    y = _Axis(-reach if signed else 0.0, reach, HEIGHT - _BOTTOM, _TOP)
    parts = _frame(x, y, x_label, f"error in {unit}")
    zero = y.at(0.0)
    parts.append(f'<path class="axis" d="M{_LEFT} {zero:.1f}H{WIDTH - _RIGHT}"/>')
    if near and limit is not None:
        for edge in (limit, -limit) if signed else (limit,):
            at = y.at(edge)
            parts.append(f'<path class="limit" d="M{_LEFT} {at:.1f}H{WIDTH - _RIGHT}"/>')
        parts.append(
            f'<text x="{WIDTH - _RIGHT}" y="{y.at(limit) - 4:.1f}" class="end">limit of use</text>'
        )
    for place, value in enumerate(values, start=1):
        across, up = x.at(place), y.at(float(value))
        parts.append(f'<path class="stem" d="M{across:.1f} {zero:.1f}V{up:.1f}"/>')
        parts.append(f'<circle class="dot" cx="{across:.1f}" cy="{up:.1f}" r="3"/>')
    beyond = ""
    if limit is not None:
        count = int((np.abs(values) > limit).sum()) or "None"
        beyond = f" {count} of them exceeds" if count in (1, "None") else f" {count} of them exceed"
        beyond += f" the limit of use, {with_unit(number(limit, 2), unit)}."
    text = (
        f"{len(values)} values; rms {with_unit(number(rms, 3), unit)}; the largest is "
        f"{with_unit(number(float(values[largest]), 3), unit)}, {names[largest]}.{beyond}"
    )
    return _drawn(identity, title, text, parts)


def allan_figure(
    identity: str,
    title: str,
    taus: FloatArray,
    axes: dict[str, FloatArray],
    unit: str,
    longest: float = math.inf,
) -> Figure:
    """Allan deviations against τ, both logarithmic.

    Args:
        identity: unique in the document.
        title: what is shown.
        taus: s, shape (t,).
        axes: deviation of each axis, ``unit``, shape (t,); NaN where it is hardly known.
        unit: display unit.
        longest: τ up to which the least deviation is known well, s.
    """
    every = np.concatenate(list(axes.values()))
    every = every[every > 0.0]
    known = np.isfinite(np.array(list(axes.values()))).any(axis=0)
    ends = float(taus[known].min()), float(taus[known].max())
    x = _Axis(*ends, _LEFT, WIDTH - _RIGHT, logarithmic=True)
    low, high = 0.8 * float(every.min()), 1.25 * float(every.max())
    y = _Axis(low, high, HEIGHT - _BOTTOM, _TOP, logarithmic=True)
    parts = _frame(x, y, "τ in s", f"Allan deviation in {unit}")
    for k, (axis, values) in enumerate(axes.items()):
        drawn = values > 0.0
        points = " ".join(
            f"{x.at(float(t)):.1f},{y.at(float(v)):.1f}"
            for t, v in zip(taus[drawn], values[drawn], strict=True)
        )
        parts.append(f'<polyline class="line line{k}" points="{points}"/>')
        at = WIDTH - _RIGHT - 70 + 24 * k
        parts.append(f'<path class="line line{k}" d="M{at} {_TOP + 6}h10"/>')
        parts.append(f'<text x="{at + 12}" y="{_TOP + 10}">{escape(axis)}</text>')
    least = []
    for axis, values in axes.items():
        well = np.where(taus <= longest, values, np.nan)
        if (well > 0.0).any():
            place = int(np.nanargmin(well))
            size, tau = number(float(well[place]), 2), number(float(taus[place]), 2)
            least.append(f"{axis}: {size} {unit} at {tau} s")
    text = f"The largest deviation is {number(float(every.max()), 2)} {unit}" + (
        f"; the least: {', '.join(least)}." if least else "."
    )
    return _drawn(identity, title, text, parts)
