"""Where each rest begins and ends, and the holds and rotations in summary.

A limit of stillness finds a rest, but another limit meets its ends a block sooner or later. So the
limit only shows that the device rests. The rest is all windows around its calmest one that exceed
neither the noise usual among them nor the resolution by more than a factor. It follows from the
samples alone: every limit that does not break the rest, in a file or in a stream, finds the same
blocks. The samples of a hold are not needed again.
"""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from imucal_wizard.core.limits.stillness import (
    FINER_TIMES,
    GUARD_BLOCKS,
    HISTORY_BLOCKS,
    LONGER_PIECE,
    MAX_SETTLING_SIGMA,
    MAX_SLOW_TO_FAST,
    MAX_SWAY,
    MAX_TRIMMED_BLOCKS,
    MIN_BLOCKS_TO_TRIM,
    MIN_HOLD_SECONDS,
    MIN_LONG_HOLD,
    MIN_SETTLING,
    MIN_SETTLING_AXIS,
    MIN_SLOW_MOMENT,
    MIN_SWAY,
    NOISE_FREQUENCIES,
    REST_FACTOR,
    SETTLING_SECONDS,
    SETTLING_TIMES,
    SHORTEST_AVERAGE,
    STEADY_SIGMA,
    TAIL_DOUBT,
    TIME_TOLERANCE,
    WINDOW_BLOCKS,
)
from imucal_wizard.core.readings import BoolArray, FloatArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import (
    SIGMA_PER_MEDIAN,
    complement,
    median_of_rows,
    true_on_all_axes,
)
from imucal_wizard.measurement.blocks import Blocks, join_blocks
from imucal_wizard.measurement.rounding import rounding_noise, rounding_variance
from imucal_wizard.measurement.stillness import Windows, join_windows


@dataclass(frozen=True, eq=False)
class Hold:
    """One period of rest.

    Attributes:
        start: time of the first sample, s.
        end: time just after the last sample, s.
        accelerometer: mean reading, shape (3,), m/s² or counts.
        accelerometer_covariance: covariance of that mean, shape (3, 3).
        gyroscope: mean reading, shape (3,), rad/s or counts; None without a gyroscope.
        gyroscope_covariance: covariance of that mean.
        samples: number of accelerometer samples averaged.
        temperature: mean temperature, °C, or None.
        pose: the named pose for which it was measured, or None.
        hand_held: recorded on the operator's command although the device was not still.
        accelerometer_scatter: variance of each axis of the accelerometer's mean if its samples were
            independent, shape (3,), or None; it has one degree of freedom per sample.
        gyroscope_scatter: the same of the gyroscope.
        noise_freedom: degrees of freedom per axis of the covariances.
        gyroscope_turn: integral of the gyroscope's reading less its mean from each moment of the
            hold to the end, averaged over the hold, reading × s, shape (3,), or None. With the mean
            it gives how far a swaying device turned from its mean direction to that at the end.
        gyroscope_order: what the order of turns adds to the integral of the reading from the
            beginning to the mean attitude, and from that to the end, reading × s, shape (2, 3), or
            None where it is not known.
        gyroscope_quiet: variance of the gyroscope's mean if its noise at all frequencies were that
            of those at which the device moves least, shape (3,), or None where it is not known.
        sway: covariance of the accelerometer's mean, of the mean integral of the gyroscope less its
            mean, and of the mean time, by low frequencies, shape (7, 7), or None: both sensors show
            how a device sways.
        allan_covariances: of the accelerometer by the differences between its means over halves,
            quarters, eighths … of the hold, whose diagonals are Allan variances, shape (k, 3, 3),
            or None where the hold is short.
        course: the accelerometer in consecutive pieces of the rest, before settling is taken off:
            length, s, and mean reading, shape (k, 4), or None where it is not known.
    """

    start: float
    end: float
    accelerometer: FloatArray
    accelerometer_covariance: FloatArray
    gyroscope: FloatArray | None
    gyroscope_covariance: FloatArray | None
    samples: int
    temperature: float | None = None
    pose: str | None = None
    hand_held: bool = False
    accelerometer_scatter: FloatArray | None = None
    gyroscope_scatter: FloatArray | None = None
    noise_freedom: int = 2 * NOISE_FREQUENCIES
    gyroscope_turn: FloatArray | None = None
    gyroscope_order: FloatArray | None = None
    gyroscope_quiet: FloatArray | None = None
    sway: FloatArray | None = None
    allan_covariances: FloatArray | None = None
    course: FloatArray | None = None

    def readings(self, series: Series) -> Series:
        """The samples of any sensor during this hold.

        ``end`` is the last sample's time plus one interval, a sum that may round past the next
        sample: a sample belongs to the hold up to half an interval before the end.
        """
        half = 0.5 * (self.end - self.start) / self.samples
        return series.between(self.start, self.end - half)


