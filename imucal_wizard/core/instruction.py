"""What the procedure asks of whoever moves the device, published after each block of samples."""

from imucal_wizard.core.records import dataclass


@dataclass(frozen=True)
class RotationRequest:
    """A rotation that is asked for.

    Attributes:
        axis: ``x``, ``y`` or ``z`` of the body.
        start_pose: name of the pose to start from.
        done: signed angles of the rotations already taken about this axis, degrees.
    """

    axis: str
    start_pose: str
    done: tuple[float, ...] = ()


@dataclass(frozen=True)
class Instruction:
    """What is asked for at one moment; nothing in it tells what was measured.

    Attributes:
        step: name of the step.
        pose: name of the pose asked for, or its up direction in the body frame; None for none.
        rotation: the rotation asked for, or None.
        circles: the magnetometer's circles are asked for.
        face: the face to lie on the table while it is turned; None where any motion serves.
        held: seconds of the present hold.
        needed: seconds that a hold must last.
        holds: number of holds kept so far.
    """

    step: str
    pose: str | tuple[float, float, float] | None = None
    rotation: RotationRequest | None = None
    circles: bool = False
    face: str | None = None
    held: float = 0.0
    needed: float = 0.0
    holds: int = 0
