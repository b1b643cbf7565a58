"""A linear MAP fit of rows of several kinds; the variance of each kind is estimated along with it.

Holds and closures scatter by more than their measured noise (bias instability, placement, what the
model lacks), by an amount that only the data show. With ``variance = own + excess`` for each kind,

    excess = Σ w² (r² − (1 − h) own) / Σ w² (1 − h),    w = 1/variance

over its own rows, h being the leverage of each: the residual of a row that is fitted closely counts
for fewer degrees of freedom, and a row whose own noise is large shows little of the excess.
Iterated along with the fit, this is restricted maximum likelihood; no kind drowns another. A kind
whose residuals its own noise explains (a 1 % test) has no excess: an excess found by chance would
make rows of unequal noise weigh nearly alike.
"""

from dataclasses import field, replace

import numpy as np

from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.distributions import EXACT_FREEDOM, exceeded
from imucal_wizard.model.terms import WIDE_PRIOR, widened, widened_where_open

MAX_ROUNDS = 50
MIN_FREEDOM_FOR_WIDE_PRIOR = 3.0
"""Degrees of freedom of each kind below which a wide prior would fit whatever there is."""
SETTLED = 1e-3
"""Relative change of a variance that no longer matters."""
EXCESS_P = 0.01
"""Probability of residuals by own noise alone, below which there is an excess."""
MIN_DEVIANCE = 6.0
"""Of −2 log likelihood, from which on an effect is believed and no scatter: twenty to one."""
FREEDOM_DECIMALS = 9
"""Of the degrees of freedom, above the rounding errors of the sum that they are."""
MIN_SHOWN_SHARE = 1e-12
"""Share of a combination of parameters in what the rows show, below which they do not show it."""


@dataclass(frozen=True, eq=False)
class System:
    """Rows made linear at some point.

    Attributes:
        residual: shape (n,), in the unit of the row.
        columns: derivative by the parameters, shape (n, p).
        own: variance of each row by noise alone, shape (n,).
        kinds: number of each row's variance component, shape (n,).
        precision: of the priors of the parameters, shape (p,).
        value: present value of the parameters, from the middle of their priors, shape (p,).
        groups: parameters whose priors are widened together (see ``terms.widened``).
        open_groups: those of them whose parameters are quantities of their own (see
            ``terms.widened_where_open``).
        information: inverse covariance of the parameters by another sensor's rows, shape (p, p);
            empty where no other sensor shows them.
        away: present value of the parameters from those that these rows show, shape (p,).
    """

    residual: FloatArray
    columns: FloatArray
    own: FloatArray
    kinds: IntArray
    precision: FloatArray
    value: FloatArray
    groups: tuple[slice, ...] = ()
    open_groups: tuple[slice, ...] = ()
    information: FloatArray = field(default_factory=lambda: np.zeros((0, 0)))
    away: FloatArray = field(default_factory=lambda: np.zeros(0))

    def of(self, kept: BoolArray) -> "System":
        """The same rows with some of the parameters, shape (p,), the others being known."""
        shown = len(self.away) > 0
        return replace(
            self,
            columns=self.columns[:, kept],
            precision=self.precision[kept],
            value=self.value[kept],
            groups=(),
            open_groups=(),
            information=self.information[np.ix_(kept, kept)] if shown else self.information,
            away=self.away[kept] if shown else self.away,
        )

    def moved(self, step: FloatArray) -> "System":
        """The same rows after a change of the parameters, shape (p,)."""
        return replace(
            self,
            residual=self.residual + self.columns @ step,
            value=self.value + step,
            away=self.away + step if len(self.away) else self.away,
        )


