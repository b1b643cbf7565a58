"""The noise that every explanation is judged under: how large it is, and how far it wanders.

Rows are divided by the noise measured within the holds. Between holds the noise may be larger, and
the bias may wander; neither is a drift. With K the covariance of a random walk seen by the rows,
the noise is ``σ² (I + ω² K)``; σ and ω are not known and are averaged over. Within-hold noise is
nearly the whole truth for a white sensor, and a half or a third of it for a coloured one.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.bench.misfit import Misfit, RowKind
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.slow_noise import complement

SIGMAS = np.exp(np.linspace(np.log(0.65), np.log(12.0), 15))
"""Noise in units of that within the holds."""
SQUARES = SIGMAS**2
WANDERS = (0.0, 0.6, 2.0, 6.0)
"""Steps of a wandering bias, in units of the noise per square root of minute."""
WANDER_PRIOR = (0.6, 0.2, 0.13, 0.07)
WHITE = 0.6
"""Share of sensors whose noise between holds is that within them."""


def sigma_prior() -> FloatArray:
    """Logarithm of the prior of each σ: a peak at one, and a broad shoulder above it."""
    x = np.log(SIGMAS)
    peak = np.exp(-0.5 * ((x - 0.03) / 0.15) ** 2) / 0.15
    broad = np.exp(-0.5 * ((x - 0.6) / 0.55) ** 2) / 0.55
    prior = WHITE * peak + (1.0 - WHITE) * broad
    return np.asarray(np.log(prior / prior.sum()))


@dataclass(frozen=True, eq=False)
class Frame:
    """Coordinates in which both the base parameters and the noise are simple.

    Attributes:
        across: orthonormal, what the base cannot absorb, wandering noise diagonal; shape (n, m).
        walk: variance of a random walk along each coordinate, shape (m,).
        wanders: the values of ω that make a difference here.
        log_prior: logarithm of the prior of each of them.
    """

    across: FloatArray
    walk: FloatArray
    wanders: tuple[float, ...]
    log_prior: FloatArray

    def weights(self, wander: float) -> FloatArray:
        """What white noise has over what wandering noise has along each coordinate, (m,)."""
        return np.asarray(1.0 / (1.0 + wander**2 * self.walk))

    def walked(self, wander: float) -> FloatArray:
        """What wandering adds to the covariance of the rows, in units of the noise, (n, n)."""
        return np.asarray(wander**2 * (self.across * self.walk) @ self.across.T)


def frame_of(misfit: Misfit) -> Frame:
    """The frame of a misfit."""
    across = complement(misfit.base)
    values, vectors = np.linalg.eigh(across.T @ walk_of(misfit) @ across)
    count = len(WANDERS) if values.size and values[-1] > 1e-3 else 1
    prior = np.array(WANDER_PRIOR[:count])
    return Frame(
        across @ vectors,
        np.maximum(values, 0.0),
        WANDERS[:count],
        np.asarray(np.log(prior / prior.sum())),
    )


def walk_of(misfit: Misfit) -> FloatArray:
    """Covariance of the whitened rows by a wander of one, from the first row on, shape (n, n)."""
    minutes = (misfit.time - misfit.time.min()) / 60.0
    walked = (misfit.lever @ misfit.lever.T) * np.minimum(minutes[:, None], minutes)
    seen = misfit.kind != RowKind.ROTATION
    usual = float(np.median(misfit.sigma[seen])) if seen.any() else 1.0
    return np.asarray(walked * np.outer(usual / misfit.sigma, usual / misfit.sigma))


def shown_axes(misfit: Misfit) -> FloatArray:
    """How much of each axis's error a row shows, shape (n, 3); nothing for rotations."""
    shown = np.zeros((len(misfit), 3))
    holds = misfit.kind == RowKind.HOLD
    shown[holds] = misfit.direction[holds]
    field = misfit.kind >= RowKind.FIELD
    shown[field] = misfit.lever[field]
    still = np.flatnonzero(misfit.kind == RowKind.STILL)
    shown[still, misfit.axis[still]] = 1.0
    return shown
