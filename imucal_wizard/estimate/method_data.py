"""What a published method is given, and how its result is judged.

A method file holds the method and nothing else: from points it makes a ``MethodEstimate``. The data
of a sensor know how to judge any calibration, so that all methods of a sensor have the same errors,
the same error held out and the same parameters, and can be compared.
"""

from collections.abc import Callable, Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Protocol

from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.core.records import dataclass

if TYPE_CHECKING:
    from imucal_wizard.estimate.methods.single_axis import AxisTurn
    from imucal_wizard.estimate.result import SensorFit
    from imucal_wizard.measurement.holds import Hold


@dataclass(frozen=True, eq=False)
class MethodEstimate:
    """``|M (z − b)| = 1`` for readings in units of the magnitude.

    Attributes:
        matrix: M in any gauge, shape (3, 3).
        bias: b, shape (3,).
        iterations: how many it took.
        each_axis_alone: it looks at one axis at a time; squares of angles do not lengthen it.
    """

    matrix: FloatArray
    bias: FloatArray
    iterations: int = 1
    each_axis_alone: bool = False


Estimator = Callable[[FloatArray, IntArray], MethodEstimate]
"""From all points, shape (n, 3), and the rows to be used, to a calibration; DataError if none."""


class Magnitudes(Protocol):
    """Readings of a vector of constant magnitude: accelerometer at rest, or magnetometer."""

    @property
    def points(self) -> FloatArray:
        """Readings made dimensionless, about a centre and in units of the magnitude, (n, 3)."""

    @property
    def free(self) -> tuple[int, ...]:
        """Which of b and M's xx, xy, xz, yy, yz, zz the points determine; all angles or none."""

    @property
    def cross(self) -> bool:
        """Whether the three off-diagonal entries are among them."""

    @property
    def start(self) -> FloatArray:
        """B and M of a sphere through the points, shape (9,)."""

    @property
    def faces(self) -> Mapping[str, IntArray]:
        """Rows with each face on top, by ``+x``, ``-x`` …; faces without any are left out."""

    def without_angles(self, reason: str) -> "Magnitudes":
        """The same with bias and scale alone free, for the reason given."""

    def judged(self, method: str, estimate: Estimator, biased: bool = False) -> "SensorFit":
        """The result of a method, with its errors on what was fitted and on what was left out.

        Args:
            method: its name.
            estimate: makes the calibration.
            biased: errors of the method itself exceed those by noise, so that it has no standard
                errors.
        """


@dataclass(frozen=True, eq=False)
class AxisTurns:
    """The rotations about one body axis.

    Attributes:
        turns: angle, integrated reading, duration and rest bias of each.
        places: which of all usable rotations each is.
    """

    turns: "tuple[AxisTurn, ...]"
    places: tuple[int, ...]

    def __len__(self) -> int:
        return len(self.turns)

    def without(self, place: int | None) -> "list[AxisTurn]":
        """The rotations but one."""
        return [one for one, at in zip(self.turns, self.places, strict=True) if at != place]


@dataclass(frozen=True, eq=False)
class GyroscopeData:
    """Rests and rotations of a gyroscope, as a method takes them.

    Attributes:
        holds: still periods.
        labels: number of each hold's position, shape (n,).
        unit: of the readings.
        rounding: variance by which the steps of the readings shift all rests alike, shape (3,).
        full: the nine-parameter fit; None where the method looks at the rests alone.
        axes: rotations about each body axis.
        channels: which sensor axis feels each body axis.
        slow: variance by slow noise of the rests before the rotations about each axis, (3,) each.
        closure: closure error of every rotation, rad, shape (m, 3), from M and b, one for all or
            one for each.
    """

    holds: "tuple[Hold, ...]"
    labels: IntArray
    unit: str
    rounding: FloatArray | float = 0.0
    full: "SensorFit | None" = None
    axes: Mapping[str, AxisTurns] = field(default_factory=dict)
    channels: tuple[int, ...] = (0, 1, 2)
    slow: Mapping[str, FloatArray] = field(default_factory=dict)
    closure: Callable[[FloatArray, FloatArray], FloatArray] | None = None
