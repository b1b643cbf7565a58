"""The linear problem summed by areas of the sphere: weights, uncertainty, error of areas left out.

Within an area samples differ by their noise σ; area by area the mean differs by what the model does
not explain, τ. An area with n samples knows its distance to σ²/n + τ², so each of its samples has
the weight ``1/(σ² + n τ²)``: where only noise is seen all samples count alike, and the more the
model lacks the more all areas count alike, however densely they are filled. τ² is the moment
estimate of DerSimonian and Laird (Controlled Clinical Trials 7 (1986) 177), for a fit.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.ellipsoid.bins import BINS
from imucal_wizard.ellipsoid.orthogonal import Rows
from imucal_wizard.readings import FloatArray

EXACT = 1e-18
"""Variance below which readings are exact: a billionth of their span, squared."""


@dataclass(frozen=True, eq=False)
class Binned:
    """Sums over the samples of each of the areas that hold any.

    Attributes:
        area: number of each area, shape (k,).
        count: samples in it, shape (k,).
        square: sum of squared distances, shape (k,).
        mean: mean distance, shape (k,).
        slope: sum of the slopes, shape (k, p).
        pull: sum of slope times distance, shape (k, p).
        normal: sum of slope times slope, shape (k, p, p).
    """

    area: NDArray[np.intp]
    count: FloatArray
    square: FloatArray
    mean: FloatArray
    slope: FloatArray
    pull: FloatArray
    normal: FloatArray

    @property
    def free(self) -> int:
        """Parameters fitted."""
        return int(self.slope.shape[1])


def summed(now: Rows, areas: NDArray[np.intp], basis: FloatArray) -> Binned:
    """Sums of the linear problem by area.

    Args:
        now: distances and slopes of n samples in the order of ``bins.by_area``.
        areas: area of each sample, never decreasing, shape (n,).
        basis: free directions of the parameters, shape (9, p); all nine are the identity.
    """
    found, first = np.unique(areas, return_index=True)
    slope = now.slope if basis.shape[1] == len(basis) else basis.T @ now.slope
    distance = now.distance
    ends = np.append(first[1:], len(areas))
    normal = np.empty((len(found), len(slope), len(slope)))
    pull = np.empty((len(found), len(slope)))
    for k, (a, b) in enumerate(zip(first, ends, strict=True)):
        part = slope[:, a:b]
        np.matmul(part, part.T, out=normal[k])
        np.matmul(part, distance[a:b], out=pull[k])
    count = (ends - first).astype(float)
    return Binned(
        found,
        count,
        np.add.reduceat(distance**2, first),
        np.add.reduceat(distance, first) / count,
        np.add.reduceat(slope, first, axis=1).T,
        pull,
        normal,
    )


@dataclass(frozen=True, eq=False)
class Weighed:
    """A step of the weighted fit, and what is known after it.

    Attributes:
        step: change of the free parameters, shape (p,).
        covariance: of the free parameters, shape (p, p).
        noise: σ², variance of a sample's distance within its area.
        misfit: τ², variance between areas beyond that.
        freedom: degrees of freedom behind the covariance.
        normal: the weighted normal matrix, shape (p, p).
        weight: of the samples of each area, shape (k,).
    """

    step: FloatArray
    covariance: FloatArray
    noise: float
    misfit: float
    freedom: int
    normal: FloatArray
    weight: FloatArray


def weigh(sums: Binned) -> Weighed:
    """Variances, weights, step and covariance from the sums.

    Raises:
        numpy.linalg.LinAlgError: the samples do not determine the parameters.
    """
    count, areas, samples = sums.count, len(sums.count), float(sums.count.sum())
    plain = np.linalg.solve(sums.normal.sum(axis=0), sums.pull.sum(axis=0))
    square = sums.square - 2.0 * sums.pull @ plain + (sums.normal @ plain) @ plain
    mean = sums.mean - sums.slope @ plain / count
    within = float((square - count * mean**2).sum()) / max(samples - areas, 1.0)
    noise = max(within, EXACT)
    if samples - areas < areas:  # hardly two samples in an area: all of the rest is noise
        noise = max(float(square.sum()) / max(samples - sums.free, 1.0), EXACT)
    misfit = _misfit(sums, float((count * mean**2).sum()), noise) if areas > sums.free else 0.0
    weight = 1.0 / (1.0 + count * misfit / noise)
    normal = np.einsum("k,kij->ij", weight, sums.normal)
    step = np.linalg.solve(normal, weight @ sums.pull)
    scatter = noise * np.einsum("k,kij->ij", weight**2, sums.normal)
    scatter += misfit * np.einsum("k,ki,kj->ij", weight**2, sums.slope, sums.slope)
    half = np.linalg.solve(normal, scatter)
    covariance = np.linalg.solve(normal, half.T)
    freedom = samples - sums.free if misfit == 0.0 else max(areas - sums.free, 1)
    return Weighed(
        step, 0.5 * (covariance + covariance.T), noise, misfit, int(freedom), normal, weight
    )


def _misfit(sums: Binned, between: float, noise: float) -> float:
    """τ² from ``Q = Σ n m²``, m being the mean of each area after the plain fit.

    With ``q = s N⁻¹ sᵀ``, s the sums of slopes and N the normal matrix of all samples,

        E Q = σ² (k − Σ q_kk/n_k) + τ² (n − 2 Σ q_kk + Σ q_kl²/n_k)

    which counts what the fit takes of the means; for a mean alone it is DerSimonian's and Laird's.
    """
    crossed = sums.slope @ np.linalg.solve(sums.normal.sum(axis=0), sums.slope.T)
    own, count = np.diag(crossed), sums.count
    by_noise = len(count) - float((own / count).sum())
    by_misfit = float(count.sum() - 2.0 * own.sum() + ((crossed**2).sum(axis=1) / count).sum())
    return max((between - noise * by_noise) / by_misfit, 0.0) if by_misfit > 0.0 else 0.0


def mean_square(sums: Binned, change: FloatArray) -> FloatArray:
    """Mean squared distance in each area after ``change`` of the free parameters, shape (k,)."""
    square = sums.square + 2.0 * sums.pull @ change + (sums.normal @ change) @ change
    return np.asarray(np.maximum(square, 0.0) / sums.count)


def left_out(sums: Binned, weight: FloatArray, fold_of: NDArray[np.intp]) -> FloatArray | None:
    """Mean squared distance in each area under the fit without its fold, shape (k,).

    The fit is linear in a change as small as leaving one area in twenty out.

    Args:
        sums: the linear problem.
        weight: of the samples of each area, shape (k,).
        fold_of: fold of each of the hundred areas, shape (100,).

    Returns:
        None when the areas of some fold are needed to determine the parameters.
    """
    out = np.empty(len(sums.area))
    fold = fold_of[sums.area]
    normal = np.einsum("k,kij->ij", weight, sums.normal)
    pull = weight @ sums.pull
    for one in np.unique(fold):
        mine = fold == one
        rest = normal - np.einsum("k,kij->ij", weight[mine], sums.normal[mine])
        if np.linalg.eigvalsh(_even(rest, normal))[0] < 1e-3:
            return None
        change = -np.linalg.solve(rest, pull - weight[mine] @ sums.pull[mine])
        out[mine] = mean_square(sums, change)[mine]
    return out


def _even(rest: FloatArray, normal: FloatArray) -> FloatArray:
    """``rest`` in the metric of ``normal``: the identity where nothing was left out."""
    lower = np.linalg.cholesky(normal)
    half = np.linalg.solve(lower, rest)
    return np.asarray(np.linalg.solve(lower, half.T))


def fill(areas: NDArray[np.intp]) -> FloatArray:
    """How many samples each of the hundred areas holds, shape (100,)."""
    return np.bincount(areas, minlength=BINS).astype(float)
