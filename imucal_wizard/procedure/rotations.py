"""A rotation: the samples between two holds, and whether they can be trusted."""

from dataclasses import dataclass

from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray


@dataclass(frozen=True, eq=False)
class Rotation:
    """The motion between two holds.

    Attributes:
        before: the hold it starts from.
        after: the hold it ends in.
        time: gyroscope sample times from inside ``before`` to inside ``after``, s, shape (n,).
        rate: gyroscope readings at these times, shape (n, 3), rad/s or counts.
        axis: the body axis it was about (``x``, ``y``, ``z``), or None when about none of them.
        accelerometer: accelerometer readings at these times, shape (n, 3), or None when not kept;
            they let the fit begin without knowing the gyroscope's unit.
        problem: why it cannot be used (a gap, clipping), or None.
    """

    before: Hold
    after: Hold
    time: FloatArray
    rate: FloatArray
    axis: str | None = None
    problem: str | None = None
    accelerometer: FloatArray | None = None
