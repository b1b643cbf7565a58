"""Holds in which an accelerometer axis stood at the end of its range."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray

SILENT = 1e-6
"""Variance of a clipped axis over what the same axis shows in other holds."""
FEWEST = 2
"""Holds that must show one and the same reading: one might have hung."""


def clipped_axes(holds: Sequence[Hold], step: FloatArray) -> list[str]:
    """A warning for each axis that shows one extreme reading and no noise in several holds.

    Of readings whose noise is smaller than their step it cannot be told: any hold may be silent.

    Args:
        holds: as they were measured, without what rounding adds to their covariance.
        step: smallest step of the readings of each axis, shape (3,).
    """
    if len(holds) <= FEWEST:
        return []
    means = np.array([hold.accelerometer for hold in holds])
    variances = np.array([np.diag(hold.accelerometer_covariance) for hold in holds])
    samples = float(np.median([hold.samples for hold in holds]))
    notes = []
    for axis in range(3):
        usual = float(np.median(variances[:, axis]))
        if not usual * samples > step[axis] ** 2:
            continue
        silent = variances[:, axis] <= SILENT * usual
        for end in (means[:, axis].min(), means[:, axis].max()):
            # a mean of equal readings is theirs to rounding only
            count = int((np.isclose(means[:, axis], end, rtol=1e-9, atol=0.0) & silent).sum())
            if count >= FEWEST:
                notes.append(
                    f"the accelerometer's {'xyz'[axis]} axis stands at {end:.5g} without any noise "
                    f"in {count} holds: the end of its range. Set a larger range in the device and "
                    "measure again; this calibration is wrong"
                )
    return notes
