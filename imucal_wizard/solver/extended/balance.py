"""A linear MAP fit of rows of several kinds, the variance of each kind estimated along with it.

Still means and closures each scatter by more than their noise (bias instability, placement, what
the model lacks), by an amount that only the data tell. With ``var = known + rest`` for each kind,

    rest = Σ r² / (n − tr H) − mean known

over its own rows, H being the leverage: the residual of a kind that is fitted closely counts for
fewer degrees of freedom. Iterated along with the fit, this is the moment form of restricted maximum
likelihood (the Helmert–Förstner estimate of variance components); neither kind drowns the other.
All rows of a kind count alike in it, since the noise known of each is an estimate itself.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.readings import FloatArray, IntArray
from imucal_wizard.solver.extended.inverse import inverted
from imucal_wizard.solver.extended.terms import WIDE, widened

ROUNDS = 50
FEWEST_LEFT = 3.0
"""Degrees of freedom of each kind below which a wide prior would fit whatever there is."""
SETTLED = 1e-3
"""Relative change of a variance that no longer matters."""
ARRIVED = 1e-2
"""Step in standard deviations that no longer matters; the next one is a hundredth of it."""


@dataclass(frozen=True, eq=False)
class System:
    """Rows made linear at some point.

    Attributes:
        residual: shape (n,), in the unit of the row.
        columns: derivative by the parameters, shape (n, p).
        known: variance of each row by noise alone, shape (n,).
        kinds: number of each row's kind, shape (n,).
        precision: of the priors of the parameters, shape (p,).
        value: present value of the parameters, from the middle of their priors, shape (p,).
        groups: parameters whose priors are widened together (see ``terms.widened``).
    """

    residual: FloatArray
    columns: FloatArray
    known: FloatArray
    kinds: IntArray
    precision: FloatArray
    value: FloatArray
    groups: tuple[slice, ...] = ()


@dataclass(frozen=True, eq=False)
class Balance:
    """The fit of a system.

    Attributes:
        step: change of the parameters, shape (p,).
        variance: of each row, shape (n,).
        precision: of the priors of the parameters, shape (p,).
        normal: normal matrix with the priors, shape (p, p).
        covariance: its inverse over what is determined, shape (p, p).
        freedom: degrees of freedom left of each kind, shape (kinds,).
    """

    step: FloatArray
    variance: FloatArray
    precision: FloatArray
    normal: FloatArray
    covariance: FloatArray
    freedom: FloatArray

    @property
    def arrived(self) -> bool:
        """Whether the step, over all parameters together, no longer matters."""
        return float(np.sqrt(self.step @ self.normal @ self.step)) < ARRIVED

    def known(self, part: slice) -> FloatArray | None:
        """Covariance of some parameters; None when nothing is left over to judge it by."""
        return self.covariance[part, part] if self.freedom.min() >= 1.0 else None


def balanced(system: System) -> Balance:
    """Fit the parameters, the variance of each kind of row, and the width of the priors.

    It begins with no scatter and wide priors, if then something is left over to judge by. Begun
    with what the model leaves so far, an effect many times larger than its prior expects would
    itself pass for scatter and never be fitted.
    """
    rest, precision = _wide(system)
    for _ in range(ROUNDS):
        found = solved(system, system.known + rest[system.kinds], precision)
        before, rest = rest, _rest(system, found)
        precision = widened(system.precision, system.value + found.step, system.groups)
        settled = (np.abs(precision - found.precision) <= SETTLED * precision).all()
        if settled and (np.abs(rest - before)[system.kinds] <= SETTLED * found.variance).all():
            break
    return solved(system, system.known + rest[system.kinds], precision)


def _wide(system: System) -> tuple[FloatArray, FloatArray]:
    """The rests and the precision of the priors to begin with."""
    count = np.bincount(system.kinds)
    precision = system.precision.copy()
    for group in system.groups:
        precision[group] /= WIDE
    if solved(system, system.known, precision).freedom.min(initial=FEWEST_LEFT) >= FEWEST_LEFT:
        return np.zeros(len(count)), precision
    return np.bincount(system.kinds, system.residual**2) / count, system.precision


def _rest(system: System, found: Balance) -> FloatArray:
    """What each kind scatters by on top of its known noise, shape (kinds,)."""
    left = system.residual + system.columns @ found.step
    count = np.bincount(system.kinds)
    squares = np.bincount(system.kinds, left**2) / np.maximum(found.freedom, 1.0)
    return np.maximum(squares - np.bincount(system.kinds, system.known) / count, 0.0)


def solved(system: System, variance: FloatArray, precision: FloatArray) -> Balance:
    """Fit the parameters under given variances of the rows and given priors."""
    weighted = system.columns / variance[:, None]
    likelihood = system.columns.T @ weighted
    normal = likelihood + np.diag(precision)
    covariance = inverted(normal)
    pull = weighted.T @ system.residual + precision * system.value
    leverage = (weighted @ covariance * system.columns).sum(axis=1)
    return Balance(
        step=-covariance @ pull,
        variance=variance,
        precision=precision,
        normal=normal,
        covariance=covariance,
        freedom=np.asarray(np.bincount(system.kinds, 1.0 - leverage), np.float64),
    )