@dataclass(frozen=True, eq=False)
class Rotation:
    """The motion between two holds.

    Attributes:
        before: the hold before the motion.
        after: the hold after the motion.
        time: gyroscope sample times from inside ``before`` to inside ``after``, s, shape (n,).
        rate: gyroscope readings at these times, shape (n, 3), rad/s or counts.
        axis: the body axis of the rotation (``x``, ``y``, ``z``), or None for any other axis.
        accelerometer: accelerometer readings at these times, shape (n, 3), or None if not kept;
            with them the fit can start without the gyroscope's unit.
        problem: the reason why it cannot be used (a gap, clipping), or None.
    """

    before: Hold
    after: Hold
    time: FloatArray
    rate: FloatArray
    axis: str | None = None
    problem: str | None = None
    accelerometer: FloatArray | None = None


@dataclass(frozen=True, eq=False)
class Collected:
    """All measurements of the procedure: the input of the fit.

    Attributes:
        holds: all holds in time order.
        rotations: all motions between neighbouring holds, accepted and rejected.
        validation: holds withheld from the fit.
        magnetometer: all samples of the magnetometer in time order, or None without one.
        field_spans: time spans (from, to) of the field step, s, without withdrawn or disturbed
            parts.
        field_left_out: disturbed spans: from, to, s, and the reason.
        steps: resolution of each accelerometer and gyroscope axis over all samples, shape (3,)
            each, 0 if none was seen; None if it was not determined.
    """

    holds: tuple[Hold, ...]
    rotations: tuple[Rotation, ...]
    validation: tuple[Hold, ...] = ()
    magnetometer: Series | None = None
    field_spans: tuple[tuple[float, float], ...] = ()
    field_left_out: tuple[tuple[float, float, str], ...] = ()
    steps: tuple[FloatArray, FloatArray] | None = None


def hold_from(blocks: Blocks) -> Hold:
    """A hold from consecutive blocks at rest, guards already removed."""
    mean, covariance, freedom = mean_and_covariance(blocks.mean, blocks.moment)
    if blocks.turning:
        there = ~np.isnan(blocks.mean[:, 3])
        if not there.all() and 2 * there.sum() >= len(blocks):
            mean[3:], covariance[3:, 3:], _ = mean_and_covariance(
                blocks.mean[there, 3:], blocks.moment[there, 3:]
            )
    turning = blocks.turning and bool(np.isfinite(mean[3:]).all())
    known = blocks.temperature[~np.isnan(blocks.temperature)]
    samples = len(blocks) * blocks.size
    scatter = (blocks.variance + (blocks.mean - mean) ** 2).mean(axis=0) / (samples - 1)
    # the mean over t of the integral from t to the end weighs each moment by the time before it
    elapsed = (np.arange(len(blocks)) + 0.5) / len(blocks)
    turn = elapsed @ (blocks.mean - mean) + blocks.moment.mean(axis=0)
    turn *= (blocks.end[-1] - blocks.start[0]) / len(blocks)
    followed = turning and bool(np.isfinite(blocks.mean[:, 3:]).all())
    return Hold(
        start=float(blocks.start[0]),
        end=float(blocks.end[-1]),
        accelerometer=mean[:3],
        accelerometer_covariance=covariance[:3, :3],
        gyroscope=mean[3:] if turning else None,
        gyroscope_covariance=covariance[3:, 3:] if turning else None,
        samples=samples,
        temperature=float(known.mean()) if len(known) else None,
        accelerometer_scatter=scatter[:3],
        gyroscope_scatter=scatter[3:] if turning else None,
        noise_freedom=freedom,
        gyroscope_turn=turn[3:] if turning and np.isfinite(turn[3:]).all() else None,
        sway=_sway(blocks) if followed else None,
        allan_covariances=_allan_covariances(blocks),
    )


