"""What the procedure hands to the solver."""

from dataclasses import dataclass

from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.rotations import Rotation
from imucal_wizard.readings import FloatArray, Series


@dataclass(frozen=True, eq=False)
class Collected:
    """What the procedure has measured: the input of the solver.

    The fit takes all holds and rotations alike; ``up_down``, ``poses`` and ``turns`` say for
    whoever looks at how the procedure went which of them counted for which step.

    Attributes:
        holds: all holds kept, in time order.
        rotations: all motions between neighbouring holds, good and rejected.
        up_down: indices of the holds that belong to the up/down step.
        poses: indices of the holds that belong to the 18 poses.
        turns: indices into ``rotations`` of the rotations of the rotation step.
        validation: holds that the fit must not see.
        magnetometer: every sample of it in time order, or None without one.
        field_spans: sample times (from, to) of the field step, s, without what was taken back or
            disturbed.
        field_left_out: what was disturbed in it: from, to, s, and the reason.
        steps: smallest step of each accelerometer and of each gyroscope axis in all samples, shape
            (3,) each, 0 where none was seen; None when nobody has looked.
    """

    holds: tuple[Hold, ...]
    rotations: tuple[Rotation, ...]
    up_down: tuple[int, ...] = ()
    poses: tuple[int, ...] = ()
    turns: tuple[int, ...] = ()
    validation: tuple[Hold, ...] = ()
    magnetometer: Series | None = None
    field_spans: tuple[tuple[float, float], ...] = ()
    field_left_out: tuple[tuple[float, float, str], ...] = ()
    steps: tuple[FloatArray, FloatArray] | None = None
