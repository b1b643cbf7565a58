"""The test of lack of fit: whether measured noise explains the residuals.

The noise is what was measured apart from the model: the noise within the holds, with the slow noise
that long holds show (``slow_rests``), and how far the same pose differs from one visit to the next.
Residuals between directions do not measure it: they contain what the model lacks. The residual is
tested twice, each time at one per cent:

- against the noise that the holds show alone, by F with the degrees of freedom of that noise;
- where poses were repeated, against that and the variance between visits that the repeats show:
  F of what is left between the directions over the pure error (Draper & Smith, Applied Regression
  Analysis, 2.1). A few repeats hardly bound that variance, but all rows at rest do: rows in motion
  have no more of it than these leave.
"""

from dataclasses import replace

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.distributions import exceeded
from imucal_wizard.estimate.repeatability import pure_error, within_freedom
from imucal_wizard.model.rows.table import ResidualTable

TEST_LEVEL = 0.01
"""Share of complete models that the test rejects."""
MAX_REPEATABILITY = 2.5
"""What is left, rms in units of the noise within the holds, above which poses that differ from
visit to visit are no noise of a usable sensor. Structure of three times that noise leaves more than
this with any poses; flicker noise of four times the usual size leaves 2."""

MIN_SPARE = 0.5
"""Degrees of freedom of rows of which the model takes up all."""
MAX_LEFT_BY_VISITS = 3.2
"""What is left, rms over that of the difference between visits, above which these are not said to
be the cause: one or two repeats that happen to agree refute nothing, but they show nothing."""


@dataclass(frozen=True)
class LackOfFit:
    """What a model leaves, against measured noise.

    Attributes:
        ratio: what is left, rms over its degrees of freedom, in units of the noise within holds.
        p: chance that this noise alone leaves as much.
        share: variance of the visits to one pose, over that of this noise; None without repeats.
        p_visits: chance that noise with the variance between visits leaves as much between the
            directions; None without repeats.
        p_repeatable: chance that the noise within holds makes visits differ as much; None without.
    """

    ratio: float
    p: float
    share: float | None = None
    p_visits: float | None = None
    p_repeatable: float | None = None

    @property
    def within_noise(self) -> bool:
        """Whether measured noise, of the holds alone or of the visits too, makes what is left."""
        if self.p >= TEST_LEVEL:
            return True
        return self._visits_explain and self.ratio <= MAX_REPEATABILITY

    @property
    def visits_differ(self) -> bool:
        """Whether repeated visits to a pose differ by more than the noise within the holds."""
        return self.p_repeatable is not None and self.p_repeatable < TEST_LEVEL

    @property
    def not_repeatable(self) -> bool:
        """Whether the visits explain what is left, and differ by far more than the noise."""
        if not self._visits_explain or not self.visits_differ or self.share is None:
            return False
        return MAX_REPEATABILITY < self.ratio < MAX_LEFT_BY_VISITS * float(np.sqrt(self.share))

    @property
    def between_directions(self) -> bool:
        """Whether the directions differ by more than repeated visits to each of them do."""
        return self.p_visits is not None and self.p_visits < TEST_LEVEL

    @property
    def _visits_explain(self) -> bool:
        """Visits that differ by no more than the noise within the holds explain nothing."""
        if self.share is None or self.p_visits is None:
            return False
        return self.share > 1.0 and self.p_visits >= TEST_LEVEL


@dataclass(frozen=True, eq=False)
class Visits:
    """Which rows repeat one another.

    Attributes:
        repeated: rows at rest whose repeats differ by noise alone, shape (n,).
        group: direction (and axis) of each row, shape (n,).
        visit: visit (and axis) that each row is a piece of, shape (n,).
        share: of what visits differ by, by how much each row differs, shape (n,): what a place does
            to the magnitude of a field it does to its dip, and a bias that is another one in each
            rest turns a rotation as long as it takes.
        freedom: degrees of freedom behind the noise of all rows.
    """

    repeated: BoolArray
    group: IntArray
    visit: IntArray
    share: FloatArray
    freedom: float

    @classmethod
    def of(cls, table: ResidualTable) -> "Visits":
        """Of the rows of a fit."""
        axes, rest = np.maximum(table.axis, 0), ~table.moving
        repeated = rest & table.repeats_are_noise & (table.pose >= 0)
        share = np.where(repeated, 1.0, np.linalg.norm(table.lever, axis=1))
        group, visit = (3 * one + axes for one in (table.pose, table.visit))
        return cls(repeated, group, visit, share, within_freedom(table))

    def without(self, rows: BoolArray) -> "Visits":
        """The same with some rows that repeat nothing, shape (n,)."""
        share = np.where(rows, 0.0, self.share)
        return replace(self, repeated=self.repeated & ~rows, share=share)


