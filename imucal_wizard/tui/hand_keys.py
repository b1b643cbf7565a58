"""Keys that move the virtual device."""

from typing import TYPE_CHECKING

from imucal_wizard.tui.source import Hand

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.procedure.state import Status

STEP_DEG = 15.0
"""One press turns the device by this much."""
CIRCLE_DEG = 372.0
"""Once round, and a little more."""

_TURNS: dict[str, tuple[str, float]] = {
    "left": ("z", STEP_DEG),
    "right": ("z", -STEP_DEG),
    "up": ("y", STEP_DEG),
    "down": ("y", -STEP_DEG),
    "a": ("x", STEP_DEG),
    "d": ("x", -STEP_DEG),
}
"""The first key of each pair turns to the left, the second to the right, as the wizard says it."""


class HandKeys:
    """Turns keys into what the virtual hand does.

    Args:
        hand: the hand.
    """

    def __init__(self, hand: Hand) -> None:
        self._hand = hand

    @property
    def following(self) -> bool:
        """Whether the hand does by itself what the wizard asks."""
        return self._hand.following

    def press(self, key: str, status: "Status | None") -> bool:
        """Do what the key means; False when it means nothing to the hand."""
        if key in _TURNS:
            self._hand.turn(*_TURNS[key])
        elif key == "space":
            self._do(status)
        elif key in ("T", "upper_t"):
            self._hand.tremble(not self._hand.trembling)
        elif key in ("S", "upper_s"):
            self._hand.pass_steel()
        elif key in ("H", "upper_h"):
            self._hand.following = not self._hand.following
        else:
            return False
        return True

    def _do(self, status: "Status | None") -> None:
        """Bring the pose that is asked for, or turn the face that lies there once round."""
        target = _asked_for(status)
        field = None if status is None else status.field
        if target:
            self._hand.snap_to(target)
        elif field is not None and field.face is not None:
            self._hand.turn(field.face[1], CIRCLE_DEG)


def _asked_for(status: "Status | None") -> str | None:
    if status is None:
        return None
    if status.rotation is not None:
        return status.rotation.start_pose
    return status.wanted
