"""The actions of the virtual hand, and the names of poses."""

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass

TILT_SEPARATOR = "~"
TILT = np.pi / 6.0
"""Tilt of a pose such as ``+z~+x``: the +z face on top, tilted 30° towards +x."""
MAX_REST_SECONDS = 1e6
"""Longest rest in one action, s: eleven days, more than any measurement."""
MAX_ROTATION_DEG = 36_000.0
"""Largest rotation in one action, degrees: a hundred turns, more than any hand makes."""
PLACEMENT_ERROR_DEG = 1.5
"""Placement error of a hand, standard deviation per axis, degrees."""


@dataclass(frozen=True)
class LieStill:
    """Lie still for ``seconds``."""

    seconds: float


@dataclass(frozen=True)
class Rotate:
    """Rotate about one body axis, with the wobble of a hand about the others.

    Attributes:
        axis: ``x``, ``y`` or ``z``.
        degrees: signed angle, right-handed about the axis.
        fastest: peak rate, °/s; None for a leisurely one.
        error: standard deviation per axis of the final attitude, degrees.
    """

    axis: str
    degrees: float
    fastest: float | None = None
    error: float = 0.5


@dataclass(frozen=True)
class PlacePose:
    """Bring a direction on top by the shortest rotation.

    Attributes:
        target: pose name as in ``+x-y``, or an up direction in the body frame.
        error: placement error, standard deviation per axis, degrees.
        fastest: peak rate, °/s; None for a leisurely one.
    """

    target: str | tuple[float, float, float]
    error: float = PLACEMENT_ERROR_DEG
    fastest: float | None = None


@dataclass(frozen=True)
class Tremble:
    """Hold the device in the hand (True) or lay it down (False) from now on."""

    on: bool


@dataclass(frozen=True)
class Shake:
    """Let the support vibrate with this rms per axis, m/s², from now on; 0 for none."""

    rms: float


@dataclass(frozen=True)
class PassSteel:
    """Let a steel object pass by, for ``moves.STEEL_SECONDS``.

    Attributes:
        field: its contribution to the field at the nearest point, µT: east, north, up.
    """

    field: tuple[float, float, float] = (9.0, 13.0, -11.0)


Action = LieStill | Rotate | PlacePose | Tremble | Shake | PassSteel


def direction(target: str | tuple[float, float, float] | FloatArray) -> FloatArray:
    """The unit up direction of a pose: ``+x``, ``+x-y``, ``+x-y+z``, or any vector.

    Raises:
        UsageError: there is no such pose, or the vector has no direction.
    """
    vector = _named(target) if isinstance(target, str) else np.array(target, float)
    length = float(np.sqrt((vector * vector).sum()))
    if vector.shape != (3,) or not np.isfinite(length) or length == 0.0:
        raise UsageError(f"{target!r} is not a direction; give three numbers or a pose like +x-y")
    return vector / length


def check_action(action: Action) -> None:
    """Refuse a command that cannot be carried out.

    Raises:
        UsageError: there is no such pose or axis, or a rest or angle is impossible.
    """
    match action:
        case PlacePose(target):
            direction(target)
        case LieStill(seconds) if not 0.0 <= seconds <= MAX_REST_SECONDS:
            raise UsageError(f"a rest of {seconds:g} s is impossible; give 0 to 1000000 s")
        case Rotate(axis) if axis not in tuple(AXES):
            raise UsageError(f"{axis!r} is not an axis; turn about x, y or z")
        case Rotate(_, degrees) if not abs(degrees) <= MAX_ROTATION_DEG:
            raise UsageError(f"a turn of {degrees:g}° is impossible; give at most 36000°")


def _named(name: str) -> FloatArray:
    if TILT_SEPARATOR in name:
        top, _, side = name.partition(TILT_SEPARATOR)
        return np.asarray(np.cos(TILT) * _named(top) + np.sin(TILT) * _named(side))
    vector = np.zeros(3)
    signs, letters = name[::2], name[1::2]
    known = len(signs) == len(letters) > 0 and set(signs) <= set("+-") and set(letters) <= set(AXES)
    if not known or len(set(letters)) != len(letters):
        raise UsageError(f"{name!r} is not a pose; give faces that point up, like +x, +x-y, -x+y+z")
    for sign, letter in zip(signs, letters, strict=True):
        vector[AXES.index(letter)] = 1.0 if sign == "+" else -1.0
    return vector