def _allan_covariances(blocks: Blocks) -> FloatArray | None:
    """See ``Hold``."""
    seconds = float(blocks.end[-1] - blocks.start[0])
    if seconds < MIN_LONG_HOLD or len(blocks) < 2 or not np.isfinite(blocks.mean_a).all():
        return None
    halvings = math.floor(math.log2(min(seconds / SHORTEST_AVERAGE, len(blocks))))
    edges = (np.arange(2**halvings) * len(blocks)) // 2**halvings
    number = np.diff(np.append(edges, len(blocks)))[:, None]
    means = np.add.reduceat(blocks.mean_a - blocks.mean_a[0], edges) / number
    found = []
    while len(means) > 1:
        apart = means[::2] - means[1::2]
        found.append(apart.T @ apart / (2.0 * len(apart)))
        means = 0.5 * (means[::2] + means[1::2])
    return np.array(found[::-1])


def _turned(blocks: Blocks, seconds: float) -> tuple[FloatArray, FloatArray]:
    """Mean rate of each block less that of all, and the mean in it of its integral, (m, 3) each.

    Args:
        blocks: consecutive ones.
        seconds: length of one.
    """
    rate = blocks.mean[:, 3:] - blocks.mean[:, 3:].mean(axis=0)
    # the mean of an integral over a block falls with the moment of what is integrated
    return rate, seconds * (np.add.accumulate(rate, axis=0) - 0.5 * rate - blocks.moment[:, 3:])


def _sway(blocks: Blocks) -> FloatArray:
    """See ``Hold``."""
    count, seconds = len(blocks), (blocks.end[-1] - blocks.start[0]) / len(blocks)
    rate, angle = _turned(blocks, seconds)
    elapsed = seconds * (np.arange(count)[:, None] + 0.5)
    over = np.hstack(
        [blocks.moment[:, :3], seconds / 12.0 * rate, np.full((count, 1), seconds / 12.0)]
    )
    return mean_and_covariance(np.hstack([blocks.mean_a, angle, elapsed]), over)[1]


def hold_at_rest(
    blocks: Blocks,
    gravity: float,
    step_a: FloatArray | float = 0.0,
    step_g: FloatArray | float | None = 0.0,
) -> Hold | None:
    """The hold in the blocks of a rest, guards removed; None if it is too short or drifts.

    Args:
        blocks: consecutive blocks.
        gravity: reading of one gravity.
        step_a: resolution of the accelerometer, if known.
        step_g: resolution of the gyroscope, if known.
    """
    if _too_short(blocks):
        return None
    rest = trim_ends(blocks, step_a, step_g)
    piece = settled(rest, step_a)
    if _too_short(piece) or drifts(piece, step_a, gravity):
        return None
    return replace(hold_from(piece), course=_course(rest))


def _course(blocks: Blocks) -> FloatArray:
    """See ``Hold``."""
    edges, length = [0], 1.0
    while len(blocks) - edges[-1] >= round(length) * (1.0 + LONGER_PIECE):
        edges.append(edges[-1] + round(length))
        length *= LONGER_PIECE
    number = np.diff([*edges, len(blocks)])
    force = np.add.reduceat(blocks.mean_a - blocks.mean_a[0], edges) / number[:, None]
    seconds = number * (blocks.end[-1] - blocks.start[0]) / len(blocks)
    return np.column_stack([seconds, blocks.mean_a[0] + force])


def _too_short(blocks: Blocks) -> bool:
    return bool(blocks.end[-1] - blocks.start[0] < MIN_HOLD_SECONDS - TIME_TOLERANCE)


def drifts(blocks: Blocks, step_a: FloatArray | float, gravity: float) -> bool:
    """Whether the direction of gravity drifts during a hold: a slow motion is no rest.

    The noise is that within the blocks, which a slow motion hardly changes; the motion is what the
    block means scatter beyond it. A tremor is fast, a slow motion is not, whatever the sensor.

    Args:
        blocks: consecutive blocks.
        step_a: resolution of the accelerometer, 0 if not known.
        gravity: reading of one gravity.
    """
    if len(blocks) < 2:
        return False
    slow, fast = slow_and_fast(blocks, step_a)
    least = MIN_SWAY if slow > MAX_SLOW_TO_FAST * fast else MAX_SWAY
    return slow > (least * gravity) ** 2


