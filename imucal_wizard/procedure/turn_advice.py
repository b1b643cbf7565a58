"""What is still missing among the rotations about one axis: the other sense, another speed."""

from collections.abc import Sequence

from imucal_wizard.procedure.ledger import KeptRotation
from imucal_wizard.procedure.rotation_check import speeds

FAST = 150.0
SLOW = 60.0
"""Peak rates, °/s, that count as fast and as slow when advice is given."""


def senses(turns: Sequence[KeptRotation]) -> tuple[bool, bool]:
    """Whether it has been turned to the left, and to the right."""
    angles = [turn.angle for turn in turns]
    return any(angle > 0.0 for angle in angles), any(angle < 0.0 for angle in angles)


def advice(turns: Sequence[KeptRotation], *, scale_known: bool) -> str:
    """What to do differently in the next turn, or "".

    Args:
        turns: those taken about this axis.
        scale_known: the gyroscope's readings have a unit.
    """
    left, right = senses(turns)
    if left != right:
        return f"turn to the {'right' if left else 'left'} too"
    peaks = [turn.fastest for turn in turns]
    if not peaks or speeds(peaks) >= 3:
        return ""
    if not scale_known:
        return "turn at another speed too"
    if max(peaks) < FAST:
        return "go faster"
    return "go slower" if min(peaks) > SLOW else "take a middle speed too"