def lack_of_fit(
    residual: FloatArray,
    columns: FloatArray,
    sigma: FloatArray,
    visits: Visits,
    settings: int = 0,
) -> LackOfFit:
    """Test what a model leaves.

    Args:
        residual: over the noise within the holds, shape (n,).
        columns: its derivative by the parameters of the model, shape (n, p).
        sigma: noise within the holds of each row, in its unit, shape (n,).
        visits: which rows repeat one another.
        settings: how many settings of effects (a moment, a time constant) the data chose: where
            the best one is taken each explains as much as a parameter.
    """
    known = visits.freedom
    squares, rank = squares_left(residual, columns)
    freedom = len(residual) - rank - settings
    if freedom <= 0:
        return LackOfFit(0.0, 1.0)
    ratio = squares / freedom
    own = LackOfFit(float(np.sqrt(ratio)), exceeded(ratio, freedom, known))
    rest = visits.repeated
    if not rest.any():
        return own
    again = (residual * sigma)[rest]
    group, visit = visits.group[rest], visits.visit[rest]
    share, repeats = pure_error(again, sigma[rest], group, visit)
    if not repeats or freedom <= repeats:
        return own
    between = max(share - 1.0, 0.0) * float(np.mean(sigma[rest] ** 2))
    factor = 1.0 / np.sqrt(1.0 + between * (visits.share / sigma) ** 2)
    squares, _ = squares_left(factor * residual, factor[:, None] * columns)
    pure, _ = pure_error(again, (sigma / factor)[rest], group, visit)
    ratio = (squares - repeats * pure) / (freedom - repeats)
    p_visits = exceeded(ratio / max(pure, 1.0), freedom - repeats, repeats)
    if not rest.all():
        left, still = _left_in(residual, columns, rest)
        between = max(left / still - 1.0, 0.0) * float(np.mean(sigma[rest] ** 2))
        factor = 1.0 / np.sqrt(1.0 + between * (visits.share / sigma) ** 2)
        left, moving = _left_in(factor * residual, factor[:, None] * columns, ~rest)
        # of this noise only the part that the rows at rest show is uncertain (Satterthwaite)
        part = float((1.0 - factor[~rest] ** 2).mean())
        p_moving = exceeded(left / moving, moving, min(known, still / max(part**2, still / known)))
        p_visits = min(p_visits, p_moving)
    return LackOfFit(own.ratio, own.p, share, p_visits, exceeded(share, repeats, known))


def lack_without(table: ResidualTable, rows: IntArray) -> LackOfFit:
    """The test of a fit's residuals without some rows, which another fit would leave out."""
    out = table.indifferent
    out[rows] = True
    # an error of its own for each of these rows takes them out
    columns = table.whitened(np.column_stack([table.columns, np.eye(len(table))[:, out]]))
    residual = table.whitened(table.residual)
    visits = Visits.of(table).without(out)
    return lack_of_fit(residual, columns, table.floor, visits, table.settings)


def squares_left(residual: FloatArray, columns: FloatArray) -> tuple[float, int]:
    """What a least-squares fit leaves of a residual: the sum of squares, and the fit's rank.

    Args:
        residual: shape (n,).
        columns: what is fitted to it, shape (n, p).
    """
    inner = _range(columns)
    rest = residual - inner @ (inner.T @ residual)
    return float(rest @ rest), inner.shape[1]


def _left_in(residual: FloatArray, columns: FloatArray, rows: BoolArray) -> tuple[float, float]:
    """The same in some of the rows, and their degrees of freedom."""
    inner = _range(columns)
    rest = (residual - inner @ (inner.T @ residual))[rows]
    spare = float(rows.sum() - (inner[rows] ** 2).sum())
    return float(rest @ rest), max(spare, MIN_SPARE)


def _range(columns: FloatArray) -> FloatArray:
    """Orthonormal columns that span what is fitted."""
    left, values, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(left[:, values > 1e-9 * values.max(initial=0.0)])