def steady(blocks: Blocks, step_a: FloatArray | float, gravity: float) -> bool:
    """Whether gravity keeps its direction during a hold, however much the support vibrates.

    Args:
        blocks: consecutive blocks.
        step_a: resolution of the accelerometer, 0 if not known.
        gravity: reading of one gravity.
    """
    if len(blocks) < MIN_BLOCKS_TO_TRIM:
        return False
    slow, fast = slow_and_fast(blocks, step_a)
    # the scatter of the means by the vibration alone is known to so much
    chance = fast / blocks.size * STEADY_SIGMA * np.sqrt(2.0 / (3.0 * (len(blocks) - 1.0)))
    return bool(slow <= (MIN_SLOW_MOMENT * gravity) ** 2 + chance)


def slow_and_fast(blocks: Blocks, step_a: FloatArray | float) -> tuple[float, float]:
    """Variance of the accelerometer between blocks beyond that by noise, and within them.

    Args:
        blocks: at least two consecutive ones.
        step_a: resolution of the accelerometer, 0 if not known.
    """
    count, fast = len(blocks), vibration(blocks, step_a)
    away = blocks.mean_a - np.add.reduce(blocks.mean_a, axis=0) / count
    return float((away * away).sum()) / (count - 1.0) - fast / blocks.size, fast


def vibration(blocks: Blocks, step_a: FloatArray | float) -> float:
    """Variance of the accelerometer's readings in blocks about the means of these, all axes added.

    Args:
        blocks: one or more.
        step_a: resolution of the accelerometer, 0 if not known.
    """
    step = step_a + np.zeros(3)
    within = float(blocks.variance[:, :3].sum()) / len(blocks)
    return within * blocks.size / (blocks.size - 1.0) + float(step @ step) / 12.0


