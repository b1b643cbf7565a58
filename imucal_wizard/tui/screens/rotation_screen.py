"""The rotations about x, y and z between still periods."""

import math
from typing import ClassVar

from textual.app import ComposeResult

from imucal_wizard.live.snapshot import Snapshot
from imucal_wizard.procedure.poses import DIRECTIONS
from imucal_wizard.procedure.state import Status, StepKind
from imucal_wizard.tui.cube import Matrix, Vector, about, product, tilted
from imucal_wizard.tui.screens.step_screen import StepScreen
from imucal_wizard.tui.widgets.rotation_panel import RotationPanel

_SWING_DEG = 90.0
_SWING_SECONDS = 4.0
ENOUGH_DEG = 20.0
"""A turn smaller than this says too little."""
_AXES: dict[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


class RotationScreen(StepScreen):
    """Turn about one axis, stop, hold still; both senses, several speeds."""

    step = StepKind.ROTATIONS
    wanted_title: ClassVar[str] = "do this"

    def below(self) -> ComposeResult:
        """Angle, rate, done and wanted."""
        yield RotationPanel()

    def take(self, snapshot: Snapshot) -> None:
        """Show a snapshot."""
        super().take(snapshot)
        if snapshot.status.rotation is not None:
            self.query_one(RotationPanel).tell(snapshot.status.rotation)

    def in_place(self, status: Status) -> bool:
        """At the end of a turn that is large enough to count."""
        return status.rotation is not None and abs(status.rotation.angle) > ENOUGH_DEG

    def wanted_attitude(self, status: Status, now: Matrix) -> tuple[Matrix | None, str]:
        """The turn that is meant."""
        return swinging(status, now)


def swinging(status: Status, now: Matrix) -> tuple[Matrix | None, str]:
    """The start pose, swinging about the wanted axis to show what is meant; and that axis."""
    rotation = status.rotation
    if rotation is None or rotation.start_pose not in DIRECTIONS:
        return None, ""
    x, y, z = (float(value) for value in DIRECTIONS[rotation.start_pose])
    if status.guidance:  # the start pose comes first
        return tilted(now, (x, y, z)), rotation.axis
    phase = 2.0 * math.pi * status.elapsed / _SWING_SECONDS
    angle = math.radians(_SWING_DEG) * math.sin(phase)
    start = tilted(now, (x, y, z))
    return product(start, about(_AXES[rotation.axis], angle)), rotation.axis
