"""What the second stage found, as report, JSON and text show it."""

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.second_stage.alignment import Alignment
from imucal_wizard.estimate.second_stage.clock_offset import ClockOffset
from imucal_wizard.estimate.second_stage.error_modes import ErrorModes
from imucal_wizard.estimate.second_stage.heading import Bearings


@dataclass(frozen=True, eq=False)
class Headings(Bearings):
    """Tilt-compensated heading of the x axis in each still position, before and after.

    Attributes:
        hold: which of the report's holds, shape (n,).
    """

    hold: NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Added:
    """What the second stage adds to the gyroscope: closures of all turns, rad rms.

    Attributes:
        turns: how many rotations, those about the vertical included.
        tilt_before: across the vertical, by the gyroscope's fit to gravity alone.
        tilt_after: the same by both references, each turn left out.
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


@dataclass(frozen=True, eq=False)
class SecondStage:
    """Everything the second stage found.

    Attributes:
        alignment: rotation and dip.
        modes: error modes of the calibrations that it rests on.
        headings: before and after.
        clock: offset of the magnetometer's clock, or None when no turn shows it.
        added: what the gyroscope gains, or None without one.
        notes: what could not be done, and why.
    """

    alignment: Alignment
    modes: ErrorModes
    headings: Headings
    clock: ClockOffset | None = None
    added: Added | None = None
    notes: tuple[str, ...] = ()
