"""What every kind of row has in common: a residual, its derivatives, its noise and its labels.

Every sensor's model is ``x = M (y − b) − ε`` with any 3×3 matrix M. Rows differentiate by the
twelve *entries* of M (by rows) and b; a base model is a set of directions in these twelve (a
triangular M frees six of its nine entries). The sizes of the effects in ε follow, then *shared*
parameters that are neither: the dip of the place, errors of the reference.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import field

import numpy as np

from imucal_wizard.core.poses import AXES, DIRECTIONS, POSE_TOLERANCE_DEG, nearest_pose
from imucal_wizard.core.quantities import true_minus
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.rows.earth import EarthAxes
from imucal_wizard.model.terms import Term, Terms

ENTRIES = 12
"""M's nine entries by rows, then the three biases."""
MATRIX = slice(0, 9)
BIAS = slice(9, 12)


@dataclass(frozen=True, eq=False)
class Parameters:
    """One point in the space of parameters.

    Attributes:
        matrix: M, SI per reading unit, shape (3, 3).
        bias: b, reading unit, shape (3,).
        sizes: of the effects, shown units, shape (p,).
        shared: parameters that belong to the reference, shape (k,).
    """

    matrix: FloatArray
    bias: FloatArray
    sizes: FloatArray = field(default_factory=lambda: np.zeros(0))
    shared: FloatArray = field(default_factory=lambda: np.zeros(0))

    @property
    def entries(self) -> FloatArray:
        """M by rows and b, shape (12,)."""
        return np.concatenate([self.matrix.ravel(), self.bias])

    def moved(self, entries: FloatArray, sizes: FloatArray, shared: FloatArray) -> "Parameters":
        """The calibration with these changes added."""
        return Parameters(
            self.matrix + entries[MATRIX].reshape(3, 3),
            self.bias + entries[BIAS],
            self.sizes + sizes,
            self.shared + shared,
        )


@dataclass(frozen=True, eq=False)
class RowLabels:
    """What each of n rows is.

    Attributes:
        index: which hold, rotation or group of samples, shape (n,).
        axis: which component of its quantity, −1 where there is one only, shape (n,).
        group: what is left out together when the fit is judged on what it has not seen (a
            direction, a rotation), −1 for rows that always stay, shape (n,).
        visit: number of the rest that a row is a piece of, −1 where it is of none, shape (n,).
        time: s since the session's first sample, shape (n,).
        span: beginning and end in the recording's time, s, shape (n, 2).
        component: which of the source's variance components the row belongs to, shape (n,).
    """

    index: IntArray
    axis: IntArray
    group: IntArray
    visit: IntArray
    time: FloatArray
    span: FloatArray
    component: IntArray

    def __len__(self) -> int:
        return len(self.index)


def unmeasured(count: int, components: int = 1) -> RowLabels:
    """Labels of rows that nobody has measured: the items one after the other, nothing else."""
    index, none = np.repeat(np.arange(count), components), np.full(count * components, -1)
    zeros = np.zeros(len(index))
    return RowLabels(index, none, none, none, zeros, np.zeros((len(index), 2)), 0 * none)


class Rows(ABC):
    """The rows of one source at one calibration.

    Attributes:
        residual: measured less predicted, without the part that is linear in the shared
            parameters, in the row's unit, shape (n,).
        own: variance of each row by measured noise that it shares with no other, shape (n,).
        direction: up (or the field) as the row sees it, unit vectors, NaN in motion, (n, 3).
        lever: by how much each row moves with an error of the input on each axis, shape (n, 3).
    """

    residual: FloatArray
    own: FloatArray
    direction: FloatArray
    lever: FloatArray

    @abstractmethod
    def base_columns(self) -> FloatArray:
        """Derivative of the residual by the twelve entries of M and b, shape (n, 12)."""

    @abstractmethod
    def term_columns(self, terms: Sequence[Term]) -> FloatArray:
        """Derivative of the residual by the sizes of effects in turn, per shown unit, (n, p)."""

    def design_columns(self, terms: Sequence[Term]) -> FloatArray:
        """The same for effects that are not in the model: a cheaper approximation may do."""
        return self.term_columns(terms)

    def shared_columns(self) -> FloatArray:
        """Derivative by the source's shared parameters, shape (n, k)."""
        return np.zeros((len(self.residual), 0))

    @property
    def tilts(self) -> FloatArray:
        """Derivative by up in the holds at both ends: two components before, two after, (n, 4)."""
        return np.zeros((len(self.residual), 4))

    def loading(self) -> "Loading | None":
        """Measured noise that several rows share; None where there is none."""
        return None

    @property
    def slow(self) -> FloatArray:
        """Variance of each row by the part of that noise that is slow noise, shape (n,)."""
        return np.zeros(len(self.residual))

    @property
    def not_shown(self) -> FloatArray:
        """Variance of each row by effects that the readings do not show, a part of ``own``, (n,).

        It is a doubt of the model, and no noise within a hold.
        """
        return np.zeros(len(self.residual))


