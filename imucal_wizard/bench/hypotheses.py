"""Everything that might explain a misfit, each as a Gaussian: which patterns, how strong.

An explanation is a covariance of low rank in the space that the base parameters cannot absorb.
Besides the catalogue's effects there stand, with priors of their own: one disturbed hold, a bias
that wanders (which is noise and not a drift), and structure that no effect here makes: a smooth
error over the sphere, or an unknown characteristic of one axis. Without these last ones any pattern
would be given the name of the effect that resembles it most.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from imucal_wizard.bench.misfit import Candidate, Misfit, RowKind, complement
from imucal_wizard.readings import FloatArray

NOTHING, DISTURBED, WANDER, UNKNOWN = "nothing", "disturbed", "wander", "unknown"

PRIOR = {NOTHING: 0.50, "effect": 0.30, "pair": 0.06, DISTURBED: 0.05, WANDER: 0.05, UNKNOWN: 0.04}
"""Before any data: half of all sensors lack nothing that one session could show."""
SPREADS = (0.5, 1.5)
"""Sizes of an effect against its typical size: small parts and large ones."""
DISTURBANCE = 12.0
"""A disturbed hold is off by so many noise standard deviations, one in three times more."""
WANDERS = (1.0, 3.0, 8.0)
"""Steps of a wandering bias from hold to hold, in noise standard deviations per square root of
minute."""
SMOOTHNESS = (0.2, 0.35, 0.5)
"""Lengths over which unknown structure changes, rad on the sphere or g along an axis."""
UNKNOWN_SIZES = (1.5, 5.0, 15.0)
"""Sizes of unknown structure in noise standard deviations."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One explanation.

    Attributes:
        kind: ``nothing``, ``effect``, ``pair``, ``disturbed``, ``wander`` or ``unknown``.
        terms: names of the effects in it.
        families: their families, sorted.
        which: variants of the effects, or the row source that is disturbed.
        log_prior: logarithm of its prior probability.
        basis: orthonormal patterns in the complement of the base, shape (m, q).
        strength: prior variance along each, in units of the noise variance, shape (q,).
    """

    kind: str
    terms: tuple[str, ...]
    families: tuple[str, ...]
    which: tuple[float | None, ...]
    log_prior: float
    basis: FloatArray
    strength: FloatArray


def all_hypotheses(misfit: Misfit, pairs: bool = True) -> tuple[FloatArray, list[Hypothesis]]:
    """The complement of the base, shape (n, m), and every explanation in it."""
    across = complement(misfit.base)
    made = [
        Hypothesis(
            NOTHING, (), (), (), np.log(PRIOR[NOTHING]), np.zeros((across.shape[1], 0)), np.zeros(0)
        )
    ]
    made += _effects(misfit, across)
    made += _disturbed(misfit, across)
    made += _wander(misfit, across)
    made += _unknown(misfit, across)
    if pairs:
        made += _pairs(misfit, across)
    return across, made


def _made(
    kind: str,
    terms: tuple[str, ...],
    families: tuple[str, ...],
    which: tuple[float | None, ...],
    prior: float,
    patterns: FloatArray,
) -> Hypothesis | None:
    """A hypothesis from patterns at one standard deviation, shape (m, q); None when invisible."""
    basis, values, _ = np.linalg.svd(patterns, full_matrices=False)
    seen = values > 1e-3
    if not seen.any():
        return None
    ordered = tuple(sorted(set(families)))
    return Hypothesis(
        kind, terms, ordered, which, float(np.log(prior)), basis[:, seen], values[seen] ** 2
    )


def _effects(misfit: Misfit, across: FloatArray) -> list[Hypothesis]:
    """Each effect on all axes together and on each parameter alone, at two spreads."""
    terms = {candidate.term for candidate in misfit.candidates}
    variants = {t: sum(c.term == t for c in misfit.candidates) for t in terms}
    made = []
    for candidate in misfit.candidates:
        patterns = across.T @ (candidate.columns * candidate.typical)
        count = patterns.shape[1]
        share = PRIOR["effect"] / len(terms) / variants[candidate.term] / len(SPREADS)
        for spread in SPREADS:
            made.append(_effect(candidate, share / 2.0, patterns * spread))
            # one parameter alone carries all of the effect, so it is larger than one of many
            made += [
                _effect(candidate, share / 2.0 / count, 1.3 * spread * patterns[:, [k]])
                for k in range(count)
            ]
    return [hypothesis for hypothesis in made if hypothesis is not None]


def _effect(candidate: Candidate, prior: float, patterns: FloatArray) -> Hypothesis | None:
    return _made(
        "effect", (candidate.term,), (candidate.family,), (candidate.variant,), prior, patterns
    )


def _disturbed(misfit: Misfit, across: FloatArray) -> list[Hypothesis]:
    """One hold or one rotation that is simply wrong, in all its rows."""
    keys = sorted({(int(k), int(s)) for k, s in zip(misfit.kind, misfit.source, strict=True)})
    made = []
    for kind, source in keys:
        rows = np.flatnonzero((misfit.kind == kind) & (misfit.source == source))
        patterns = across[rows].T * DISTURBANCE
        prior = PRIOR[DISTURBED] / len(keys)
        made.append(_made(DISTURBED, (), (DISTURBED,), (float(source),), prior, patterns))
    return [hypothesis for hypothesis in made if hypothesis is not None]


def _wander(misfit: Misfit, across: FloatArray) -> list[Hypothesis]:
    """Bias as a random walk from hold to hold, seen along gravity or by the gyroscope's axes."""
    shown = _shown(misfit)
    steps = np.sqrt(np.maximum(np.diff(misfit.time, prepend=misfit.time[:1]), 0.0) / 60.0)
    walk = np.tril(np.ones((len(misfit), len(misfit)))) * steps
    patterns = np.concatenate([shown[:, [axis]] * walk for axis in range(3)], axis=1)
    squeezed = _squeezed(across.T @ patterns)
    made = [
        _made(WANDER, (), (WANDER,), (), PRIOR[WANDER] / len(WANDERS), squeezed * size)
        for size in WANDERS
    ]
    return [hypothesis for hypothesis in made if hypothesis is not None]


