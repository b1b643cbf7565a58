"""Residuals against whatever they may depend on: the pictures in which one sees what is missing."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from imucal_wizard.procedure.poses import DIRECTIONS, POSE_TOLERANCE_DEG, nearest
from imucal_wizard.readings import FloatArray, IntArray
from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.fit import Measured
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.tui.bench.compared import TITLES, compared
from imucal_wizard.tui.bench.field_views import field_abscissae
from imucal_wizard.tui.report_rows import SHOWN
from imucal_wizard.units import STANDARD_GRAVITY

AXES = "xyz"
HOLDS, TURNS = "holds", "turns"
DIRECTIONS_SEEN, DIPS = "magnitude of the field", "dip at rest"
STILL = tuple(f"at rest, {axis} axis" for axis in AXES)
"""Parts of the data, each with pictures of its own."""


@dataclass(frozen=True, eq=False)
class View:
    """Points to draw.

    Attributes:
        part: which part of the data.
        title: what is drawn.
        x_label: what it is drawn over, with its unit.
        unit: of y, as shown.
        x: shape (n,), in order.
        y: shape (n,).
        source: index of each point's hold or rotation, shape (n,).
        floor: what the noise alone makes of y, one standard deviation; None when not known.
        slope: y per x of a line through the origin, or None.
        model: what the model says, shape (n,), where the points are what was measured; or None.
    """

    part: str
    title: str
    x_label: str
    unit: str
    x: FloatArray
    y: FloatArray
    source: IntArray
    floor: float | None
    slope: float | None = None
    model: FloatArray | None = None


def views_of(fit: Extended, measured: Measured) -> tuple[View, ...]:
    """All pictures of what a fit leaves, then measurement beside model, by part of the data."""
    left = (view for part in parts_of(fit) for view in _views(fit, measured, part))
    return (*left, *_beside(fit, measured))


def parts_of(fit: Extended) -> tuple[str, ...]:
    """The parts of the data that a fit has rows of."""
    kinds = {row.kind for row in fit.linear.rows}
    if "hold" in kinds:
        return (HOLDS,)
    if "field" in kinds:
        return (DIRECTIONS_SEEN, DIPS) if "dip" in kinds else (DIRECTIONS_SEEN,)
    turns = (TURNS,) if "rotation" in kinds else ()
    return turns + (STILL if "still" in kinds else ())


@dataclass(frozen=True, eq=False)
class Left:
    """What is left of one part, in shown units; y, floor and source have shape (n,)."""

    y: FloatArray
    floor: float
    unit: str
    source: IntArray


def left_of(fit: Extended, part: str) -> Left:
    """What a fit leaves of one part of the data: holds, turns or an axis at rest."""
    linear, rows = fit.linear, fit.linear.rows
    wanted = np.flatnonzero([_part(row.kind, row.axis) == part for row in rows])
    factor, unit = SHOWN["rad/s" if part in STILL else fit.fit.unit]
    values = (linear.residual * linear.sigma)[wanted] * factor
    source = np.array([rows[i].index for i in wanted], np.int64)
    floor = factor * float(np.sqrt(np.mean(linear.floor[wanted] ** 2)))
    if part != TURNS:
        return Left(values, floor, unit, source)
    each = np.unique(source)
    closure = np.array([np.linalg.norm(values[source == one]) for one in each])
    return Left(closure, floor * np.sqrt(2.0), unit, each)


def _part(kind: str, axis: int | None) -> str:
    if kind == "still":
        return STILL[axis or 0]
    return {"hold": HOLDS, "field": DIRECTIONS_SEEN, "dip": DIPS}.get(kind, TURNS)


def _views(fit: Extended, measured: Measured, part: str) -> Iterator[View]:
    left = left_of(fit, part)
    what = "the angle by which each turn does not close" if part == TURNS else "what is left"
    for label, values in abscissae(measured, part, left.source):
        order = _in_order(values)
        if len(order):
            yield View(
                part, what, label, left.unit, values[order], left.y[order], left.source[order],
                left.floor,
            )  # fmt: skip


def _in_order(values: FloatArray) -> IntArray:
    """Places of the values that are known, by size; none where they do not differ."""
    seen = np.isfinite(values)
    least = 1e-9 * max(1.0, float(np.abs(values[seen]).max(initial=0.0)))
    if seen.sum() < 2 or np.ptp(values[seen]) < least:
        return np.zeros(0, np.int64)
    return np.flatnonzero(seen)[np.argsort(values[seen], kind="stable")]


def _beside(fit: Extended, measured: Measured) -> Iterator[View]:
    """Measurement and model of each axis, over its own input first."""
    source = np.arange(len(measured.circumstances))
    if isinstance(measured, TurnData):
        source = measured.still_rows
    for k, (part, unit, read, model) in enumerate(compared(fit, measured)):
        over = list(abscissae(measured, part, source))
        for label, values in (over[k], *over[:k], *over[k + 1 :]):
            order = _in_order(values)
            if len(order):
                yield View(
                    part, TITLES[fit.fit.sensor], label, unit, values[order], read[order],
                    source[order], None, model=model[order],
                )  # fmt: skip


def abscissae(measured: Measured, part: str, source: IntArray) -> Iterator[tuple[str, FloatArray]]:
    """What the residuals may depend on, each with its label; shape (n,) like ``source``."""
    known = measured.circumstances
    if isinstance(measured, FieldData):
        yield from field_abscissae(measured, source)
        return
    if isinstance(measured, TurnData):
        if part == TURNS:
            yield from _of_turns(measured, source)
            return
        row = np.searchsorted(measured.still_rows, source)
    else:
        row = source
    for k, axis in enumerate(AXES):
        yield f"force along {axis}, g", known.force[row, k] / STANDARD_GRAVITY
    yield "pose: 6 faces, 12 edges, 8 corners", _poses(known.force[row])
    yield "number of the pose", np.asarray(source + 1.0, np.float64)
    yield "time, min", known.time[row] / 60.0
    yield "temperature, °C", known.temperature[row]
    for k, axis in enumerate(AXES):
        yield f"force along {axis} in the pose before, g", known.previous[row, k] / STANDARD_GRAVITY
    yield "vibration, mg rms", np.sqrt(known.vibration[row]) / STANDARD_GRAVITY * 1e3


def _poses(force: FloatArray) -> FloatArray:
    """Place of each hold's pose among the named ones from 1 on; NaN between them, shape (n,)."""
    names = [nearest(one, DIRECTIONS, POSE_TOLERANCE_DEG) for one in force]
    order = list(DIRECTIONS)
    return np.array([np.nan if name is None else order.index(name) + 1.0 for name in names])


def _of_turns(measured: TurnData, source: IntArray) -> Iterator[tuple[str, FloatArray]]:
    """The same of turns: rate, number, time, temperature, up before."""
    place = np.searchsorted(measured.rotations, source)
    motion, offsets = measured.motion, measured.samples.offsets
    speed = np.degrees(np.linalg.norm(motion.rate, axis=1))
    yield "fastest rate, °/s", np.maximum.reduceat(speed, offsets[:-1])[place]
    for k, axis in enumerate(AXES):
        rate = np.degrees(motion.rate[:, k])
        mean = np.add.reduceat(rate, offsets[:-1]) / np.diff(offsets)
        yield f"mean rate about {axis}, °/s", mean[place]
    yield "number of the turn", np.asarray(source + 1.0, np.float64)
    yield "time, min", motion.time[offsets[:-1]][place] / 60.0
    yield "temperature, °C", motion.temperature[offsets[:-1]][place]
    for k, axis in enumerate(AXES):
        yield f"{axis} part of up before the turn, g", measured.before[place, k]
