"""What the samples of the step say so far: the ellipsoid, what is covered, what was disturbed.

Everything is judged again with every new ellipsoid: a sample that looked disturbed while little was
known may turn out good, and the other way round.
"""

from collections.abc import Collection

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.ellipsoid.bins import BINS, bin_of
from imucal_wizard.ellipsoid.provisional import MISFIT, Provisional, provisional
from imucal_wizard.ellipsoid.quality import Quality, quality
from imucal_wizard.procedure.field.log import Log, Passed
from imucal_wizard.procedure.field.thinned import Thinned
from imucal_wizard.procedure.field.turning import covered, headings
from imucal_wizard.readings import BoolArray, FloatArray

FAR = 6.0
"""Standard deviations beyond which a moment is disturbed."""
NEAR = 3.0
"""The same for those beside one."""
BESIDE = 5
"""How many of them to either side."""
LEAST = 0.03
"""Share of the field below which nothing is called disturbed while it happens."""
TOLD = 0.3
"""Doubt somewhere on the sphere, as a share of the field, above which no figure is shown."""


class Survey:
    """The samples of the step and what follows from them.

    Attributes:
        log: its moments.
        fit: the ellipsoid by now, or None.
        worst: how badly it is known anywhere, as a share of the field.
        quality: the four figures, or None as long as they would say nothing.
        samples: those that are looked at, shape (n, 3).
        clean: which of them are not disturbed, shape (n,).
        counts: samples in each area, shape (100,).
        off: how far each moment is off, as a share of the field, shape (n,); NaN unknown.
        disturbed: which moments are left out, shape (n,).
    """

    def __init__(self) -> None:
        self.log = Log()
        self._samples = Thinned()
        self._alive: BoolArray = np.zeros(0, bool)
        self._last: FloatArray | None = None
        self.reset()

    def reset(self) -> None:
        """Nothing is known."""
        self.fit: Provisional | None = None
        self.worst = np.inf
        self.quality: Quality | None = None
        self.samples: FloatArray = self._samples.values
        self.clean: BoolArray = np.ones(len(self.samples), bool)
        self.counts: NDArray[np.intp] = np.zeros(BINS, np.intp)
        self.off: FloatArray = np.full(len(self.log), np.nan)
        self.disturbed: BoolArray = np.zeros(len(self.log), bool)

    def add(self, passed: Passed) -> None:
        """Take the next moment."""
        self._samples.add(passed.values, len(self.log))
        self.log.add(passed)
        self._last = passed.values[-1]

    @property
    def kept(self) -> int:
        """Samples that count."""
        return int(self.log.count[: len(self._alive)][self._alive & ~self.disturbed].sum())

    @property
    def left_out(self) -> int:
        """Samples left out as disturbed."""
        return int(self.log.count[: len(self._alive)][self._alive & self.disturbed].sum())

    @property
    def here(self) -> int | None:
        """Area of the newest sample."""
        if self.fit is None or self._last is None:
            return None
        return int(bin_of(self.fit.look(self._last[None])[1])[0])

    @property
    def covered(self) -> int:
        """How many areas hold samples."""
        return int((self.counts > 0).sum())

    def update(self, circles: Collection[int]) -> None:
        """Look at everything anew.

        Args:
            circles: numbers of those that have not been taken back.
        """
        # what divides by nothing ends as a number that is none, and counts for nothing
        with np.errstate(all="ignore"):
            self._update(circles)

    def _update(self, circles: Collection[int]) -> None:
        self._alive = np.isin(self.log.circle, list(circles))
        if not self._alive.all():
            self._samples.keep(self._alive[self._samples.moment])
        fit = provisional(self._samples.values, self.fit)
        self.reset()
        if fit is None:
            return
        self.fit, self.worst = fit, fit.worst()
        self.off = fit.look(self.log.reading)[0]
        self.disturbed = self._judged(fit) & self._alive
        distance, seen = fit.look(self._samples.values)
        areas = bin_of(seen)
        self.clean = good = ~self.disturbed[self._samples.moment]
        self.counts = np.bincount(areas[good], minlength=BINS)
        if self.worst < TOLD:
            self.quality = quality(seen[:, good] * (1.0 + distance[good]), areas[good])
        self._samples.thin(areas)

    def _judged(self, fit: Provisional) -> BoolArray:
        """Moments farther off than noise and doubt allow, and those beside them."""
        doubt = fit.doubt(self.log.reading)
        limit = np.sqrt(fit.noise**2 / self.log.averaged + doubt**2 + MISFIT**2)
        size = np.abs(self.off)
        far = (size > FAR * limit) & (size > LEAST)
        near = size > NEAR * limit
        for _ in range(BESIDE):
            beside = np.zeros(len(far), bool)
            beside[1:] |= far[:-1]
            beside[:-1] |= far[1:]
            far |= beside & near
        return np.asarray(far)

    def seconds(self, circle: int) -> float:
        """How long a circle has lasted by now, s."""
        rows = self.log.circle == circle
        return float(np.ptp(self.log.end[rows])) if rows.any() else 0.0

    def turned(self, circle: int) -> float:
        """How much of a circle has been turned with its face on the table, degrees."""
        rows = (self.log.circle == circle) & self.log.down & ~self._out
        before, after = (angles[rows] for angles in self.log.angles)
        if len(before) and not np.isfinite(before).all():
            angles = self._by_field(rows)
            if angles is None:
                return 0.0
            beside = np.diff(np.flatnonzero(rows)) == 1  # across what is left out nothing is known
            before, after = angles[:-1][beside], angles[1:][beside]
        return covered(before, after)

    @property
    def _out(self) -> BoolArray:
        """Moments left out; the newest, which have not been judged yet, are not."""
        out = np.zeros(len(self.log), bool)
        out[: len(self.disturbed)] = self.disturbed
        return out

    def _by_field(self, rows: BoolArray) -> FloatArray | None:
        readings, up = self.log.reading[rows], self.log.up[rows].mean(axis=0)
        if self.fit is not None and self.worst < TOLD:
            distance, seen = self.fit.look(readings)
            return headings((seen * (1.0 + distance)).T, up, self.fit.noise)
        noise = 0.0 if self.fit is None else self.fit.noise * self.fit.magnitude
        return headings(readings, up, noise)

    def spans(self) -> tuple[tuple[float, float], ...]:
        """Times from and to which samples count, s."""
        return self._times(self._alive & ~self.disturbed)

    def left(self) -> tuple[tuple[float, float, float], ...]:
        """Times from and to which they do not, s, and how far they were off, share of the field."""
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
