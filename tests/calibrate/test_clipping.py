"""Rotations that reach the end of the gyroscope's range."""

import numpy as np

from imucal_wizard.measurement.clipping import RateSegment, clipped_motions

END = np.radians(100.0)
STEP = END / 2048.0
"""A range below the smallest common one, by a converter of 12 bits."""


def _turn(axis: int, peak: float, bias: np.ndarray) -> RateSegment:
    """A smooth turn of two seconds at 100 samples/s, °/s at its fastest."""
    time = np.arange(200) / 100.0
    rate = np.tile(bias, (200, 1))
    rate[:, axis] += np.radians(peak) * np.sin(np.pi * time / 2.0) ** 2
    read = np.round(np.clip(rate, -END, END - STEP) / STEP) * STEP
    return RateSegment(time, read, bias, np.array([0.0, 0.0, 9.8]), np.array([0.0, 9.8, 0.0]))


def test_the_end_of_the_range_is_as_far_from_rest_on_all_axes() -> None:
    """Nearly all turns are about x in one sense: its middle reading is no reading at rest."""
    bias = np.radians([3.0, 0.0, -1.0])
    axes = "x" * 12 + "yyzz"
    peaks = [60.0, 70.0, 80.0, 90.0, 130.0, 85.0, 75.0, 92.0, 65.0, 120.0, 90.0, 80.0]
    peaks += [130.0, 125.0, 120.0, 125.0]
    turns = list(zip(axes, peaks, strict=True))
    found = clipped_motions([_turn("xyz".index(a), p, bias) for a, p in turns], "rad/s")
    assert found == [a if p > 110.0 else None for a, p in turns]


def _on_a_table(axis: int, level: float, steps: int) -> RateSegment:
    """A turn that begins and ends within four samples and stands at a rate in between."""
    ramp = np.array([0.0, 0.001, 0.2, 0.4, 0.6, 0.8])
    profile = np.concatenate([ramp, np.ones(steps), ramp[::-1]])
    rate = np.radians(level * profile[:, None] * np.eye(3)[axis])
    time = np.arange(len(rate)) / 25.0
    angle = float(np.radians(level * profile.sum() / 25.0))
    # gravity is across the axis and turns the other way
    along, across = np.eye(3)[axis - 2], np.eye(3)[axis - 1]
    after = np.cos(angle) * along - np.sin(angle) * across
    return RateSegment(time, rate, np.zeros(3), 9.81 * along, 9.81 * after)


def test_a_table_that_stands_at_several_rates_reaches_no_end_of_the_range() -> None:
    """Each axis stands at slower and at faster rates; the fastest is long and loses nothing."""
    turns = [(a, p, n) for a in range(3) for p, n in ((210.0, 5), (290.0, 5), (294.0, 40))]
    assert clipped_motions([_on_a_table(*one) for one in turns], "rad/s") == [None] * len(turns)