@dataclass(frozen=True, eq=False)
class Loading:
    """How n rows move with independent latent errors, each of variance one.

    Attributes:
        latent: numbers of the k latent errors that each row has a part in, shape (n, k).
        weight: by how much each of them moves the row, in the row's unit, shape (n, k).
    """

    latent: IntArray
    weight: FloatArray


@dataclass(frozen=True, eq=False)
class Influence:
    """Something that residuals may depend on.

    Attributes:
        name: ``force-x``.
        label: with its unit.
        values: per row, NaN where it is not known, shape (n,).
    """

    name: str
    label: str
    values: FloatArray


class RowSource(ABC):
    """One kind of row of one experiment.

    Attributes:
        kind: ``hold``, ``still``, ``rotation``, ``heading``, ``table``, ``field`` or ``dip``.
        unit: of the residual: ``m/s^2``, ``rad/s``, ``rad`` or ``uT``.
        judged: its errors are those reported for the sensor.
        confirms: its errors held out judge whether an effect is real.
        at_rest: means of readings in a hold.
        moving: measured while the device rotated, and compared with a reference at both ends.
        noise_is_measured: else the rows rest on another sensor whose own errors (iron, currents)
            nobody has measured, and only their scatter shows how well they are known.
        group_word: what a group of rows is called: "direction", "pose" or "rotation"; groups of
            sources with the same word and the same number are one.
        repeats_are_noise: rows of one pose differ by noise alone.
        needs_reference: they rest on gravity as the accelerometer's model sees it, so that what
            they show cannot be judged before that model is complete.
        labels: what each row is.
        part: what people call these data.
        prefix: with what the names of its pictures begin.
        left: what its residual is called.
        by_axis: rows of one item are axes, each drawn by itself; else components of one length.
        shared: names of the shared parameters that move its rows.
        shared_precision: precision of the prior of each, 0 where it is free.
        undetermined: names of those whose prior is a usual size that nothing measured: no noise.
        decided: names of those of these that the rows decide: their values are fitted and no error.
        bounded: names of those whose size is never far above the usual one, see ``Effect``.
        slow: names of those that are slow noise estimated from the rows themselves. They weigh the
            rows that share it; no reported error is freed from it, and no floor holds it.
        slow_freedom: degrees of freedom behind the slow noise that the rows share by ``loading``.
        exact_slope: the columns are the whole derivative of the residual; else a fit follows the
            columns alone, and the residual itself says nothing of how good a step is.
    """

    kind: str
    unit: str
    judged: bool = True
    confirms: bool = True
    at_rest: bool = False
    moving: bool = False
    noise_is_measured: bool = True
    group_word: str = "direction"
    repeats_are_noise: bool = True
    needs_reference: bool = False
    labels: RowLabels
    part: str
    prefix: str = ""
    left: str = "residual"
    by_axis: bool = False
    shared: tuple[str, ...] = ()
    shared_precision: tuple[float, ...] = ()
    undetermined: tuple[str, ...] = ()
    bounded: tuple[str, ...] = ()
    decided: tuple[str, ...] = ()
    slow: tuple[str, ...] = ()
    slow_freedom: float = float("inf")
    exact_slope: bool = True

    @property
    def poses(self) -> IntArray:
        """Number of the pose that each row repeats, −1 for none, shape (n,)."""
        return self.labels.group

    @abstractmethod
    def influences(self) -> tuple[Influence, ...]:
        """What the residuals may depend on, one value for each row."""

    @abstractmethod
    def per_item(self, of: Callable[[Circumstances], FloatArray]) -> FloatArray:
        """A function of the circumstances in each hold or group of samples, shape (k,).

        Of a rotation, where it is furthest from 0.
        """

    @abstractmethod
    def measured(self, row: int) -> tuple[FloatArray, str]:
        """What was read, shape (3,), and its unit; "" for that of the readings."""

    def samples_of(self, row: int) -> tuple[FloatArray, FloatArray] | None:
        """Times and readings of which a row was made, where they are kept."""
        del row
        return None

    @abstractmethod
    def at(self, calibration: Parameters, terms: Terms, near: Rows | None = None) -> Rows:
        """The rows at a calibration.

        Args:
            calibration: the parameters; ``shared`` are those of this source.
            terms: the effects.
            near: the rows of a calibration close by, from which effects may be evaluated.
        """

    def under(self, up: FloatArray, doubt: FloatArray, usual: int, decided: int) -> "RowSource":
        """The same rows with other directions of gravity in the holds.

        Args:
            up: unit vectors, shape (h, 3).
            doubt: change of ``up`` with each of the k ways in which the accelerometer may be wrong
                by one standard deviation, shape (h, 3, k).
            usual: how many of them, the last, nothing measured: parameters of usual size.
            decided: how many of these, the first, are left to the rotations.
        """
        del up, doubt, usual, decided  # for rows that rest on gravity
        return self

    def on_earth(self, earth: EarthAxes) -> "RowSource":
        """The same rows with the Earth's rate among the parameters that they share."""
        del earth  # for rows that rates move
        return self

    def elsewhere(
        self, directions: FloatArray, calibration: Parameters, terms: Terms
    ) -> "RowSource":
        """Rows as a new measurement without noise would make them, in other directions.

        Args:
            directions: of the true input, unit vectors, shape (d, 3).
            calibration: of the sensor.
            terms: its effects.

        Returns:
            These rows themselves where nothing else can be measured.
        """
        del directions, calibration, terms
        return self

    @property
    def joined(self) -> IntArray:
        """Numbers of the holds that each row's rotation joins, −1 for a row of none, shape (n, 2).

        By the numbers that rows at rest have as labels.
        """
        return np.full((len(self.labels), 2), -1)

    @property
    def indifferent(self) -> BoolArray:
        """Rows that speak for and against no model, because their noise is a mere bound, (n,).

        They agree by far better than it where rounding turns equal inputs into equal readings.
        """
        return np.zeros(len(self.labels), np.bool_)

    @property
    def item_word(self) -> str:
        """What a hold, a rotation or a group of samples is called."""
        return "rotation" if self.moving else "hold" if self.at_rest else self.group_word

    def item(self, row: int) -> int:
        """Number of the hold, rotation or group of samples that a row is of, from 0."""
        return int(self.labels.index[row])

    def place(self, row: int) -> str:
        """What a row is, in words: ``hold 7, +x up``, ``rotation 3``, ``field along +x−y``."""
        return f"rotation {self.labels.index[row] + 1}"

    def axes(self) -> Iterator[tuple[int, str, str]]:
        """Axis, name and prefix of each part that is drawn by itself; axis −1 for all rows."""
        if not self.by_axis:
            yield -1, self.part, self.prefix
            return
        for place, axis in enumerate(AXES):
            yield place, f"{self.part}, {axis} axis", f"{self.prefix}{axis}-"