@dataclass(frozen=True, eq=False)
class Balance:
    """The fit of a system.

    Attributes:
        step: change of the parameters, shape (p,).
        variance: of each row, shape (n,).
        precision: of the priors of the parameters, shape (p,).
        prior: inverse covariance of the parameters by all but these rows, shape (p, p).
        prior_pull: its product with their distance from the middle of that, shape (p,).
        normal: normal matrix with the priors, shape (p, p).
        covariance: its inverse over what is determined, shape (p, p).
        spare: share of each row that is not fitted (one less its leverage), shape (n,).
        freedom: degrees of freedom left of each kind, shape (kinds,).
    """

    step: FloatArray
    variance: FloatArray
    precision: FloatArray
    prior: FloatArray
    prior_pull: FloatArray
    normal: FloatArray
    covariance: FloatArray
    spare: FloatArray
    freedom: FloatArray

    @property
    def step_length(self) -> float:
        """Length of the step in standard deviations, over all parameters together."""
        return float(np.sqrt(max(float(self.step @ self.normal @ self.step), 0.0)))


def balanced(system: System, kept: BoolArray | None = None) -> Balance:
    """Fit the parameters, the variance of each kind of row, and the width of the priors.

    The iteration begins with no excess and wide priors, if then something is left over to judge by.
    Begun with what the model leaves so far, an effect many times larger than its prior expects
    would itself pass for scatter and never be fitted. If nothing is left over, the rows cannot test
    for an excess: it is then begun with that scatter and without any, and the end without counts if
    it is twenty times as likely.

    Args:
        system: the linear rows.
        kept: rows whose kind has an excess without a test, shape (n,); none by default.
    """
    count = np.bincount(system.kinds)
    precision = system.precision.copy()
    without_test = np.zeros(len(count), bool)
    if kept is not None:
        without_test = np.bincount(system.kinds, kept) > 0
    for group in system.groups:
        precision[group] /= WIDE_PRIOR
    found = solved(system, system.own, precision)
    if found.freedom.min(initial=MIN_FREEDOM_FOR_WIDE_PRIOR) < MIN_FREEDOM_FOR_WIDE_PRIOR:
        scatter = np.bincount(system.kinds, system.residual**2) / count
        scattered = solved(system, system.own + scatter[system.kinds], system.precision)
        with_excess = _iterated(system, scattered, np.ones(len(count), bool))
        if not system.groups or (with_excess.variance == system.own).all():
            return with_excess
        without = _iterated(system, solved(system, system.own, system.precision), without_test)
        likelier = _deviance(system, with_excess) - _deviance(system, without)
        return without if likelier > MIN_DEVIANCE else with_excess
    return _iterated(system, found, without_test | _beyond_noise(system, found))


def _beyond_noise(system: System, found: Balance) -> BoolArray:
    """Of which kinds more is left than their own noise makes, by a 1 % test, shape (kinds,)."""
    left = system.residual + system.columns @ found.step
    squares = np.bincount(system.kinds, left**2 / system.own)
    return np.array(
        [
            freedom > 0.0 and exceeded(square / freedom, freedom, EXACT_FREEDOM) < EXCESS_P
            for square, freedom in zip(squares, found.freedom, strict=True)
        ]
    )


def _iterated(system: System, found: Balance, wanted: BoolArray) -> Balance:
    """Variances and widths of priors by the fit before, until they settle.

    Args:
        system: the linear rows.
        found: where it begins.
        wanted: which kinds have an excess, shape (kinds,).
    """
    variance = found.variance
    for _ in range(MAX_ROUNDS):
        left = system.residual + system.columns @ found.step
        excess = np.where(wanted, _excess(system, found, left), 0.0)
        before, variance = variance, system.own + excess[system.kinds]
        precision = _priors(system, found)
        settled = (np.abs(precision - found.precision) <= SETTLED * precision).all()
        settled &= (np.abs(variance - before) <= SETTLED * before).all()
        found = solved(system, variance, precision)
        if settled:
            break
    return found


