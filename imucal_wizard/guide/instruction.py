"""The one instruction of the moment, made from the step, the device, and the stream.

A step says what it needs (``Status`` with its ``act``); ``present`` turns that into the words and
the turn that the operator sees, or replaces it where nothing can be measured now. Every panel of a
screen shows this value.
"""

import math
from dataclasses import replace

from imucal_wizard.core.records import dataclass
from imucal_wizard.guide.kinds import Act, StepKind
from imucal_wizard.guide.operator_view import (
    IDENTITY,
    Matrix,
    Turn,
    Vector,
    turn_about,
    turn_to,
)
from imucal_wizard.guide.state import Status, StillStatus

_WAITING_STEPS = (StepKind.SOURCE, StepKind.RESULT, StepKind.SAVE, StepKind.VERDICT)
"""Steps that need no samples; their screens have no instruction for the device."""
_AXES: dict[str, Vector] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}


@dataclass(frozen=True)
class Flow:
    """Whether samples arrive.

    Attributes:
        connected: the port is open.
        stalled: it is open, but no samples arrive.
        ended: the source has ended.
    """

    connected: bool = True
    stalled: bool = False
    ended: bool = False


FLOWING = Flow()


def interruption(flow: Flow) -> tuple[Act, str] | None:
    """Why no samples arrive, as act and headline; None if nothing keeps them away."""
    if flow.ended:
        return Act.ENDED, "DATA ENDED"
    if not flow.connected:
        return Act.CONNECT, "NOT CONNECTED"
    return (Act.CONNECT, "NO SAMPLES") if flow.stalled else None


def present(status: Status, attitude: Matrix | None = None, flow: Flow = FLOWING) -> Status:
    """The status with its one instruction.

    Args:
        status: what the step needs.
        attitude: of the device as it is drawn, body to world; None to take any heading.
        flow: whether samples arrive.
    """
    missing = None if status.step in _WAITING_STEPS else interruption(flow)
    if missing is not None:
        return _nothing_arrives(status, *missing)
    if attitude is None and status.up is not None:
        attitude = turn_to(IDENTITY, status.up).of(IDENTITY)
    turn = None if attitude is None else _turn(status, attitude)
    return replace(status, turn=turn, guidance=_way(status, turn) or status.guidance)


def _nothing_arrives(status: Status, act: Act, headline: str) -> Status:
    """Nothing that the operator does with the device would be measured."""
    detail = "nothing more can be measured" if act is Act.ENDED else ""
    rotation = status.rotation
    if rotation is not None:  # a rotation across a gap is not used
        rotation = replace(rotation, angle=0.0, rate=0.0, fastest=0.0, clips=False)
    done, wanted = status.progress
    if status.step is StepKind.SETTLE:  # it is one rest, and begins again
        done = 0.0
    return replace(
        status,
        rotation=rotation,
        progress=(done, wanted),
        act=act,
        instruction=headline,
        detail=detail,
        guidance="",
        reason="",
        turn=None,
        aim=None,
        still=StillStatus(needed=status.still.needed),
        offers=tuple(one for one in status.offers if one.command == "skip"),
        last_event=None,
    )


def _turn(status: Status, attitude: Matrix) -> Turn | None:
    """The turn that brings the device where it is wanted."""
    if status.act is Act.POSE and status.aim is not None:
        return turn_to(attitude, status.aim)
    if status.act is Act.ROTATE and status.rotation is not None:
        asked = status.rotation
        return turn_about(attitude, _AXES[asked.axis], math.radians(asked.left))
    return None


def _way(status: Status, turn: Turn | None) -> str:
    """The turn in words."""
    if turn is None:
        return ""
    if status.act is Act.POSE and status.off_by is not None:
        if status.still.still and status.still.spent:
            return f"lift it, then tip it {turn.words}"
        return f"{status.off_by:.0f}° away: tip it {turn.words}"
    if status.act is Act.ROTATE and status.rotation is not None:
        return f"tip it {turn.words}, {status.rotation.asked}"
    return ""