def hold_influences(c: Circumstances, number: IntArray) -> tuple[Influence, ...]:
    """What the readings of holds may depend on.

    Args:
        c: of the holds, one row for each.
        number: of each hold, from 0, shape (n,).
    """
    force, before = c.force / STANDARD_GRAVITY, c.previous / STANDARD_GRAVITY
    names, order = [_pose(one) for one in c.force], list(DIRECTIONS)
    poses = [np.nan if name is None else order.index(name) + 1.0 for name in names]
    return (
        *(Influence(f"force-{a}", f"force along {a}, g", force[:, k]) for k, a in enumerate(AXES)),
        Influence("pose", "pose: 6 faces, 12 edges, 8 corners", np.array(poses)),
        Influence("number", "number of the hold", np.asarray(number + 1.0, np.float64)),
        Influence("time", "time, min", c.time / 60.0),
        Influence("temperature", "temperature, °C", c.temperature),
        *(
            Influence(f"previous-{axis}", f"force along {axis} in the pose before, g", before[:, k])
            for k, axis in enumerate(AXES)
        ),
        Influence("vibration", "vibration, mg rms", np.sqrt(c.vibration) / STANDARD_GRAVITY * 1e3),
    )


def hold_place(number: int, force: FloatArray) -> str:
    """A hold in words, by its number from 0 and its specific force, zero where it is unknown."""
    if not force.any():
        return f"hold {number + 1}"
    pose = _pose(force)
    return f"hold {number + 1}, {true_minus(pose) + ' up' if pose else 'between poses'}"


def _pose(force: FloatArray) -> str | None:
    if not force.any():
        return None
    return nearest_pose(force, DIRECTIONS, POSE_TOLERANCE_DEG)


def reference_names(doubt: FloatArray) -> tuple[str, ...]:
    """Names of the shared parameters of k error modes of the accelerometer, shape (…, k)."""
    return tuple(f"accelerometer_{k}" for k in range(doubt.shape[-1]))


def slow_names(loading: FloatArray) -> tuple[str, ...]:
    """Names of the shared parameters of slow noise, of m latent errors, shape (n, m)."""
    return tuple(f"slow_{k}" for k in range(loading.shape[1]))


def rounding_names(variance: FloatArray, kind: str = "rounding") -> tuple[str, ...]:
    """Names of the shared parameters of rounding: the axes whose readings at rest it shifts."""
    return tuple(f"{kind}_{'xyz'[axis]}" for axis in np.flatnonzero(variance))
