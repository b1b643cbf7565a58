"""Evaluation of the magnetometer's samples: ellipsoid, coverage, disturbances.

Each new ellipsoid evaluates all samples again: a sample that looked disturbed may be good, and the
other way round.
"""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.limits.procedure import (
    BLOCKS_BESIDE,
    MAX_SHOWN_DOUBT,
    MIN_CIRCLE_RADIUS,
    MIN_DISTURBANCE,
    SECTOR_DEG,
)
from imucal_wizard.core.readings import BoolArray, FloatArray, distinct
from imucal_wizard.estimate.ellipsoid.coverage import BINS, Quality, bin_of, quality
from imucal_wizard.estimate.ellipsoid.provisional import MISFIT, Provisional, provisional
from imucal_wizard.estimate.magnetometer.field_disturbances import (
    DISTURBED_SIGMAS,
    DOUBTFUL_SIGMAS,
    spread_to_neighbours,
)
from imucal_wizard.guide.field.samples import FieldBlock, Log, Thinned

SECTORS = round(360.0 / SECTOR_DEG)


def covered(before: FloatArray, after: FloatArray) -> float:
    """The part of a circle that arcs cover together, degrees from 0 to 360.

    Moving to and fro covers an arc only once.

    Args:
        before: angle at which each arc begins, degrees, unwrapped, shape (n,).
        after: angle at which each arc ends.
    """
    if not len(before):
        return 0.0
    first = np.floor(np.minimum(before, after) / SECTOR_DEG).astype(int)
    last = np.floor(np.maximum(before, after) / SECTOR_DEG).astype(int)
    length = np.minimum(last - first + 1, SECTORS)
    within = np.arange(length.sum()) - np.repeat(np.cumsum(length) - length, length)
    touched = len(distinct((np.repeat(first, length) + within) % SECTORS))
    # a device that does not turn touches one sector
    return 360.0 if touched == SECTORS else (touched - 1) * SECTOR_DEG


def headings(vectors: FloatArray, up: FloatArray, noise: float) -> FloatArray | None:
    """Angle about the vertical from the field alone, for a stream without a gyroscope.

    Args:
        vectors: readings in time order, corrected or not, shape (n, 3).
        up: mean up direction in the body frame, shape (3,).
        noise: standard deviation of one reading, same unit.

    Returns:
        Degrees, unwrapped, shape (n,); None if the readings form no arc.
    """
    if len(vectors) < 4:
        return None
    first = np.cross(up, np.eye(3)[int(np.argmin(np.abs(up)))])
    first /= np.linalg.norm(first)
    flat = vectors @ np.column_stack([first, np.cross(up, first)])
    circle = _circle(flat)
    if circle is None or circle[2] < MIN_CIRCLE_RADIUS * noise:
        return None
    angles = np.arctan2(flat[:, 1] - circle[1], flat[:, 0] - circle[0])
    return np.asarray(np.degrees(np.unwrap(angles)))


def _circle(flat: FloatArray) -> tuple[float, float, float] | None:
    """Centre and radius of the circle through points, shape (n, 2), by Pratt's algebraic fit.

    Unlike Kåsa's fit it is not biased towards small circles if only an arc is known.
    V. Pratt, Computer Graphics 21 (1987) 145.
    """
    middle = flat.mean(axis=0)
    x, y = (flat - middle).T
    square = x * x + y * y
    size = float(np.sqrt(square.mean()))
    if not size > 0.0:
        return None
    design = np.column_stack([square / size**2, x / size, y / size, np.ones(len(x))])
    # Pratt's constraint: B² + C² − 4AD = 1
    inverse = np.array([[0.0, 0, 0, -0.5], [0, 1, 0, 0], [0, 0, 1, 0], [-0.5, 0, 0, 0]])
    values, vectors = np.linalg.eig(inverse @ (design.T @ design))
    real = np.where(np.abs(values.imag) < 1e-9, values.real, np.inf)
    real[real < -1e-9 * len(x)] = np.inf
    best = np.real(vectors[:, int(np.argmin(real))])
    if abs(best[0]) < 1e-9:
        return None
    centre = -best[1:3] / (2.0 * best[0]) * size
    radius = float(np.sqrt(max(centre @ centre - best[3] / best[0] * size**2, 0.0)))
    return float(centre[0] + middle[0]), float(centre[1] + middle[1]), radius