def trim_ends(
    blocks: Blocks, step_a: FloatArray | float = 0.0, step_g: FloatArray | float | None = 0.0
) -> Blocks:
    """Trim the ends at which the device was still settling or already moving.

    A rotation that begins slowly stays within any limit of stillness for a while, but deviates
    clearly from the middle of the hold. The middle half gives centre and spread of each axis;
    blocks are removed from each end while they, or their inner neighbours, deviate too far. A
    reading that flickers between two neighbouring values is at rest.

    Args:
        blocks: consecutive blocks.
        step_a: resolution of the accelerometer, if known.
        step_g: resolution of the gyroscope, if known.
    """
    count = len(blocks)
    if count < MIN_BLOCKS_TO_TRIM:
        return blocks
    step = np.zeros(blocks.mean.shape[1])
    step[:3] = step_a
    if blocks.turning:
        step[3:] = 0.0 if step_g is None else step_g
    middle = slice(count // 4, count - count // 4)
    centre = median_of_rows(blocks.mean[middle])
    away = np.abs(blocks.mean - centre)
    scatter = SIGMA_PER_MEDIAN * median_of_rows(away[middle])
    variance = median_of_rows(blocks.variance[middle])
    rounded = rounding_variance(variance, step)
    spread = np.maximum(np.maximum(scatter, np.sqrt(variance / blocks.size)), np.sqrt(rounded))
    off = np.asarray((away > MAX_SETTLING_SIGMA * spread).any(axis=1))
    most = min(MAX_TRIMMED_BLOCKS, count // 4)
    first, past = _quiet_from(off, most), count - _quiet_from(off[::-1], most)
    return blocks.select(slice(first, past))


def settled(blocks: Blocks, step_a: FloatArray | float = 0.0) -> Blocks:
    """A hold without the settling of the accelerometer at its beginning.

    An exponential with one time constant and an amplitude per axis is fitted to the block means. If
    it exceeds the noise, the beginning is left out, as long as the doubt about the settling in the
    rest outweighs the noise of fewer samples, and the fitted settling in the rest is subtracted.
    Without a gyroscope, only the settling along gravity counts: across it, the size of gravity
    hardly shows it.

    Args:
        blocks: consecutive blocks.
        step_a: resolution of the accelerometer, if known.
    """
    seconds = float(blocks.end[0] - blocks.start[0])
    first = min(len(blocks), round(SETTLING_SECONDS / seconds))
    if first < MIN_BLOCKS_TO_TRIM:
        return blocks
    means = blocks.mean_a[:first] - blocks.mean_a[first - 1]
    variance = np.add.reduce(blocks.variance[:first, :3], axis=0) / first
    rounded = rounding_variance(variance, step_a + np.zeros(3))
    noise = np.maximum(variance / blocks.size + rounded, 1e-300)
    size = _settling_shapes(first, SETTLING_TIMES)[1] @ means
    found = size**2 @ (1.0 / noise)
    best = int(found.argmax())
    if not found[best] > MIN_SETTLING:
        return blocks
    finer = tuple(SETTLING_TIMES[best] * finer for finer in FINER_TIMES)
    norms, shapes = _settling_shapes(first, finer)
    size = shapes @ means
    best = int((size**2 @ (1.0 / noise)).argmax())
    fading = np.exp(-np.arange(len(blocks)) / finer[best])
    own = size[best] ** 2 > MIN_SETTLING_AXIS * noise
    amplitude = np.where(own, size[best] / norms[best], 0.0)
    corrected = blocks.mean.copy()
    corrected[:, :3] -= np.outer(fading, amplitude)
    # slow noise (a hand that sways, a desk) makes such shapes as well, and at the end of a hold too
    end = corrected[len(blocks) - first :, :3][::-1]
    scatter = ((corrected[:first, :3] - corrected[:first, :3].mean(axis=0)) ** 2).sum(axis=0)
    slow = ((shapes @ (end - end[0])) ** 2).max(axis=0)
    noise = np.maximum(noise, np.maximum(scatter / (first - 2), slow / 2.0))
    if not float(size[best] ** 2 @ (1.0 / noise)) > MIN_SETTLING:
        return blocks
    if blocks.turning and _turns(blocks.select(slice(0, first)), fading[:first]):
        return blocks
    if not blocks.turning:
        # what moves across gravity may be a hand's sway: an exponential taken off there, which is
        # none, makes the force longer
        along = blocks.mean_a.mean(axis=0)
        along /= np.linalg.norm(along)
        on_it = float(size[best] @ along)
        if not on_it**2 > MIN_SETTLING_AXIS * float(along**2 @ noise):
            return blocks
        amplitude = on_it / norms[best] * along
        corrected = blocks.mean.copy()
        corrected[:, :3] -= np.outer(fading, amplitude)
    least = min(len(blocks), max(round(MIN_HOLD_SECONDS / seconds), MIN_BLOCKS_TO_TRIM))
    kept = np.arange(len(blocks), least - 1, -1)
    tail = np.cumsum(fading[::-1])[kept - 1] / kept
    doubt = (TAIL_DOUBT * tail) ** 2 * float(amplitude @ amplitude) + noise.sum() / kept
    begin = int(doubt.argmin())
    moment = blocks.moment.copy()
    moment[:, :3] += np.outer(fading, amplitude) / (12.0 * finer[best])
    return replace(blocks, mean=corrected, moment=moment).select(slice(begin, len(blocks)))


def _turns(blocks: Blocks, fading: FloatArray) -> bool:
    """Whether the accelerometer moves as the gyroscope turns rather than by an exponential.

    Then the device turns, and no sensor settles. An even turn, which the gyroscope's bias looks
    like and either explains in part, is left out. By chance each parameter explains as much as one
    reading has noise: the exponential has three amplitudes, the turn the gyroscope's unit.

    Args:
        blocks: the first ones of a hold.
        fading: the exponential, shape (m,).
    """
    force = blocks.mean_a
    # a body that turns by φ sees up move by up × φ
    moved = np.cross(force.mean(axis=0), _turned(blocks, 1.0)[1])
    if not np.isfinite(moved).all():
        return False
    uneven = complement(np.column_stack([np.ones(len(blocks)), np.arange(len(blocks))])).T
    read, moved, fades = uneven @ force, uneven @ moved, uneven @ fading
    by_turn = float((read * moved).sum()) ** 2 / max(float((moved * moved).sum()), 1e-300)
    by_exponential = float(((fades @ read) ** 2).sum()) / float(fades @ fades)
    noise = float((read * read).sum()) - max(by_turn, by_exponential)
    return by_turn + 2.0 * noise / (read.size - 3) > by_exponential


@lru_cache(maxsize=64)
def _settling_shapes(count: int, times: tuple[float, ...]) -> tuple[FloatArray, FloatArray]:
    """Exponentials less their means: their norms, shape (k,), and the unit vectors, (k, count).

    Args:
        count: blocks.
        times: time constants in blocks; those above a third of the blocks are left out.
    """
    short = np.array([time for time in times if time <= count / 3.0] or times[:1])
    fading = np.exp(-np.arange(count) / short[:, None])
    centred = fading - fading.mean(axis=1, keepdims=True)
    norms = np.sqrt((centred**2).sum(axis=1))
    return norms, centred / norms[:, None]


def _quiet_from(off: BoolArray, most: int) -> int:
    """Number of blocks to remove at the beginning: while one or its successor deviates."""
    taken = 0
    while taken < most and (off[taken] or off[taken + 1]):
        taken += 1
    return taken


def mean_and_covariance(
    means: FloatArray, moments: FloatArray | None = None
) -> tuple[FloatArray, FloatArray, int]:
    """Mean of block means, its covariance, degrees of freedom per axis of that.

    The covariance of a mean is the power of the noise at low frequencies over the duration. It is
    taken from the periodogram at the lowest frequencies (Percival & Walden, Spectral Analysis for
    Physical Applications, 8.1), so that slow noise counts with its true weight. A tremor is the
    change of a bounded velocity: it cancels in the mean but for the velocities at both ends, which
    cosines count twice and sines not at all. Means of parts of the hold would count the velocities
    between the parts as well, up to eight times the noise of the mean. A tremor near one cycle in a
    block changes the means of blocks slowly; the moments in the blocks show that it is fast.

    Args:
        means: block means, shape (m, k).
        moments: of the blocks, shape (m, k); None where nothing is as fast as the blocks.
    """
    origin, count = means[0], len(means)
    centred = means - origin
    average = np.add.reduce(centred, axis=0) / count
    waves = _lowest_waves(count)
    if not len(waves):
        return origin + average, np.full((len(average), len(average)), np.nan), 0
    power = np.add.reduce(waves[:, :, None] * centred, axis=1)
    if moments is not None:
        # to first order in a block: cos(ωt + ωτu) = cos ωt − ωτu sin ωt
        turned = np.add.reduce(_slopes_of_waves(count)[:, :, None] * moments, axis=1)
        power = _passed_by_blocks(count)[:, None] * power + turned
    return origin + average, power.T @ power / (len(waves) * count), len(waves)


@lru_cache(maxsize=256)
def _lowest_waves(count: int) -> FloatArray:
    """Cosines and sines of the lowest frequencies that as many blocks show, unit vectors, (k, n).

    Three blocks show one frequency; two show only their difference.
    """
    if count < 2:
        return np.zeros((0, count))
    if count == 2:
        return np.array([[np.sqrt(0.5), -np.sqrt(0.5)]])
    cycles = np.arange(1, min(NOISE_FREQUENCIES, (count - 1) // 2) + 1)
    phase = 2.0 * np.pi * np.outer(cycles, np.arange(count) + 0.5) / count
    waves: FloatArray = np.concatenate([np.cos(phase), np.sin(phase)]) * np.sqrt(2.0 / count)
    return waves


@lru_cache(maxsize=256)
def _slopes_of_waves(count: int) -> FloatArray:
    """Change of each of the lowest waves over one block, (k, count)."""
    waves = _lowest_waves(count)
    if count <= 2:
        return np.zeros_like(waves)
    cycles = len(waves) // 2
    over = 2.0 * np.pi * np.arange(1, cycles + 1)[:, None] / count
    return np.concatenate([-over * waves[cycles:], over * waves[:cycles]])


@lru_cache(maxsize=256)
def _passed_by_blocks(count: int) -> FloatArray:
    """What the mean over a block leaves of each of the lowest waves, shape (k,)."""
    waves = _lowest_waves(count)
    if count <= 2:
        return np.ones(len(waves))
    cycles = np.arange(1, len(waves) // 2 + 1)
    return np.asarray(np.tile(np.sinc(cycles / count), 2))


_REACH = 64
"""Windows to either side that are looked at first; a longer rest is looked at again."""
_WITHOUT_GYROSCOPE = 1e6
"""Makes windows without samples of the gyroscope the least calm of all."""


class Rests:
    """The rests in a stream of windows.

    Args:
        windows: the windows.
        step_a: resolution of the accelerometer, 0 if not known.
        step_g: resolution of the gyroscope; None without one.
        turning: windows that turn in the mean, shape (m,); None if not known.
    """

    def __init__(
        self,
        windows: Windows,
        step_a: FloatArray | float = 0.0,
        step_g: FloatArray | float | None = 0.0,
        turning: BoolArray | None = None,
    ) -> None:
        self._std = windows.std_a
        self._full = windows.full & true_on_all_axes(np.isfinite(windows.std_a))
        self._turning = np.zeros(len(self._full), bool) if turning is None else turning
        self._step = step_a + np.zeros(3)
        if windows.std_g is not None:
            self._std = np.hstack([windows.std_a, windows.std_g])
            self._step = np.append(self._step, (0.0 if step_g is None else step_g) + np.zeros(3))
        # a product of all axes needs no common unit of the sensors
        noise = np.log(np.maximum(self._std, np.maximum(rounding_noise(self._step), 1e-300)))
        of_force, of_rate = noise[:, :3].sum(axis=1), noise[:, 3:].sum(axis=1)
        self._unrest = of_force + np.where(np.isnan(of_rate), _WITHOUT_GYROSCOPE, of_rate)
        self._unrest[~self._full] = np.inf
        self._known: dict[int, tuple[int, int]] = {}
        self._around: dict[int, tuple[int, int]] = {}

    def within(self, first: int, past: int, shortest: int) -> list[tuple[int, int]]:
        """The rests in a run of still windows, each as its first window and past its last.

        What a rest leaves of the run may be another rest, with more noise.

        Args:
            first: first window of the run.
            past: past its last window.
            shortest: fewer windows are no rest.
        """
        found, left = [], [(first, past)]
        while left:
            first, past = left.pop()
            if past - first < max(shortest, 1):
                continue
            begin, end = self.around(first, past)
            found.append((begin, end))
            if begin < past and first < end:
                left += [(first, begin), (end, past)]
        return found

    def around(self, first: int, past: int) -> tuple[int, int]:
        """The rest around the calmest of some windows: its first window and past its last.

        A rest may extend beyond these windows and contain a calmer one there; the search then
        begins again from that one. It may so arrive at a smooth turn about the vertical, which can
        be calmer than a rest in a trembling hand. If most of the windows found lie outside the
        given ones and turn in the mean, the rest around the first calmest window is returned
        instead, without windows outside the given ones.
        """
        calmest, seen = first + int(self._unrest[first:past].argmin()), set[int]()
        begun = calmest
        while begun not in self._around:
            begin, end = self._rest(calmest)
            seen.add(calmest)
            calmest = begin + int(self._unrest[begin:end].argmin())
            if calmest in seen:
                self._around[begun] = begin, end
        begin, end = self._around[begun]
        beside = end <= first or past <= begin
        if beside and self._turning[begin:end].mean() > 0.5:
            begin, end = self._rest(begun)
            return max(begin, first), min(end, past)
        return begin, end

    def _rest(self, calmest: int) -> tuple[int, int]:
        """All windows around this one within the limit that they make themselves."""
        if calmest not in self._known:
            limit = np.maximum(REST_FACTOR * self._std[calmest], self._step)
            while True:
                begin, end = self._under(limit, calmest)
                usual = REST_FACTOR * median_of_rows(self._std[begin:end])
                wider = np.fmax(limit, usual)  # NaN where the gyroscope is missing
                if np.array_equal(wider, limit, equal_nan=True):
                    break
                limit = wider
            self._known[calmest] = begin, end
        return self._known[calmest]

    def _under(self, limit: FloatArray, window: int) -> tuple[int, int]:
        """The run of windows under a limit around one of them."""
        reach, count = _REACH, len(self._full)
        while True:
            begin, end = max(window - reach, 0), min(window + reach, count)
            std = self._std[begin:end]
            still = self._full[begin:end] & true_on_all_axes(~(std > limit))
            moving = np.flatnonzero(~still)
            place = int(moving.searchsorted(window - begin))
            opened, closed = place > 0 or begin == 0, place < len(moving) or end == count
            if opened and closed:
                first = begin + int(moving[place - 1]) + 1 if place else begin
                past = begin + int(moving[place]) if place < len(moving) else end
                return first, past
            reach *= 4


def still_runs(still: BoolArray) -> list[tuple[int, int]]:
    """Runs of still windows, each as its first and past its last."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], still, [False]]).astype(np.int8)))
    return [(int(first), int(past)) for first, past in edges.reshape(-1, 2)]


def fewest_windows(seconds: float) -> int:
    """Windows of the shortest rest that can be a hold.

    Args:
        seconds: length of a block.
    """
    shortest = math.ceil(MIN_HOLD_SECONDS / seconds - TIME_TOLERANCE) + 2 * GUARD_BLOCKS
    return shortest - WINDOW_BLOCKS + 1


def blocks_of_rests(rests: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """The blocks of rests in order, guards removed; none is in two rests.

    The block after a rest ended it, so the next one begins after that block.

    Args:
        rests: first and past the last window of each.
    """
    runs = []
    earliest = 0
    for first, past in rests:
        start = max(first - WINDOW_BLOCKS + 1, earliest) + GUARD_BLOCKS
        stop = past - GUARD_BLOCKS
        earliest = max(past + 1, earliest)
        if stop > start:
            runs.append((start, stop))
    return runs


class HoldBuilder:
    """Collects the blocks of the current rest in a stream, and those since the rest before it."""

    def __init__(self) -> None:
        self._blocks: list[Blocks] = []
        self._windows: list[Windows] = []
        self._run: tuple[int, int] | None = None

    @property
    def seconds(self) -> float:
        """Duration of the run of still windows if it ended now, without guards, s."""
        if self._run is None or len(self._blocks) - self._run[0] <= 2 * GUARD_BLOCKS:
            return 0.0
        start = self._blocks[self._run[0] + GUARD_BLOCKS].start[0]
        return float(self._blocks[-1 - GUARD_BLOCKS].end[0] - start)

    def add(self, block: Blocks, window: Windows, still: bool) -> None:
        """Add one block, the window that ends with it, and whether that is still.

        The first block after a run ended it, so the next run begins after that block.
        """
        self._blocks.append(block)
        self._windows.append(window)
        if still and self._run is None:
            last = len(self._blocks) - 1
            self._run = max(last - WINDOW_BLOCKS + 1, 0), last
        elif not still and self._run is not None:
            self.drop()
        elif not still:
            del self._blocks[:-HISTORY_BLOCKS], self._windows[:-HISTORY_BLOCKS]

    def hold(
        self,
        gravity: float,
        step_a: FloatArray | float = 0.0,
        step_g: FloatArray | float | None = 0.0,
        rest: tuple[FloatArray | None, float] = (None, 0.0),
        kept: Hold | None = None,
    ) -> Hold | None:
        """The hold in the rest so far; None if it drifts or nothing remains.

        Args:
            gravity: reading of one gravity.
            step_a: resolution of the accelerometer, 0 if not known.
            step_g: resolution of the gyroscope.
            rest: the gyroscope's reading at rest, and the deviation from it that is no turn; see
                ``Windows.turning``.
            kept: the hold that was taken when less of the rest was known. What is found is the
                same rest, as a recording of it all shows it; None for the calmest one.
        """
        if self._run is None:
            return None
        windows = join_windows(self._windows)
        rests = Rests(windows, step_a, step_g, windows.turning(*rest))
        first, past = self._run[1], len(self._blocks)
        if kept is None:
            runs = blocks_of_rests([rests.around(first, past)])
        else:
            seconds = float(self._blocks[-1].end[0] - self._blocks[-1].start[0])
            runs = blocks_of_rests(sorted(set(rests.within(first, past, fewest_windows(seconds)))))
            runs = sorted(runs, key=lambda run: self._shared(run, kept))[-1:]
        if not runs or (kept is not None and not self._shared(runs[0], kept) > 0.0):
            return None
        blocks = join_blocks(self._blocks[slice(*runs[0])])
        return hold_at_rest(blocks, gravity, step_a, step_g)

    def _shared(self, run: tuple[int, int], hold: Hold) -> float:
        """Seconds that some blocks share with a hold; negative if there are none."""
        start, end = self._blocks[run[0]].start[0], self._blocks[run[1] - 1].end[0]
        return float(min(end, hold.end) - max(start, hold.start))

    def drop(self) -> None:
        """Drop the current run and the blocks before it."""
        self._blocks, self._windows, self._run = [], [], None


def times_in_hold(start: float, end: float, part: FloatArray, sign: int) -> FloatArray:
    """Times that the constant reading of a hold comes from, s, shape (n,).

    The reading is the mean of all integrals from a time in the hold to its end (``sign`` 1), or
    from its beginning to a time in it (−1). The weight of a time grows linearly towards the
    rotation.

    Args:
        start: of the hold, s.
        end: of the hold, s.
        part: of the weight that lies before each time, 0 to 1, shape (n,).
        sign: 1 before a rotation, −1 after it.
    """
    place = np.sqrt(part) if sign > 0 else 1.0 - np.sqrt(1.0 - part)
    return np.asarray(start + place * (end - start))
