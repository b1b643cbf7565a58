"""The suspects: every effect of the catalogue against what is left, and what adding it would do.

The linearised fit with a Gaussian prior on the effect's parameters. ``A`` holds the base and the
effect's columns, Λ the prior's precision on the effect alone; then

    β = (AᵀA + Λ)⁻¹ Aᵀr        H = A (AᵀA + Λ)⁻¹ Aᵀ
    error of group d when it is left out = (I − H_dd)⁻¹ (r − Hr)_d
"""

from functools import cached_property

import numpy as np

from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.expected_log_odds import MIN_VISIBLE_SHARE, detectable
from imucal_wizard.diagnose.hypotheses import DISTURBED
from imucal_wizard.diagnose.posterior import HypothesisSet, Posterior
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals
from imucal_wizard.diagnose.significance import Chances, log_odds, members


@dataclass(frozen=True, eq=False)
class EffectTrial:
    """An effect tried.

    Attributes:
        size: of each parameter, shown unit, shape (p,).
        covariance: of all of them, shape (p, p).
        rms_fitted: error with it, in the sensor's error unit.
        rms_held_out: error with it when each group is left out; None when a group cannot be.
        fitted: what is left of every row, whitened, shape (n,).
    """

    size: FloatArray
    covariance: FloatArray
    rms_fitted: float
    rms_held_out: float | None
    fitted: FloatArray

    @property
    def standard_error(self) -> FloatArray:
        """Of each parameter, shape (p,)."""
        return np.sqrt(np.diag(self.covariance))


def try_effect(
    misfit: WhitenedResiduals,
    candidates: tuple[Candidate, ...],
    noise: float = 1.0,
    walk: FloatArray | None = None,
) -> EffectTrial:
    """Add effects to the linearised model; with none, the model as it is.

    Args:
        misfit: what the present model leaves.
        candidates: the effects to add together.
        noise: true noise in units of the rows' sigma; it weighs data against priors.
        walk: covariance of a wandering bias in units of that noise, shape (n, n); it widens the
            standard errors of what is slow.
    """
    count = misfit.base.shape[1]
    columns = np.concatenate([misfit.base, *(one.columns for one in candidates)], axis=1)
    typical = np.concatenate([np.zeros(0), *(candidate.typical for candidate in candidates)])
    precision = noise**2 * np.concatenate([misfit.precision, 1.0 / typical**2])
    # the prior as rows of its own keeps the condition of the columns, not of their squares; the
    # present fit is at rest, so there the pull of the prior is that of the rows
    held = np.flatnonzero(precision)
    root = np.sqrt(precision[held])
    pull = misfit.base.T @ misfit.residual
    balance = np.where(held < count, -np.append(pull, 0.0)[np.minimum(held, count)] / root, 0.0)
    stacked = np.concatenate([columns, np.diag(np.sqrt(precision))[held]])
    left, values, right = np.linalg.svd(stacked, full_matrices=False)
    seen = values > 1e-10 * values[0]
    inner, spread = left[: len(columns), seen], right[seen].T / values[seen]
    estimate = spread @ (left[:, seen].T @ np.concatenate([misfit.residual, balance]))
    residual = misfit.residual - columns @ estimate
    own = spread[count:]
    covariance = own @ own.T
    if walk is not None:
        taken = own @ inner.T
        covariance += taken @ walk @ taken.T
    covariance *= noise**2
    # the errors that are told take the reference as it is
    told = columns.copy()
    told[:, :count][:, misfit.of_reference] = 0.0
    errors = misfit.reported - told @ estimate
    held_out = _left_out(misfit, inner, residual, told @ spread, errors)
    judged = misfit.judged
    return EffectTrial(
        size=estimate[count:],
        covariance=covariance,
        rms_fitted=_rms(misfit.measured(errors)[judged], misfit),
        rms_held_out=None if held_out is None else _rms(held_out[judged], misfit),
        fitted=residual,
    )


def _left_out(
    misfit: WhitenedResiduals,
    inner: FloatArray,
    residual: FloatArray,
    told: FloatArray,
    errors: FloatArray,
) -> FloatArray | None:
    """Errors of the rows of each group under the fit of all others; rows without group stay in.

    Args:
        misfit: the rows.
        inner: orthonormal columns of the fit of all, shape (n, k).
        residual: of that fit, shape (n,).
        told: change of the errors that are told with each of these columns, shape (n, k).
        errors: those of the fit of all, shape (n,).

    Returns:
        In the sensor's error unit, shape (n,).
    """
    out, told = misfit.measured(errors), misfit.measured(told)
    levers, pulls = misfit.whitened(inner), misfit.whitened(residual)
    for rows, root in misfit.groups:
        own = root @ levers[rows]
        gates = np.eye(rows.shape[1]) - own @ np.swapaxes(own, 1, 2)
        if np.linalg.eigvalsh(gates)[:, 0].min() < 1e-9:
            return None
        alone = np.linalg.solve(gates, root @ pulls[rows][..., None])
        out[rows] += (told[rows] @ (np.swapaxes(own, 1, 2) @ alone))[..., 0]
    return out


def _rms(errors: FloatArray, misfit: WhitenedResiduals) -> float:
    """Rms per hold, or per rotation over the components of its closure."""
    sources = distinct(misfit.source[misfit.judged])
    return float(np.sqrt((errors**2).sum() / max(len(sources), 1)))


MIN_CORRELATION_ALIKE = 0.9
"""Correlation of two effects' visible patterns above which they look the same here."""


