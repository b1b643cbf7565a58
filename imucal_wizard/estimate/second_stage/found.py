"""The result of the second stage, as report, JSON and text show it."""

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.second_stage.alignment import Alignment
from imucal_wizard.estimate.second_stage.clock_offset import ClockOffset
from imucal_wizard.estimate.second_stage.error_modes import ErrorModes
from imucal_wizard.estimate.second_stage.field_changes import FieldChange
from imucal_wizard.estimate.second_stage.heading import Bearings

MAX_WORSE = 1.1
"""A closure that is larger by less than this may be no worse: thirty rotations know it to 13 %."""
SAME_CLOSURES = 1.02
"""Closures that together are larger by less than this are the same: more data decide, which know
the gains at least as well."""
EXACT_CLOSURE = 1e-7
"""A closure below this, rad, is exact."""


@dataclass(frozen=True, eq=False)
class Headings(Bearings):
    """Tilt-compensated heading of the x axis in each still position, before and after.

    Attributes:
        hold: which of the report's holds, shape (n,).
    """

    hold: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Added:
    """What the second stage adds to the gyroscope: closures of rotations, rad rms.

    Attributes:
        turns: how many rotations, those about the vertical included.
        tilt_before: across the vertical, of the rotations that the gyroscope's fit to gravity alone
            has, each left out of that fit.
        tilt_after: the same of the same rotations by both references.
        heading_before: about the vertical, by the fit to gravity alone.
        heading_after: the same by both references, each turn left out.
        standard_errors: mean ratio of the gains' standard errors, after over before, or None.
    """

    turns: int
    tilt_before: float
    tilt_after: float
    heading_before: float
    heading_after: float
    standard_errors: float | None

    @property
    def better(self) -> bool:
        """Whether both references foretell rotations left out as well, and neither closure worse.

        Each closure in units of its own: the magnetometer's noise in a heading is far above that of
        a tilt.
        """
        heading = self.heading_after / max(self.heading_before, EXACT_CLOSURE)
        tilt = self.tilt_after / max(self.tilt_before, EXACT_CLOSURE)
        return max(heading, tilt) <= MAX_WORSE and heading**2 + tilt**2 <= 2.0 * SAME_CLOSURES**2


@dataclass(frozen=True, eq=False)
class SecondStage:
    """Everything the second stage found.

    Attributes:
        alignment: rotation and dip.
        modes: error modes of the calibrations that it rests on.
        headings: before and after.
        clock: offset of the magnetometer's clock, or None when no turn shows it.
        added: what the gyroscope gains, or None without one.
        changes: where the field turned about the vertical, in the order of time.
        notes: what could not be done, and why.
    """

    alignment: Alignment
    modes: ErrorModes
    headings: Headings
    clock: ClockOffset | None = None
    added: Added | None = None
    changes: tuple[FieldChange, ...] = ()
    notes: tuple[str, ...] = ()
