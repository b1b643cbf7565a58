"""Selection of a free curve where no effect of the catalogue fits.

A curve of one axis over force, time or temperature (``model.unknown_shape``) can imitate much. It
is offered only after the catalogue has been refused, and only if

- what is left depends on that axis and that influence for sure: noise of any size, effects of other
  axes and influences, a disturbed hold, an error that lies anywhere on the sphere are all but
  excluded;
- the curve is likelier than the effects of the catalogue that depend on the same;
- the error on data held out would fall by more than a curve that follows noise lowers it.

Its length and size are those of the largest marginal likelihood among ``SETTINGS``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.curve_shape import CurveShape, Measured, curve_shape
from imucal_wizard.diagnose.detectability import Detectability
from imucal_wizard.diagnose.hypotheses import EFFECT, PRIOR, UNKNOWN, Hypothesis, noise_alone
from imucal_wizard.diagnose.posterior import HypothesisSet, Posterior
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals, candidate_at
from imucal_wizard.diagnose.significance import Chances
from imucal_wizard.diagnose.suspects import Suspect, expected_covariance
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.effect import AxisEffect, BiasEffect, Effect, ForceEffect
from imucal_wizard.model.unknown_shape import LENGTHS, SETTINGS, SIZES, UnknownShape

MIN_PROBABILITY = 0.95
"""That what is left depends on the axis and the influence of the curves offered."""
MAX_CATALOGUE_SHARE = 0.5
"""Of that, held by effects of the catalogue: where one is likelier than any curve, it is the better
answer, even if it is not certain enough to be named."""
MIN_LISTED_SHARE = 0.05
"""Curves below this share of the curves' probability are not listed."""
MAX_HELD_OUT_SHARE = 0.9
"""Share of the present error held out above which a curve is not offered: one that follows noise
lowers it by less."""
MAX_P = 0.01
"""Chance of noise alone above which a curve is not offered."""


def shape_of(fit: SensorFit, term: str, suspects: Sequence[Suspect]) -> CurveShape | None:
    """The shape of a free curve, as fitted where it is in the model, else as it would come out.

    Args:
        fit: the present fit.
        term: name of the curve.
        suspects: what may be missing.
    """
    ends = np.cumsum([0, *(len(one) for one in fit.sizes)])
    for one, sizes, first in zip(fit.terms, fit.sizes, ends, strict=False):
        curve, covariance = one.effect, fit.size_covariance
        if one.name == term and isinstance(curve, UnknownShape):
            own = slice(int(first), int(first) + len(sizes))
            known = np.zeros((len(sizes),) * 2) if covariance is None else covariance[own, own]
            return _shape(fit, curve, one.variant, sizes, known)
    for found in suspects:
        best, trial = found.candidate, found.trial
        if found.term != term or best is None or trial is None:
            continue
        if isinstance(best.effect, UnknownShape):
            return _shape(fit, best.effect, best.variant, trial.size, trial.covariance)
    return None


def _shape(
    fit: SensorFit,
    curve: UnknownShape,
    variant: float | None,
    sizes: FloatArray,
    covariance: FloatArray,
) -> CurveShape | None:
    """The shape of a curve where it was measured; None without rows."""
    if fit.rows is None or fit.experiment is None:
        return None
    # a zero is read where each axis rests; what is measured, in the rows that are judged
    sources = [one for one in fit.rows.sources if one.by_axis and curve.lines == 1]
    sources = sources or [one for one in fit.rows.sources if one.judged]
    places = [one.per_item(partial(curve.place, fit.sensor)) for one in sources]
    span = curve.range(fit.sensor, fit.experiment.circumstances)
    measured = Measured(np.sort(np.concatenate(places)), span, sources[0].item_word)
    return curve_shape(curve, fit.sensor, variant, sizes, covariance, measured)


@dataclass(frozen=True, eq=False)
class TriedCurves:
    """The free curves of a sensor against what is left, the likeliest first.

    Attributes:
        suspects: every curve at its likeliest setting.
        weights: logarithm of each one's probability together with the data, shape (k,).
    """

    suspects: tuple[Suspect, ...]
    weights: FloatArray

    @property
    def shares(self) -> FloatArray:
        """Probability of each among the curves, shape (k,)."""
        return np.asarray(np.exp(self.weights - np.logaddexp.reduce(self.weights)))


