"""The texts of the procedure."""

from imucal_wizard.core.poses import TILT_SIGN
from imucal_wizard.core.quantities import true_minus

PUT_BACK = "lift it and put it back the same way"
"""Guidance if the wanted pose is the present one, whose hold no longer counts."""


THERE = "there: hold it still"
"""Guidance in the wanted pose."""
HOLD_STILL, ALL_TAKEN = "HOLD STILL", "ALL TAKEN"
"""Instructions: hold it where it is; the step has all that it needs."""
DISTURBED, NO_FIELD = "DISTURBED", "NO FIELD"
"""Headlines while iron or a magnet changes the field, and while the magnetometer sends nothing."""
TURN_ROUND, TUMBLE = "TURN IT ROUND", "TUMBLE IT"
"""Instructions: a circle on the face that is down; any motion."""


def label(pose: str) -> str:
    """A pose in capitals: ``+x-y`` is "+X −Y", ``+z~-x`` is "+Z TO −X"."""
    if TILT_SIGN in pose:
        return " TO ".join(map(label, pose.split(TILT_SIGN)))
    faces = [pose[index : index + 2] for index in range(0, len(pose), 2)]
    return true_minus(" ".join(faces).upper())


def turn_up(pose: str) -> str:
    """The instruction to take a pose: "TURN +X −Y UP", "TILT +Z TO −X"."""
    return f"TILT {label(pose)}" if TILT_SIGN in pose else f"TURN {label(pose)} UP"


def lay_down(face: str) -> str:
    """The instruction to lay a face on the table: "LAY −Z DOWN"."""
    return f"LAY {label(face)} DOWN"


def signed(degrees: float) -> str:
    """An angle with its sign: "−73°"."""
    return true_minus(f"{degrees:+.0f}°")
