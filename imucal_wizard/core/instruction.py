"""The procedure's current request to whoever moves the device, published after each block."""

from imucal_wizard.core.records import dataclass


@dataclass(frozen=True)
class RotationRequest:
    """A requested rotation.

    Attributes:
        axis: ``x``, ``y`` or ``z`` of the body.
        start_pose: name of the pose to start from.
        done: signed angles of the rotations already measured about this axis, degrees.
        angle: signed angle that is asked for next, degrees.
        fastest: peak rate that is asked for, °/s.
    """

    axis: str
    start_pose: str
    done: tuple[float, ...] = ()
    angle: float = 90.0
    fastest: float = 120.0


@dataclass(frozen=True)
class Instruction:
    """The request at one moment; it contains nothing of what was measured.

    Attributes:
        step: name of the step.
        pose: name of the requested pose, or its up direction in the body frame; None for none.
        rotation: the requested rotation, or None.
        circles: whether the magnetometer's circles are requested.
        face: the face that points down during the circle; None if any motion will do.
        held: duration of the current hold, s.
        needed: duration that a hold must reach, s.
        holds: number of holds recorded so far.
    """

    step: str
    pose: str | tuple[float, float, float] | None = None
    rotation: RotationRequest | None = None
    circles: bool = False
    face: str | None = None
    held: float = 0.0
    needed: float = 0.0
    holds: int = 0
