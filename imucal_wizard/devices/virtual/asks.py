"""What the hand reads of the wizard: the step and what is asked for, never what is measured."""

from typing import Protocol


class StillLike(Protocol):
    """What is read of the stillness."""

    @property
    def held(self) -> float:
        """Seconds of the present hold so far."""

    @property
    def needed(self) -> float:
        """Seconds wanted."""


class RotationLike(Protocol):
    """What is read of the rotations."""

    @property
    def axis(self) -> str:
        """The axis asked for."""

    @property
    def start_pose(self) -> str:
        """The pose to start from."""

    @property
    def done(self) -> tuple[float, ...]:
        """Rotations counted so far about that axis."""


class FieldLike(Protocol):
    """What is read of the magnetometer's step."""

    @property
    def face(self) -> str | None:
        """The face to be laid on the table; None where any motion will do."""


class StatusLike(Protocol):
    """What is read of ``procedure.state.Status``."""

    @property
    def step(self) -> str:
        """Name of the step."""

    @property
    def still(self) -> StillLike:
        """Whether it is still, and for how long."""

    @property
    def wanted(self) -> str | None:
        """The pose asked for."""

    @property
    def wanted_up(self) -> tuple[float, float, float] | None:
        """Where up is in the pose asked for, when it has no name."""

    @property
    def missing(self) -> tuple[str, ...]:
        """Poses still to take."""

    @property
    def rotation(self) -> RotationLike | None:
        """The rotation asked for."""

    @property
    def field(self) -> FieldLike | None:
        """The circle asked for."""

    @property
    def holds(self) -> int:
        """Holds kept so far."""
