"""Rotations that reach the end of the gyroscope's range."""

import numpy as np
import pytest

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


def test_an_axis_that_reads_more_in_another_turn_was_not_at_the_end_of_its_range() -> None:
    """Few samples of a table stand at a rate as exactly as at the end; no turn is long enough."""
    turns = [(a, p, 4) for a in range(3) for p in (210.0, 294.0)]
    found = clipped_motions([_on_a_table(*one) for one in turns], "rad/s")
    assert found[::2] == [None] * 3


WIDE = np.radians(250.0)
"""A usual range, rad/s."""


def _by_hand(
    axis: int, peak: float, seconds: float, ramp: float = 0.1, scale: float = 1.0
) -> RateSegment:
    """A turn that reaches a rate, °/s, within ``ramp`` s, read with this scale up to ±250 °/s."""
    time = np.arange(-2, round(100.0 * seconds) + 1) / 100.0
    share = np.clip(np.minimum(time, seconds - time) / ramp, 0.0, 1.0)
    rate = np.radians(peak) * np.sin(0.5 * np.pi * share) ** 2
    angle, step = float(rate.sum()) / 100.0, WIDE / 2048.0
    read = np.round(np.clip(scale * rate, -WIDE, WIDE - step) / step) * step
    read[0] = step  # noise at rest shows the resolution
    # gravity is across the axis and turns the other way
    along, across = np.eye(3)[axis - 2], np.eye(3)[axis - 1]
    after = np.cos(angle) * along - np.sin(angle) * across
    turned = read[:, None] * np.eye(3)[axis]
    return RateSegment(time, turned, np.zeros(3), 9.81 * along, 9.81 * after)


@pytest.mark.parametrize("scale", [1.0 / 3.0, 1.0, 3.0])
@pytest.mark.parametrize(
    ("fast", "clipped"),
    [
        # each loses a fifth to a third of its angle
        ([(340.0, 0.6), (380.0, 0.5), (320.0, 0.6)], [0, 1, 2]),
        # the long ones lose a twentieth, as by a wrong scale: what they stand at may be the end
        ([(264.0, 0.7), (268.0, 0.7), (300.0, 0.22)], [2]),
    ],
)
def test_an_axis_is_clipped_however_wrong_the_scale_of_another_one_is(
    scale: float, fast: list[tuple[float, float]], clipped: list[int]
) -> None:
    """Slow turns about x and z say nothing about y where they disagree by more than clipping."""
    peaks = (60.0, 80.0, 100.0, 90.0)
    slow = [_by_hand(0, peak / max(scale, 1.0), 2.0, 1.0, scale) for peak in peaks]
    slow += [_by_hand(2, peak, 2.0, 1.0) for peak in peaks]
    found = clipped_motions([*slow, *(_by_hand(1, *one) for one in fast)], "rad/s")
    assert found[:8] == [None] * 8
    assert [found[8 + place] for place in clipped] == ["y"] * len(clipped)


def _printed(axis: int, peak: float, times: int, rng: np.random.Generator) -> RateSegment:
    """A turn of two seconds by a gyroscope of ±250 °/s that measures once in so many lines."""
    time, step = np.arange(200) / 100.0, WIDE / 32768.0
    rate = rng.normal(0.0, np.radians(0.1), (200, 3))
    rate[:, axis] += np.radians(peak) * np.sin(np.pi * time / 2.0) ** 2
    read = np.round(np.clip(rate, -WIDE, WIDE - step) / step) * step
    measured = np.arange(200) // times * times
    # gravity is across the axis and turns the other way
    along, across, angle = np.eye(3)[axis - 2], np.eye(3)[axis - 1], np.radians(peak)
    after = np.cos(angle) * along - np.sin(angle) * across
    return RateSegment(time, read[measured], np.zeros(3), 9.8 * along, 9.8 * after)


@pytest.mark.parametrize("times", [2, 3, 5])
def test_a_gyroscope_that_is_slower_than_the_lines_is_clipped_only_at_an_end(times: int) -> None:
    """Each reading stands for some lines, as at the end of the range."""
    rng = np.random.default_rng(times)
    slow = [_printed(k % 3, 60.0 + 6.0 * k, times, rng) for k in range(24)]
    assert clipped_motions(slow, "rad/s") == [None] * len(slow)
    fast = [_printed(1, peak, times, rng) for peak in (400.0, 500.0)]
    assert clipped_motions([*slow, *fast], "rad/s") == [None] * len(slow) + ["y", "y"]
