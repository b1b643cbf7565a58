"""A field that changes while it is measured, without any law: it jumps, or differs for a while.

Somebody moves a chair, a lift goes by, the device is carried to another desk. No effect of a
magnetometer jumps; without these a jump would be given the name of the drift that is most like it.
Only rows of a magnetometer are looked at: the other sensors have a bias step in their catalogue,
and nothing passes by that gravity would notice.
"""

from collections.abc import Iterator

import numpy as np

from imucal_wizard.bench.hypotheses import UNKNOWN, Hypothesis
from imucal_wizard.bench.misfit import Misfit, RowKind
from imucal_wizard.bench.noise import Frame
from imucal_wizard.bench.unknown import SIZES
from imucal_wizard.readings import FloatArray

PRIOR = 0.06
"""As likely before any data as structure over the sphere."""
MOMENTS = 15
"""At which it may jump, evenly over the rows in their order of time."""
WINDOWS = (0.08, 0.2)
"""Shares of the rows during which it may differ."""
FEWEST = 12
"""Rows with fewer of which no course is looked for."""


def passing(misfit: Misfit, frame: Frame) -> list[Hypothesis]:
    """Jumps, and stretches in which the field differs, at every time."""
    field = misfit.kind >= RowKind.FIELD
    if field.sum() < FEWEST:
        return []
    courses = list(_courses(misfit.time, field))
    usual = float(np.median(misfit.sigma[field]))
    shown = misfit.lever * (usual / misfit.sigma)[:, None]
    prior = float(np.log(PRIOR / len(courses)))
    return [
        Hypothesis(
            UNKNOWN, (), (UNKNOWN,), None, "", prior, frame.across.T @ (shown * one[:, None]), SIZES
        )
        for one in courses
    ]


def _courses(time: FloatArray, field: np.ndarray) -> Iterator[FloatArray]:
    """1 where the field is another one, else 0, shape (n,)."""
    moments = np.sort(time[field])
    for share in np.linspace(0.0, 1.0, MOMENTS + 2)[1:-1]:
        yield (time >= np.quantile(moments, share)).astype(float)
    for width in WINDOWS:
        for start in np.arange(0.0, 1.0 - 0.5 * width, 0.5 * width):
            low, high = np.quantile(moments, [start, min(start + width, 1.0)])
            yield ((time >= low) & (time <= high)).astype(float)
