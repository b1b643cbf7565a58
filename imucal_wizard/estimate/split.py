"""How a sum of effects that rows determine is split among them, as rows of another sensor show.

The magnitude of gravity shows only sums of some effects of an accelerometer: ``u_y u_z`` on x,
``u_x u_z`` on y and ``u_x u_y`` on z are one and the same ``xyz``. How the sum is split moves the
measured directions of up, and these are the reference of a gyroscope, whose closures show it. With
the covariance C of the accelerometer's parameters by its own rows, the precision P of their priors
and ``C = S Sᵀ``, the eigenvalues of ``Sᵀ P S`` are the shares of the variance along combinations
that the prior and not the rows leave. Combinations with a large share are open. What the closures
say of them is information about the accelerometer's parameters, which it is fitted with.
"""

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.model.rows.source import Parameters
from imucal_wizard.model.terms import Terms

MIN_OPEN = 0.25
"""Share of the variance by the prior from which on rows do not determine a combination: its
standard error is then more than half of the prior's."""
NEGLIGIBLE_DOUBT = 1e-12
"""Share of the largest variance below which an error of the calibration is rounding."""
SHOWN = 1e-6
"""Inverse variance of an open combination by other rows, over that of its prior, from which on they
show it."""


@dataclass(frozen=True, eq=False)
class Opened:
    """What other rows say of the open combinations, in standard deviations of each.

    Attributes:
        mean: from the values that they had, shape (k,).
        covariance: the prior included, shape (k, k).
    """

    mean: FloatArray
    covariance: FloatArray


@dataclass(frozen=True, eq=False)
class Split:
    """What other rows show of the parameters of a fit.

    Attributes:
        entries: M and b that they agree with best, shape (12,).
        sizes: of the effects, the same, shape (p,).
        information: inverse covariance by them of the free directions of the base and the sizes,
            shape (d + p, d + p).
    """

    entries: FloatArray
    sizes: FloatArray
    information: FloatArray

    def away(self, base: FloatArray, calibration: Parameters, others: int) -> FloatArray:
        """Distance of all parameters from those.

        Args:
            base: free directions of the twelve entries, shape (12, d).
            calibration: the parameters now.
            others: how many parameters follow the sizes.
        """
        moved = np.linalg.pinv(base) @ (calibration.entries - self.entries)
        return np.concatenate([moved, calibration.sizes - self.sizes, np.zeros(others)])

    def over(self, others: int) -> FloatArray:
        """The information with that of further parameters, of which there is none."""
        count = len(self.information)
        whole = np.zeros((count + others, count + others))
        whole[:count, :count] = self.information
        return whole


def principal_steps(covariance: FloatArray | None) -> FloatArray:
    """Steps d of one standard deviation along the principal axes of a covariance, shape (p, k).

    The parameters may have any units; ``d dᵀ`` is the covariance. One without an error does not
    move.

    Args:
        covariance: shape (p, p); None where none is known.
    """
    if covariance is None or not len(covariance):
        return np.zeros((0, 0))
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    known = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(known, known))
    seen = values > NEGLIGIBLE_DOUBT * values[-1]
    return np.asarray(scale[:, None] * vectors[:, seen] * np.sqrt(values[seen]))


def steps_by_rows(
    covariance: FloatArray | None, precision: FloatArray, terms: Terms
) -> tuple[FloatArray, FloatArray]:
    """Steps of one standard deviation along what rows determine, and along what is open.

    Args:
        covariance: of the parameters, those of the effects last, shape (p, p).
        precision: of their priors, shape (p,).
        terms: the effects. The coefficients of a free curve are as many as it needs; what its prior
            holds is no split.

    Returns:
        Shapes (p, k) and (p, q).
    """
    steps, held = principal_steps(covariance), precision.copy()
    first = len(precision) - len(terms)
    for term, group in zip(terms.terms, terms.groups, strict=True):
        if term.effect.free:
            held[first + group.start : first + group.stop] = 0.0
    if not len(steps) or not held.any():
        return steps, steps[:, :0]
    shares, turned = np.linalg.eigh(steps.T @ (held[:, None] * steps))
    left = shares > MIN_OPEN
    if not left.any():
        return steps, steps[:, :0]
    steps = steps @ turned
    return steps[:, ~left], steps[:, left]


def split_of(
    calibration: Parameters,
    base: FloatArray,
    steps: tuple[FloatArray, FloatArray],
    said: Opened,
) -> Split | None:
    """What other rows show of the parameters; None where they show nothing.

    Args:
        calibration: the parameters for which they have spoken.
        base: free directions of the twelve entries, shape (12, d).
        steps: see ``steps_by_rows``.
        said: what they have said of the open ones.
    """
    own, turned = np.linalg.eigh(said.covariance)
    gained = 1.0 / np.maximum(own, np.finfo(float).tiny) - 1.0
    shown = gained > SHOWN
    if not shown.any():
        return None
    # without the prior, which the accelerometer's fit has already
    middle = (turned.T @ said.mean)[shown] / own[shown] / gained[shown]
    moved = steps[1] @ turned[:, shown] @ middle
    whole = np.concatenate(steps, axis=1)
    scale = np.sqrt((whole**2).sum(axis=1))
    scale = np.where(scale > 0.0, scale, 1.0)
    coordinates = np.linalg.pinv(whole / scale[:, None]) / scale
    seen = turned[:, shown].T @ coordinates[steps[0].shape[1] :]
    information = seen.T @ (gained[shown, None] * seen)
    count = base.shape[1]
    entries = calibration.entries + base @ moved[:count]
    return Split(entries, calibration.sizes + moved[count:], information)
