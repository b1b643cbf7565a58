"""An experiment: rows of one sensor, its base model, and where a fit of it begins."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import field
from typing import TYPE_CHECKING

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray, Readings
from imucal_wizard.core.records import dataclass
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.rows.source import ENTRIES, Parameters, RowSource
from imucal_wizard.model.terms import Terms

if TYPE_CHECKING:
    from imucal_wizard.estimate.fit import Minimum
    from imucal_wizard.estimate.result import GravityReference, Parameter, SensorFit
    from imucal_wizard.estimate.settling import CommonSettling
    from imucal_wizard.estimate.table_steps import TableData


@dataclass(frozen=True, eq=False)
class Directions:
    """What of a base model is fitted.

    Attributes:
        columns: free directions of the twelve entries of M and b, shape (12, p).
        names: of these directions.
        terms: of the base model, of which something is fitted.
        dropped: names of parameters that keep their nominal value.
        reason: why, in one sentence, or "".
        precision: of priors on these directions, shape (p,); none by default.
    """

    columns: FloatArray
    names: tuple[str, ...]
    terms: tuple[str, ...]
    dropped: tuple[str, ...] = ()
    reason: str = ""
    precision: FloatArray = field(default_factory=lambda: np.zeros(0))

    def __len__(self) -> int:
        return int(self.columns.shape[1])

    @property
    def slow(self) -> "np.ndarray":
        """Which of them slow changes may move: those with a part in a bias, shape (p,)."""
        return np.asarray((self.columns[9:] != 0.0).any(axis=0))


@dataclass(frozen=True, eq=False)
class Beside:
    """What was read beyond the true input, beside what a model reads.

    The true force of a hold is gravity in the direction found by the model, or by the whole base
    where a part of it is left out; the true rate at rest is zero. Plotted over the true input, an
    empty model is a horizontal line, a bias shifts it, a scale inclines it, and the difference
    between readings and model is what the model lacks.

    Attributes:
        title: what it is.
        unit: of both.
        read: shape (n, 3).
        model: shape (n, 3).
        source: the rows that they belong to.
        rows: which of them, shape (n,).
    """

    title: str
    unit: str
    read: FloatArray
    model: FloatArray
    source: RowSource
    rows: IntArray


class Experiment(ABC):
    """All that was measured of one sensor, as rows.

    Attributes:
        sensor: whose.
        unit: of the readings.
        error_unit: of the errors that are reported: ``m/s^2``, ``rad`` or ``uT``.
        method: what the fit is called.
        frame: ``own``, or ``accelerometer`` where the reference is another sensor's.
        gravity: m/s².
        base_terms: the terms of the whole base model, in their usual order.
        sources: the kinds of rows.
        readings: the recording, where the circumstances were taken from it.
        circumstances: one row per hold (or group of samples), for what effects may depend on.
        assumption: what all sizes rest on where the data do not show it, a sentence, or "".
        covariance_entries: which of the twelve entries ``SensorFit.covariance`` is of, in order.
        at_rest: the sensor is read in still periods; else while it is turned.
        settled: parameters that another fit has determined and that are reported with these.
        on_table: what a rate table did, of a gyroscope that was calibrated by it alone.
        guided: the operator of the wizard can add rows to it; else no next poses are proposed.
        slow_noise_measured: whether repeats, a long rest or long holds show slow noise of the
            biases; None where that is not asked.
        unmeasured_slow_noise: what the report says where they do not.
        shows_slow_noise: what the operator does to show it.
        slow_noise_not_excluded: slow noise from hold to hold that holds long enough to show some do
            not exclude although they show none, in ``error_unit``; 0 where that is not known.
        settling: of the sensor, where all holds share it; None where they show none.
    """

    sensor: str
    unit: str
    error_unit: str
    method: str
    frame: str
    gravity: float
    base_terms: tuple[str, ...]
    sources: tuple[RowSource, ...]
    circumstances: Circumstances
    readings: Readings | None = None
    assumption: str = ""
    covariance_entries: tuple[int, ...] = tuple(range(ENTRIES))
    at_rest: bool = True
    settled: "tuple[Parameter, ...]" = ()
    guided: bool = True
    on_table: "TableData | None" = None
    slow_noise_measured: bool | None = None
    unmeasured_slow_noise: str = "slow noise of the biases was not measured"
    shows_slow_noise: str = "repeat some poses or rest for a minute"
    slow_noise_not_excluded: float = 0.0
    settling: "CommonSettling | None" = None

    @property
    def needs_reference(self) -> bool:
        """Whether the rows that judge it rest on gravity as the accelerometer's model sees it."""
        return any(one.judged and one.needs_reference for one in self.sources)

    @property
    def left_out(self) -> str:
        """What is left out to check a model, in the plural."""
        return f"{next(one.group_word for one in self.sources if one.judged)}s"

    @abstractmethod
    def under(
        self, reference: "GravityReference | None", readings: Readings | None
    ) -> "Experiment":
        """The same rows with gravity as another fit sees it, and circumstances of a recording.

        Args:
            reference: up in each hold by the accelerometer's present model; None keeps that of now.
            readings: the recording; None keeps the circumstances of now.

        Returns:
            This experiment itself where neither changes anything.
        """

    def validated(self, found: "SensorFit", holds: Sequence[Hold]) -> "SensorFit":
        """A fit of these rows with its error on holds of the session that it has not seen.

        The fit as it is where holds show no error of this sensor.
        """
        del holds
        return found

    @property
    def by_noise_alone(self) -> "Experiment":
        """The same rows under a reference without what its own model leaves beyond noise.

        This experiment itself where the reference has no such errors.
        """
        return self

    @abstractmethod
    def directions(self, base: Sequence[str]) -> Directions:
        """What of these base terms is fitted: what the rows determine."""

    @abstractmethod
    def begin(self, base: Sequence[str]) -> Parameters:
        """Where a fit of these base terms begins; what is not free has its nominal value."""

    @abstractmethod
    def before(self) -> Parameters:
        """The nominal conversion; of counts, the simplest that gives the right size."""

    @property
    def scale_before(self) -> float:
        """By how much the errors of ``before`` are too small, in units of the readings."""
        return 1.0

    @property
    def largest_error(self) -> float:
        """The largest that an error can be, in ``error_unit``."""
        return math.inf

    @abstractmethod
    def named(self, matrix: FloatArray, bias: FloatArray) -> dict[str, float]:
        """The parameters that people speak of."""

    @abstractmethod
    def unit_of(self, name: str) -> str:
        """Unit of one of these."""

    def constrained(self, calibration: Parameters, base: Sequence[str]) -> Parameters:
        """A calibration with entries that follow from others brought up to date."""
        del base  # for experiments that have such entries
        return calibration

    def left_nominal(self, found: "Minimum[Experiment]") -> FloatArray:
        """Errors of usual size in what of M and b the rows do not determine, shape (12, k)."""
        del found
        return np.zeros((ENTRIES, 0))

    @property
    def common_errors(self) -> FloatArray:
        """Errors that rows share and do not show, in steps of one standard deviation, (n, k)."""
        return np.zeros((sum(len(one.labels) for one in self.sources), 0))

    def unseen(self, found: "Minimum[Experiment]") -> FloatArray | None:
        """What M and b may be wrong by beyond what independent rows leave, covariance, (12, 12).

        Parameters that the rows do not determine have their usual size, with the shift that they
        cause in those fitted; errors that rows share count as such. None where there is nothing.
        """
        del found
        return None

    def in_session(self, found: "Minimum[Experiment]") -> FloatArray | None:
        """Covariance of M and b, (12, 12), the bias being its mean over the session.

        With slow noise estimated from the residuals; None where the covariance of the rows is used.
        """
        del found
        return None

    def foreseen(
        self, found: "Minimum[Experiment]", combinations: FloatArray
    ) -> tuple[FloatArray, FloatArray] | None:
        """What combinations of the independent rows may scatter by in another session like this.

        Args:
            found: a fit of these rows.
            combinations: shape (m, n).

        Returns:
            Probability of each kind of noise, shape (k,), and variance of the combinations by it,
            shape (k, m); None if the misfit has to show them.
        """
        del found, combinations
        return None

    def reference(self, found: "Minimum[Experiment]") -> "GravityReference | None":
        """Up in each hold, for the sensors that are calibrated by it."""
        del found
        return None

    def still_means(self) -> dict[int, FloatArray]:
        """Mean reading in the holds whose samples the rows use beside others, by hold."""
        return {}

    def turned_in_holds(self) -> dict[int, tuple[FloatArray, FloatArray, BoolArray]]:
        """Rotations that begin or end with how the device turned in a hold, by number.

        Times of the samples from the mean direction of one hold to that of the next, s, shape (n,);
        their readings, shape (n, 3); which of them were recorded, shape (n,).
        """
        return {}

    def temperature_at(self, time: FloatArray) -> FloatArray:
        """Temperature of the sensor at times of the recording, NaN where it is not known, (n,).

        Args:
            time: s, shape (n,).
        """
        return np.full(len(time), np.nan)

    def refined(self, found: "Minimum[Experiment]") -> "Experiment":
        """The same rows with what a fit with effects has shown of their frame; mostly itself."""
        del found
        return self

    @abstractmethod
    def beside(self, found: "SensorFit") -> Beside:
        """Measurement beside model."""

    def predicted(self, found: "SensorFit", true: FloatArray) -> FloatArray:
        """The model's reading of a true input, reading unit, shape (n, 3)."""
        sizes = np.concatenate([np.zeros(0), *found.sizes])
        felt = true + Terms(self.sensor, found.terms).columns(self.circumstances) @ sizes
        return np.asarray(felt @ np.linalg.inv(found.matrix).T + found.bias)

    def everything(self) -> Circumstances:
        """The circumstances of all rows and samples, for what an effect needs to be seen."""
        return self.circumstances

    def checked(self, base: Sequence[str] | None) -> tuple[str, ...]:
        """The terms of the base model that were asked for, in their usual order.

        Raises:
            UsageError: one of them is none.
        """
        if base is None:
            return self.base_terms
        unknown = [term for term in base if term not in self.base_terms]
        if unknown:
            whole = ", ".join(self.base_terms)
            raise UsageError(f"{unknown[0]!r} is not in the base; it has {whole}")
        return tuple(term for term in self.base_terms if term in base)
