"""Everything that might explain a misfit, each as a Gaussian: which patterns, how strong.

An explanation is a covariance of low rank in the space that the base parameters cannot absorb.
Besides the catalogue's effects there stand, with priors of their own: one disturbed hold, and
structure that no effect here makes (see ``unknown``). Without these any pattern would be given the
name of the effect that resembles it most.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.bench.misfit import Candidate, Misfit
from imucal_wizard.bench.noise import Frame
from imucal_wizard.readings import FloatArray

NOTHING, EFFECT, PAIR = "nothing", "effect", "pair"
DISTURBED, UNKNOWN = "disturbed", "unknown"

PRIOR = {NOTHING: 0.5, EFFECT: 0.29, PAIR: 0.1, DISTURBED: 0.05, UNKNOWN: 0.06}
"""Before any data: half of all sensors lack nothing that one session could show."""
SPREADS = (0.3, 1.0, 3.5)
"""Sizes of an effect against its typical size: small parts, typical ones, and bad ones."""
DISTURBANCES = (6.0, 20.0, 60.0)
"""A disturbed hold is off by so many noise standard deviations."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One explanation.

    Attributes:
        kind: ``nothing``, ``effect``, ``disturbed`` or ``unknown``.
        terms: names of the effects in it.
        families: their families, sorted.
        variant: of the effect, or the index of the hold that is disturbed.
        parameter: name of the one parameter in it, or "" for all.
        log_prior: logarithm of its prior probability.
        patterns: at a size of one, in the coordinates of a ``Frame``, shape (m, q).
        spreads: prior standard deviations of the size, each as likely as the others.
    """

    kind: str
    terms: tuple[str, ...]
    families: tuple[str, ...]
    variant: float | None
    parameter: str
    log_prior: float
    patterns: FloatArray
    spreads: tuple[float, ...]


def nothing(frame: Frame) -> Hypothesis:
    """Noise alone."""
    empty = np.zeros((frame.across.shape[1], 0))
    return Hypothesis(NOTHING, (), (), None, "", float(np.log(PRIOR[NOTHING])), empty, SPREADS)


def effects(misfit: Misfit, frame: Frame) -> list[Hypothesis]:
    """Each effect on all its parameters together and on each of them alone."""
    terms = [candidate.term for candidate in misfit.candidates]
    share = PRIOR[EFFECT] / max(len(set(terms)), 1)
    made = []
    for candidate in misfit.candidates:
        patterns = frame.across.T @ (candidate.columns * candidate.typical)
        prior = share / terms.count(candidate.term)
        made.append(_effect(candidate, prior / 2.0, patterns, ""))
        count = patterns.shape[1]
        made += [
            _effect(candidate, prior / 2.0 / count, patterns[:, [k]], name)
            for k, name in enumerate(candidate.names)
        ]
    return made


def _effect(candidate: Candidate, prior: float, patterns: FloatArray, which: str) -> Hypothesis:
    return Hypothesis(
        EFFECT,
        (candidate.term,),
        (candidate.family,),
        candidate.variant,
        which,
        float(np.log(prior)),
        patterns,
        SPREADS,
    )


def disturbed(misfit: Misfit, frame: Frame) -> list[Hypothesis]:
    """One hold or one rotation that is simply wrong, in all its rows."""
    keys = sorted({(int(k), int(s)) for k, s in zip(misfit.kind, misfit.source, strict=True)})
    prior = float(np.log(PRIOR[DISTURBED] / max(len(keys), 1)))
    made = []
    for kind, source in keys:
        rows = np.flatnonzero((misfit.kind == kind) & (misfit.source == source))
        patterns = frame.across[rows].T
        made.append(
            Hypothesis(
                DISTURBED, (), (DISTURBED,), float(source), "", prior, patterns, DISTURBANCES
            )
        )
    return made
