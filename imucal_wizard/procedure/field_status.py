"""What the field step tells whoever watches it: coverage, quality, and what is in the way."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.ellipsoid.bins import BINS

GOOD = {"gaps": 15.0, "variance": 4.5, "wobble": 4.0, "fit_error": 5.0}
"""Per cent below which each figure is good: the limits that users of MotionCal know. Gaps are those
of free tumbling; circles on all six faces are enough whatever gaps they leave."""


def _empty() -> NDArray[np.intp]:
    return np.zeros(BINS, np.intp)


@dataclass(frozen=True, eq=False)
class FieldStatus:
    """The magnetometer's circles at one moment.

    Directions are those of the field seen from the body, by the provisional calibration; areas are
    numbered as in ``ellipsoid.bins``.

    Attributes:
        face: the face to be laid on the table next (``-z``: the bottom), or None where any motion
            will do.
        face_down: the face that lies on the table now, or None while none does.
        turned: degrees turned so far with that face down, 0 to 360; 0 while none is.
        done: faces whose circle is complete, in the order of the list.
        missing: faces whose circle is not.
        counts: samples in each area, shape (100,); no more than are needed to see that it is full.
        here: area of the newest sample, or None.
        gaps: share of the sphere that no sample is near, per cent; None before there is a fit.
        variance: magnitude variance, per cent of the field.
        wobble: how far the middle of the samples is off, per cent of the field.
        fit_error: per cent of the field.
        magnitude: size of the field by the reading's own unit, µT; None for counts, or too early.
        advice: which motion fills the largest gap, in plain words.
        disturbed: what disturbs the field at this moment, or "".
        trouble: why no calibration can come of it so far (not the Earth's field, it does not turn,
            saturation, one plane), or "".
        samples: samples kept.
        left_out: samples left out as disturbed.
        good: coverage and fit suffice.
    """

    face: str | None = None
    face_down: str | None = None
    turned: float = 0.0
    done: tuple[str, ...] = ()
    missing: tuple[str, ...] = ()
    counts: NDArray[np.intp] = field(default_factory=_empty)
    here: int | None = None
    gaps: float | None = None
    variance: float | None = None
    wobble: float | None = None
    fit_error: float | None = None
    magnitude: float | None = None
    advice: str = ""
    disturbed: str = ""
    trouble: str = ""
    samples: int = 0
    left_out: int = 0
    good: bool = False