class Significance:
    """What noise alone makes of suspects, computed when it is first asked for.

    Args:
        hypotheses: the explanations of this design.
        posterior: their probabilities.
        chances: simulations of noise alone on this design.
    """

    def __init__(self, hypotheses: HypothesisSet, posterior: Posterior, chances: Chances) -> None:
        self._hypotheses, self._posterior, self._chances = hypotheses, posterior, chances

    def p(self, log_odds: float) -> float:
        """Chance that noise alone makes any suspect look as good."""
        return self._chances.p(log_odds, self._posterior.noise)

    @cached_property
    def threshold(self) -> float:
        """Log odds that noise alone reaches once in a hundred recordings."""
        return self._chances.threshold(self._posterior.noise)

    def detectable(self, candidate: Candidate) -> FloatArray:
        """Smallest size of each parameter alone that these data would show, shape (p,)."""
        posterior = self._posterior
        return detectable(
            self._hypotheses, candidate, self.threshold, expected_noise(posterior), posterior.wander
        )


@dataclass(frozen=True, eq=False)
class Suspect:
    """One effect against what is left.

    Attributes:
        term: name of the effect, or ``disturbed``.
        candidate: the variant that explains most; None for a disturbed hold.
        log_odds: logarithm of its marginal likelihood against noise alone.
        trial: what adding it would do; None for a disturbed hold.
        like: terms that look the same here.
        significance: what noise alone makes of suspects.
        hold: index of the hold accused, for a disturbed one.
    """

    term: str
    candidate: Candidate | None
    log_odds: float
    trial: EffectTrial | None
    like: tuple[str, ...]
    significance: Significance
    hold: int | None = None

    @cached_property
    def p(self) -> float:
        """Share of simulations of noise alone in which any suspect reaches these odds."""
        return self.significance.p(self.log_odds)

    @cached_property
    def detectable(self) -> FloatArray:
        """Smallest size of each parameter alone that these data would show, shown unit, (p,).

        Infinite where the data are blind; empty for a disturbed hold.
        """
        if self.candidate is None:
            return np.zeros(0)
        return self.significance.detectable(self.candidate)

    @property
    def detectable_on_any_axis(self) -> float:
        """The same for the worst of those parameters that show at all; infinite without any."""
        seen = self.detectable[np.isfinite(self.detectable)]
        return float(seen.max()) if len(seen) else np.inf

    @property
    def largest(self) -> int:
        """Place of the parameter that stands out most from its standard error."""
        return 0 if self.trial is None else largest(self.trial.size, self.trial.standard_error)


def largest(sizes: FloatArray, errors: FloatArray) -> int:
    """Place of the size that stands out most from its standard error, shapes (p,)."""
    safe = np.where(errors > 0.0, errors, np.inf)
    certain = np.nan_to_num(np.abs(sizes) / safe)
    return int(np.argmax(certain if certain.any() else np.abs(sizes)))


def rank(
    misfit: WhitenedResiduals,
    hypotheses: HypothesisSet,
    posterior: Posterior,
    chances: Chances | None = None,
) -> tuple[Suspect, ...]:
    """All suspects, the likeliest first.

    Args:
        misfit: what is left.
        hypotheses: the explanations of this design.
        posterior: their probabilities.
        chances: simulations of this design, when some were made already.
    """
    significance = Significance(hypotheses, posterior, chances or Chances(hypotheses))
    noise, walk = expected_noise(posterior), hypotheses.frame.walked(posterior.wander)
    alike = _alike(misfit, hypotheses)
    found = []
    for term, places in members(hypotheses).items():
        odds = float(log_odds(posterior.evidence, hypotheses, places))
        best = hypotheses.single[max(places, key=lambda place: posterior.evidence[place])]
        if term == DISTURBED:
            hold = None if best.variant is None else int(best.variant)
            found.append(Suspect(term, None, odds, None, (), significance, hold))
            continue
        candidate = next(
            c for c in misfit.candidates if c.term == term and c.variant == best.variant
        )
        trial = try_effect(misfit, (candidate,), noise, walk)
        found.append(Suspect(term, candidate, odds, trial, alike[term], significance))
    return tuple(sorted(found, key=lambda suspect: -suspect.log_odds))


def expected_noise(posterior: Posterior) -> float:
    """Expected noise over all explanations."""
    return float(posterior.single @ posterior.sigma + posterior.paired @ posterior.sigma_paired)


def _alike(misfit: WhitenedResiduals, hypotheses: HypothesisSet) -> dict[str, tuple[str, ...]]:
    """Terms one of whose visible patterns is nearly one of this term's, for every term."""
    terms = list(dict.fromkeys(one.term for one in misfit.candidates))
    if not terms:
        return {}
    number = np.concatenate(
        [np.full(len(one.names), terms.index(one.term)) for one in misfit.candidates]
    )
    patterns = hypotheses.frame.across.T @ np.concatenate(
        [c.columns for c in misfit.candidates], axis=1
    )
    whole = np.concatenate([np.linalg.norm(c.columns, axis=0) for c in misfit.candidates])
    length = np.linalg.norm(patterns, axis=0)
    seen = length > MIN_VISIBLE_SHARE * np.maximum(whole, 1e-300)
    unit, number = patterns[:, seen] / length[seen], number[seen]
    near = np.argwhere(np.abs(unit.T @ unit) > MIN_CORRELATION_ALIKE)
    found = np.zeros((len(terms), len(terms)), np.bool_)
    found[number[near[:, 0]], number[near[:, 1]]] = True
    np.fill_diagonal(found, False)
    return {
        a: tuple(b for b, same in zip(terms, row, strict=True) if same)
        for a, row in zip(terms, found, strict=True)
    }