class Survey:
    """The samples of the step and their evaluation.

    Attributes:
        log: the blocks of the step.
        fit: the provisional ellipsoid, or None.
        worst: the largest uncertainty of the ellipsoid, as a share of the field.
        quality: the four figures, or None while the ellipsoid is too uncertain.
        samples: the samples that are evaluated, shape (n, 3).
        distance: deviation of each sample as a share of the field, shape (n,); NaN if unknown.
        clean: which of them are not disturbed, shape (n,).
        counts: samples in each area, shape (100,).
        off: deviation of each block as a share of the field, shape (n,); NaN if unknown.
        disturbed: which blocks are left out, shape (n,).
    """

    def __init__(self) -> None:
        self.log = Log()
        self._samples = Thinned()
        self._alive: BoolArray = np.zeros(0, bool)
        self._last: FloatArray | None = None
        self.reset()

    def reset(self) -> None:
        """Forget the evaluation."""
        self.fit: Provisional | None = None
        self.worst = np.inf
        self.quality: Quality | None = None
        self.samples: FloatArray = self._samples.values
        self.distance: FloatArray = np.full(len(self.samples), np.nan)
        self.clean: BoolArray = np.ones(len(self.samples), bool)
        self.counts: NDArray[np.intp] = np.zeros(BINS, np.intp)
        self.off: FloatArray = np.full(len(self.log), np.nan)
        self.disturbed: BoolArray = np.zeros(len(self.log), bool)

    def add(self, passed: FieldBlock) -> None:
        """Take the next block."""
        self._samples.add(passed.values, len(self.log))
        self.log.add(passed)
        self._last = passed.values[-1]

    @property
    def kept(self) -> int:
        """Number of samples that count."""
        return int(self.log.count[: len(self._alive)][self._alive & ~self.disturbed].sum())

    @property
    def left_out(self) -> int:
        """Number of samples left out as disturbed."""
        return int(self.log.count[: len(self._alive)][self._alive & self.disturbed].sum())

    @property
    def here(self) -> int | None:
        """Area of the newest sample."""
        if self.fit is None or self._last is None:
            return None
        return int(bin_of(self.fit.look(self._last[None])[1])[0])

    @property
    def covered(self) -> int:
        """Number of areas with samples."""
        return int((self.counts > 0).sum())

    def update(self, circles: Collection[int]) -> None:
        """Evaluate all samples again.

        Args:
            circles: numbers of the circles that were not taken back.
        """
        # a division by zero gives NaN, which every comparison below rejects
        with np.errstate(all="ignore"):
            self._update(circles)

    def _update(self, circles: Collection[int]) -> None:
        self._alive = np.isin(self.log.circle, list(circles))
        if not self._alive.all():
            self._samples.keep(self._alive[self._samples.block])
        fit = provisional(self._samples.values, self.fit)
        self.reset()
        if fit is None:
            return
        self.fit, self.worst = fit, fit.worst()
        self.off = fit.look(self.log.reading)[0]
        self.disturbed = self._judged(fit) & self._alive
        self.distance, seen = fit.look(self._samples.values)
        areas = bin_of(seen)
        self.clean = good = ~self.disturbed[self._samples.block]
        self.counts = np.bincount(areas[good], minlength=BINS)
        if self.worst < MAX_SHOWN_DOUBT:
            self.quality = quality(seen[:, good] * (1.0 + self.distance[good]), areas[good])
        self._samples.thin(areas)

    def _judged(self, fit: Provisional) -> BoolArray:
        """Blocks that deviate by more than noise and uncertainty allow, and their neighbours."""
        doubt = fit.doubt(self.log.reading)
        limit = np.sqrt(fit.noise**2 / self.log.averaged + doubt**2 + MISFIT**2)
        size = np.abs(self.off)
        far = (size > DISTURBED_SIGMAS * limit) & (size > MIN_DISTURBANCE)
        return spread_to_neighbours(far, size > DOUBTFUL_SIGMAS * limit, BLOCKS_BESIDE)

    def seconds(self, circle: int) -> float:
        """Duration of a circle so far, s."""
        rows = self.log.circle == circle
        return float(np.ptp(self.log.end[rows])) if rows.any() else 0.0

    def turned(self, circle: int) -> float:
        """Angle turned in a circle with its face on the table, degrees."""
        rows = (self.log.circle == circle) & self.log.down & ~self._out
        before, after = (angles[rows] for angles in self.log.angles)
        if len(before) and not np.isfinite(before).all():
            angles = self._by_field(rows)
            if angles is None:
                return 0.0
            beside = np.diff(np.flatnonzero(rows)) == 1  # the angle across a gap is unknown
            before, after = angles[:-1][beside], angles[1:][beside]
        return covered(before, after)

    @property
    def _out(self) -> BoolArray:
        """Blocks that are left out; the newest, not evaluated yet, are not."""
        out = np.zeros(len(self.log), bool)
        out[: len(self.disturbed)] = self.disturbed
        return out

    def _by_field(self, rows: BoolArray) -> FloatArray | None:
        readings, up = self.log.reading[rows], self.log.up[rows].mean(axis=0)
        if self.fit is not None and self.worst < MAX_SHOWN_DOUBT:
            distance, seen = self.fit.look(readings)
            return headings((seen * (1.0 + distance)).T, up, self.fit.noise)
        noise = 0.0 if self.fit is None else self.fit.noise * self.fit.magnitude
        return headings(readings, up, noise)

    def spans(self) -> tuple[tuple[float, float], ...]:
        """Start and end of the spans whose samples count, s."""
        return self._times(self._alive & ~self.disturbed)

    def left(self) -> tuple[tuple[float, float, float], ...]:
        """Start, end, s, and largest deviation, share of the field, of the spans left out."""
        rows = self._alive & self.disturbed
        out = []
        for part, (start, end) in zip(self.log.stretches(rows), self._times(rows), strict=True):
            off = self.off[part]
            out.append((start, end, float(off[np.argmax(np.abs(off))])))
        return tuple(out)

    def _times(self, rows: BoolArray) -> tuple[tuple[float, float], ...]:
        start, end = self.log.start, self.log.end
        parts = self.log.stretches(rows)
        return tuple((float(start[part][0]), float(end[part][-1])) for part in parts)