def _shown(misfit: Misfit) -> FloatArray:
    """How much of each axis's error a row shows, shape (n, 3); nothing for rotations."""
    shown = np.zeros((len(misfit), 3))
    holds = misfit.kind == RowKind.HOLD
    shown[holds] = misfit.direction[holds]
    still = np.flatnonzero(misfit.kind == RowKind.STILL)
    shown[still, misfit.axis[still]] = 1.0
    return shown


def _squeezed(patterns: FloatArray) -> FloatArray:
    """The same covariance with as few patterns as it needs."""
    left, values, _ = np.linalg.svd(patterns, full_matrices=False)
    seen = values > 1e-3 * max(float(values.max(initial=0.0)), 1e-300)
    return np.asarray(left[:, seen] * values[seen])


def _unknown(misfit: Misfit, across: FloatArray) -> list[Hypothesis]:
    """Structure without a name: smooth over the sphere, or a characteristic of one axis."""
    seen = misfit.kind != RowKind.ROTATION
    up = np.where(seen[:, None], misfit.direction, 0.0)
    shown = _shown(misfit)
    made = []
    each = PRIOR[UNKNOWN] / len(SMOOTHNESS) / len(UNKNOWN_SIZES)
    for length in SMOOTHNESS:
        field = np.exp((np.clip(up @ up.T, -1.0, 1.0) - 1.0) / length**2)
        same = (misfit.axis[:, None] == misfit.axis[None, :]) & np.outer(seen, seen)
        sphere = _root(field * same)
        along = [
            _root(
                np.exp(-0.5 * ((up[:, [k]] - up[:, k]) / length) ** 2)
                * np.outer(shown[:, k], shown[:, k])
            )
            for k in range(3)
        ]
        shapes = [(2.0, sphere), (1.0, np.concatenate(along, axis=1))]
        shapes += [(1.0 / 3.0, one) for one in along]
        for weight, root in shapes:
            squeezed = _squeezed(across.T @ root)
            for size in UNKNOWN_SIZES:
                prior = each * weight / 4.0
                made.append(_made(UNKNOWN, (), (UNKNOWN,), (), prior, squeezed * size))
    return [hypothesis for hypothesis in made if hypothesis is not None]


def _root(kernel: FloatArray) -> FloatArray:
    """A square root of a positive semi-definite kernel, without what is rounding."""
    values, vectors = np.linalg.eigh(kernel)
    seen = values > 1e-6 * max(float(values[-1]), 1e-300)
    return np.asarray(vectors[:, seen] * np.sqrt(values[seen]))


def _pairs(misfit: Misfit, across: FloatArray) -> list[Hypothesis]:
    """Two effects of different families, one parameter of each."""
    single = []
    for term in dict.fromkeys(candidate.term for candidate in misfit.candidates):
        versions = [c for c in misfit.candidates if c.term == term]
        middle = versions[len(versions) // 2]
        if len(versions) > len(misfit.candidates) // 2:
            continue  # an effect that may begin at any moment pairs with everything
        patterns = across.T @ (middle.columns * middle.typical) * SPREADS[-1]
        visible = np.linalg.norm(patterns, axis=0) > 1e-3
        single += [(middle, patterns[:, k]) for k in np.flatnonzero(visible)]
    chosen = [(a, b) for a, b in itertools.combinations(single, 2) if a[0].family != b[0].family]
    if not chosen:
        return []
    stack = np.stack([np.column_stack([a[1], b[1]]) for a, b in chosen])
    bases, values, _ = np.linalg.svd(stack, full_matrices=False)
    prior = float(np.log(PRIOR["pair"] / len(chosen)))
    return [
        Hypothesis(
            "pair",
            (a[0].term, b[0].term),
            tuple(sorted((a[0].family, b[0].family))),
            (a[0].variant, b[0].variant),
            prior,
            bases[index],
            values[index] ** 2,
        )
        for index, (a, b) in enumerate(chosen)
    ]