def _deviance(system: System, found: Balance) -> float:
    """−2 log of the likelihood of the rows, all parameters integrated out, but for a constant."""
    left = system.residual + system.columns @ found.step
    sizes, known = system.value + found.step, found.precision > 0.0
    size = np.log(found.variance).sum() - np.log(found.precision[known]).sum()
    shown = left**2 @ (1.0 / found.variance) + found.precision @ sizes**2
    if len(system.away):
        away = system.away + found.step
        shown += away @ system.information @ away
    return float(size + np.linalg.slogdet(found.normal)[1] + shown)


def _priors(system: System, found: Balance) -> FloatArray:
    """Precision of the priors, by the sizes that were found, shape (p,)."""
    sizes = system.value + found.step
    precision = widened(system.precision, sizes, system.groups)
    large = [g for g in system.open_groups if (system.precision[g] * sizes[g] ** 2).max() > 1.0]
    if not large:
        return precision
    covariance = inverted(found.normal + np.diag(precision - found.precision))
    return widened_where_open(precision, sizes, large, covariance)


def _excess(system: System, found: Balance, left: FloatArray) -> FloatArray:
    """Variance beyond its own noise that the residuals of each kind show, shape (kinds,)."""
    weight = found.variance**-2.0
    spare = np.bincount(system.kinds, weight * found.spare)
    # less than one degree of freedom counts as one
    one = np.bincount(system.kinds, weight) / np.bincount(system.kinds)
    beyond = np.bincount(system.kinds, weight * (left**2 - found.spare * system.own))
    return np.asarray(np.maximum(beyond / np.maximum(spare, one), 0.0))


def solved(system: System, variance: FloatArray, precision: FloatArray) -> Balance:
    """Fit the parameters under given variances of the rows and given priors."""
    weighted = system.columns / variance[:, None]
    prior, prior_pull = np.diag(precision), precision * system.value
    if len(system.away):
        prior = prior + system.information
        prior_pull = prior_pull + system.information @ system.away
    normal = system.columns.T @ weighted + prior
    covariance = inverted(normal)
    pull = weighted.T @ system.residual + prior_pull
    leverage = (weighted @ covariance * system.columns).sum(axis=1)
    spare = 1.0 - leverage
    return Balance(
        step=-covariance @ pull,
        variance=variance,
        precision=precision,
        prior=prior,
        prior_pull=prior_pull,
        normal=normal,
        covariance=covariance,
        spare=spare,
        # whether one degree is left is not for the last bit of its rows' leverages to say
        freedom=np.round(np.bincount(system.kinds, spare), FREEDOM_DECIMALS),
    )


def inverted(normal: FloatArray) -> FloatArray:
    """Inverse of a symmetric matrix, shape (p, p), over what is determined.

    By Cholesky where all is, which it is with a prior on every size, else by eigenvalues at many
    times the cost.
    """
    if not len(normal):
        return normal
    scale = _scale(normal)
    outer = scale[:, None] * scale
    lower = _cholesky(normal / outer)
    if lower is None or lower.diagonal().min() ** 2 < MIN_SHOWN_SHARE:
        return np.asarray(
            np.linalg.pinv(normal / outer, rcond=MIN_SHOWN_SHARE, hermitian=True) / outer
        )
    root = np.linalg.inv(lower)
    return np.asarray(root.T @ root / outer)


def determined(normal: FloatArray) -> bool:
    """Whether a symmetric matrix, shape (p, p), determines every parameter."""
    if not (np.diag(normal) > 0.0).all():
        return False
    lower = _cholesky(normal / np.outer(*2 * (_scale(normal),)))
    return lower is not None and bool(np.diag(lower).min(initial=1.0) ** 2 > MIN_SHOWN_SHARE)


def _scale(normal: FloatArray) -> FloatArray:
    scale = np.sqrt(np.maximum(normal.diagonal(), 0.0))
    return np.where(scale > 0.0, scale, 1.0)


def _cholesky(matrix: FloatArray) -> FloatArray | None:
    try:
        return np.asarray(np.linalg.cholesky(matrix), np.float64)
    except np.linalg.LinAlgError:
        return None