def offered_curves(
    fit: SensorFit,
    misfit: WhitenedResiduals,
    hypotheses: HypothesisSet,
    posterior: Posterior,
    curves: Sequence[UnknownShape],
) -> tuple[Suspect, ...]:
    """The free curves that may explain what is left, the likeliest first; often none.

    Args:
        fit: the present fit.
        misfit: what it leaves.
        hypotheses: all other explanations.
        posterior: their probabilities.
        curves: those that these data may show.
    """
    now = fit.rms_held_out
    if not curves or now is None:
        return ()
    tried = try_curves(fit, misfit, hypotheses, curves)
    listed = tried.shares > MIN_LISTED_SHARE
    found = [one for one, here in zip(tried.suspects, listed, strict=True) if here]
    of_listed = [one for one in curves if any(one.name == other.term for other in found)]
    known = {one.term: one.effect for one in misfit.candidates}
    effects, structure, neutral = _of_the_same(hypotheses, posterior, of_listed, known)
    # probabilities over that of all explanations without curves
    place = int(posterior.single.argmax())
    total = hypotheses.log_prior[place] + posterior.evidence[place]
    total -= np.log(max(float(posterior.single[place]), 1e-300))
    scale = float(np.exp(np.clip(tried.weights.max() - total, -700.0, 700.0)))
    own = scale * np.exp(tried.weights - tried.weights.max())
    with_listed = float(own[listed].sum()) + effects + structure
    everything = float(own.sum()) + 1.0 - neutral
    if with_listed < MIN_PROBABILITY * everything or effects > MAX_CATALOGUE_SHARE * with_listed:
        return ()
    errors = [None if one.trial is None else one.trial.rms_held_out for one in found]
    falls = [error is not None and error < MAX_HELD_OUT_SHARE * now for error in errors]
    if not falls[0] or found[0].p > MAX_P:
        return ()
    kept = [one for one, fell in zip(found, falls, strict=True) if fell]
    names = tuple(one.term for one in kept)
    return tuple(
        replace(one, like=tuple(name for name in names if name != one.term)) for one in kept
    )


def _of_the_same(
    hypotheses: HypothesisSet,
    posterior: Posterior,
    curves: Sequence[UnknownShape],
    known: Mapping[str, Effect],
) -> tuple[float, float, float]:
    """Probability of other explanations that depend on the same as one of these curves.

    Returns:
        Of effects of the catalogue; of unknown structure; of unknown structure along all axes at
        once, which speaks for no axis.
    """
    effects, structure, pairs = 0.0, 0.0, hypotheses.pairs
    named = np.array([one.kind == EFFECT for one in hypotheses.single])
    for curve in curves:
        single = np.array([_depends(one, curve, known) for one in hypotheses.single])
        effects += float(posterior.single[single & named].sum())
        structure += float(posterior.single[single & ~named].sum())
        if pairs is not None and len(pairs):
            members = np.array([_depends(one, curve, known) for one in pairs.members])
            effects += float(posterior.paired[members[pairs.first] & members[pairs.second]].sum())
    along = [one.kind == UNKNOWN and one.parameter == AXES for one in hypotheses.single]
    return effects, structure, float(posterior.single[np.array(along)].sum())


def _depends(one: Hypothesis, curve: UnknownShape, known: Mapping[str, Effect]) -> bool:
    """Whether an explanation depends on the axis and the influence of a curve alone."""
    if one.parameter != curve.parameter:
        return False
    if one.kind == UNKNOWN:
        return curve.against in ("input", "force")
    effect = known[one.terms[0]]
    alike = {"input": AxisEffect, "force": ForceEffect}.get(curve.against, BiasEffect)
    return effect.against == curve.against and isinstance(effect, alike)


def try_curves(
    fit: SensorFit,
    misfit: WhitenedResiduals,
    hypotheses: HypothesisSet,
    curves: Sequence[UnknownShape],
) -> TriedCurves:
    """Every free curve against what is left.

    Args:
        fit: the present fit.
        misfit: what it leaves.
        hypotheses: all other explanations, whose coordinates are used.
        curves: those that these data may show.
    """
    frame = hypotheses.frame
    prior = float(np.log(PRIOR[UNKNOWN] / len(curves) / len(LENGTHS)))
    candidates = [
        candidate_at(misfit, curve, float(SETTINGS.index((length, 1.0))))
        for curve in curves
        for length in LENGTHS
    ]
    made = [_hypothesis(one, frame.across, prior) for one in candidates]
    own = HypothesisSet(frame, [noise_alone(frame), *made])
    found = own.posterior(misfit.residual)
    evidence = _by_size(own, frame.across.T @ misfit.residual)
    weights = (evidence - np.log(len(SIZES)) + prior).reshape(len(curves), len(SETTINGS))
    each = np.logaddexp.reduce(weights, axis=1)
    chance = Detectability(misfit, own, found, Chances(own))
    noise = expected_covariance(misfit, own, found)
    order, tried = np.argsort(-each, kind="stable"), []
    for k in order.tolist():
        setting = int(weights[k].argmax())
        one = candidates[k * len(LENGTHS) + setting // len(SIZES)]
        typical = one.effect.typical(fit.sensor, float(setting))
        best = replace(one, variant=float(setting), typical=typical)
        odds = float(each[k] - prior - np.log(len(LENGTHS)) - found.evidence[0])
        tried.append(Suspect(one.term, best, odds, misfit, noise, (), chance))
    return TriedCurves(tuple(tried), np.asarray(each[order]))


def _hypothesis(one: Candidate, across: FloatArray, prior: float) -> Hypothesis:
    patterns = across.T @ (one.columns * one.typical)
    families, equal = (one.family,), (1.0 / len(SIZES),) * len(SIZES)
    return Hypothesis(
        EFFECT, (one.term,), families, one.variant, "", prior, patterns, SIZES, shares=equal
    )


def _by_size(hypotheses: HypothesisSet, coordinates: FloatArray) -> FloatArray:
    """Logarithm of the marginal likelihood of each curve's length at each size, (h, sizes)."""
    alone = hypotheses.frame.log_noise(coordinates)
    gains = np.stack([one.gains(coordinates) for one in hypotheses.spectra], axis=1)
    return np.asarray(np.logaddexp.reduce(alone[:, None, :] + gains, axis=(1, 3)))
