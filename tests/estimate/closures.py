"""Rotations between known directions, as rows of closures."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.core.attitude import rotation_samples
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.rows.field_closure import FieldClosure, HeadingRows
from imucal_wizard.model.rows.gravity_closure import ClosureRows, GravityClosure
from imucal_wizard.model.rows.source import Parameters, RowLabels
from imucal_wizard.model.terms import Terms

NO_EFFECTS = Terms("gyroscope", ())


def closures(
    times: Sequence[FloatArray],
    readings: Sequence[FloatArray],
    before: FloatArray,
    after: FloatArray,
) -> GravityClosure:
    """Rotations with the true direction before and after each, shape (m, 3)."""
    samples, count = rotation_samples(times, readings), len(before)
    unknown = np.full((len(samples.time), 3), np.nan)
    zeros = np.zeros(len(samples.time))
    motion = Circumstances(unknown, unknown, zeros, samples.time, unknown, zeros)
    numbers = np.repeat(np.arange(count), 2)
    spans = np.zeros((2 * count, 2))
    labels = RowLabels(numbers, numbers, numbers, numbers, spans[:, 0], spans, numbers * 0)
    none = np.zeros((count, 3, 0))
    noise = np.ones(count)
    return GravityClosure(samples, before, after, none, none, noise, motion, 9.80665, labels)


def headings(by_gravity: GravityClosure, by_field: GravityClosure) -> FieldClosure:
    """The same rotations about the vertical."""
    numbers = np.arange(len(by_gravity.before))
    spans = np.zeros((len(numbers), 2))
    labels = RowLabels(numbers, numbers, numbers, numbers, spans[:, 0], spans, numbers * 0)
    holds = np.column_stack([numbers, numbers + 1])
    steady, known = np.zeros((3, int(holds.max()) + 1, 3)), np.zeros((int(holds.max()) + 1, 3, 0))
    return FieldClosure(by_gravity, by_field, holds, np.ones(len(numbers)), labels, steady, known)


def closed(source: GravityClosure, matrix: FloatArray, bias: FloatArray) -> ClosureRows:
    """The closures at one calibration."""
    return source.at(Parameters(matrix, bias), NO_EFFECTS)


def turned(source: FieldClosure, matrix: FloatArray, bias: FloatArray) -> HeadingRows:
    """The headings at one calibration."""
    return source.at(Parameters(matrix, bias), NO_EFFECTS)
