"""The texts of the procedure."""

from imucal_wizard.core.poses import NAMED, TILT_SIGN, rotation_towards
from imucal_wizard.core.quantities import true_minus
from imucal_wizard.core.readings import FloatArray

PUT_BACK = "lift it and put it back the same way"
"""Guidance if the wanted pose is the present one, whose hold no longer counts."""


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


def how_to_turn(up: FloatArray, pose: str) -> str:
    """The way to a pose: "23° away: turn it about z, to the left"."""
    return how_to_reach(up, NAMED[pose])


def how_to_reach(up: FloatArray, wanted: FloatArray) -> str:
    """The same for a direction without a name."""
    axis, sense, angle = rotation_towards(up, wanted)
    return f"{angle:.0f}° away: turn it about {axis}, to the {sense}"


def lift_and_reach(up: FloatArray, wanted: FloatArray) -> str:
    """The same for a spent placement: "lift it, then turn it about z, to the left"."""
    axis, sense, _ = rotation_towards(up, wanted)
    return f"lift it, then turn it about {axis}, to the {sense}"


def signed(degrees: float) -> str:
    """An angle with its sign: "−73°"."""
    return true_minus(f"{degrees:+.0f}°")


def plural(count: int, word: str) -> str:
    """A count with its noun."""
    return f"{count} {word}" if count == 1 else f"{count} {word}s"
