"""The hypotheses that may explain a misfit, each as a Gaussian with patterns and prior sizes.

An explanation is a covariance of low rank in the space that the base parameters cannot absorb.
Besides the effects of the catalogue there are, with priors of their own:

- one disturbed hold or rotation;
- structure that no effect causes (see ``unknown_structure``);
- for a magnetometer, a field that jumps or differs for a while, as when somebody moves a chair.

Without these hypotheses, every pattern would be attributed to the effect that resembles it most.
Two effects at once are pairs of single parameters of different families, two courses of one slow
family on the same axis, or two disturbed holds.
With the products ``a``, ``b``, ``c`` of the two patterns (XᵀWX), ``y``, ``z`` of the residual
(XᵀWr) and t = (s/σ)², the determinant is ``1 + t (a + b) + t² (ab − c²)`` and the quadratic form
``(t/σ²) [y² + z² + t (b y² − 2c yz + a z²)]`` over it, so that no matrix has to be decomposed.
"""

import itertools
from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.random_walk import Frame
from imucal_wizard.diagnose.residuals import Candidate, WhitenedResiduals

NOTHING, EFFECT, PAIR = "nothing", "effect", "pair"
DISTURBED, UNKNOWN = "disturbed", "unknown"

PRIOR = {NOTHING: 0.5, EFFECT: 0.29, PAIR: 0.1, DISTURBED: 0.05, UNKNOWN: 0.06}
"""Before any data: half of all sensors lack nothing that one session could show."""
SPREADS = (0.3, 1.0, 3.5, 14.0, 56.0)
"""Sizes of an effect against its typical size: small parts, typical ones, bad ones, and faults."""
SPREAD_SHARES = (0.32, 0.32, 0.32, 0.03, 0.01)
"""How often each of them occurs. Without the last two, the probability of a size far above the
usual one would fall with the exponential of its square, and larger noise or unknown structure would
always be more probable."""
MIN_VISIBLE_SHARE = 0.02
"""Share of a pattern left by the model below which the data do not show it: what is left of an
alias of the model is what a linear model neglects, and a size that fits it means nothing."""
DISTURBANCES = (6.0, 20.0, 60.0, 240.0, 960.0)
"""A disturbed hold is off by so many noise standard deviations."""


@dataclass(frozen=True, eq=False)
class Hypothesis:
    """One explanation.

    Attributes:
        kind: ``nothing``, ``effect``, ``disturbed`` or ``unknown``.
        terms: names of the effects in it.
        families: their families, sorted.
        variant: of the effect, or the item that is disturbed, see ``ResidualTable.item``.
        parameter: name of the one parameter in it, or "" for all; of unknown structure the axes
            whose characteristic it is, named as an effect's parameters that move them by the same,
            or "".
        log_prior: logarithm of its prior probability.
        patterns: at a size of one, in the coordinates of a ``Frame``, shape (m, q).
        spreads: prior standard deviations of the size.
        paired: whether it is looked for together with others.
        sparsely: only with those that have no variant.
        event: it happens at one moment of the session, its variant.
        shares: probability of each spread.
        members: the explanations that it joins, their patterns side by side; () for a single one.
    """

    kind: str
    terms: tuple[str, ...]
    families: tuple[str, ...]
    variant: float | None
    parameter: str
    log_prior: float
    patterns: FloatArray
    spreads: tuple[float, ...]
    paired: bool = True
    sparsely: bool = False
    event: bool = False
    shares: tuple[float, ...] = SPREAD_SHARES
    members: tuple["Hypothesis", ...] = ()

    @property
    def usual(self) -> FloatArray:
        """Its patterns at the usual size of an effect, or of a disturbance, shape (m, q)."""
        return self.patterns * (self.spreads[1] if self.kind == DISTURBED else 1.0)

    @property
    def parts(self) -> list[tuple[str, FloatArray]]:
        """Its patterns by family."""
        return [(one.families[0], one.patterns) for one in self.members or (self,)]


def noise_alone(frame: Frame) -> Hypothesis:
    """Noise alone."""
    empty = np.zeros((frame.across.shape[1], 0))
    return Hypothesis(NOTHING, (), (), None, "", float(np.log(PRIOR[NOTHING])), empty, SPREADS)


def visible(columns: FloatArray, frame: Frame) -> FloatArray:
    """What these data show of whitened columns beside the model, shape (n, p) to (m, p).

    Zero where the model takes up all but a share below ``MIN_VISIBLE_SHARE``.
    """
    left, whole = frame.across.T @ columns, np.linalg.norm(columns, axis=0)
    return np.where(np.linalg.norm(left, axis=0) > MIN_VISIBLE_SHARE * whole, left, 0.0)


def effect_hypotheses(misfit: WhitenedResiduals, frame: Frame) -> list[Hypothesis]:
    """Each effect on all its parameters together and on each of them alone."""
    terms = [candidate.term for candidate in misfit.candidates]
    share = PRIOR[EFFECT] / max(len(set(terms)), 1)
    if not terms:
        return []
    columns = [candidate.columns * candidate.typical for candidate in misfit.candidates]
    ends = np.cumsum([one.shape[1] for one in columns])
    # one product of all columns is much faster than one for each candidate
    every = visible(np.column_stack(columns), frame)
    made = []
    for place, (candidate, end) in enumerate(zip(misfit.candidates, ends.tolist(), strict=True)):
        paired = candidate.effect.paired or terms[:place].count(candidate.term) % 2 == 1
        patterns = every[:, end - columns[place].shape[1] : end]
        prior = share / terms.count(candidate.term)
        made.append(_effect(candidate, prior / 2.0, patterns, "", paired))
        count = patterns.shape[1]
        made += [
            _effect(candidate, prior / 2.0 / count, patterns[:, [k]], name, paired)
            for k, name in enumerate(candidate.names)
        ]
    return made


def _effect(
    candidate: Candidate, prior: float, patterns: FloatArray, which: str, paired: bool
) -> Hypothesis:
    return Hypothesis(
        EFFECT,
        (candidate.term,),
        (candidate.family,),
        candidate.variant,
        which,
        float(np.log(prior)),
        patterns,
        tuple(min(one, 1.0) for one in SPREADS) if candidate.effect.bounded else SPREADS,
        paired,
        sparsely=not candidate.effect.paired,
        event=candidate.variant is not None and not candidate.effect.graded,
    )


RATIOS = (1.0 / 16.0, 0.25, 1.0, 4.0, 16.0)
"""How much larger, against their typical sizes, one of two effects may be than the other."""


def joint_hypotheses(
    first: Hypothesis,
    second: Hypothesis,
    log_prior: float | None = None,
    ratios: tuple[float, ...] = RATIOS,
) -> list[Hypothesis]:
    """Two explanations at once, each on as many parameters as given, at some ratios of sizes.

    Args:
        first: an effect, or a disturbed hold or rotation.
        second: another one.
        log_prior: logarithm of the prior probability; that of unrelated effects when left out.
        ratios: how much larger the second one is, against its typical size.
    """
    prior = log_prior
    if prior is None:
        prior = first.log_prior + second.log_prior
        prior -= float(np.log(PRIOR[first.kind] * PRIOR[second.kind]))
        share = (1.0, WITH_DISTURBED, TWO_DISTURBED)[(first.kind, second.kind).count(DISTURBED)]
        prior += float(np.log(PRIOR[PAIR] * share))
    prior -= float(np.log(len(ratios)))
    return [
        Hypothesis(
            PAIR,
            tuple(sorted((*first.terms, *second.terms))),
            tuple(sorted((*first.families, *second.families))),
            None,
            "",
            prior,
            np.concatenate([first.usual, ratio * second.usual], axis=1),
            SPREADS,
            paired=False,
            members=(first, second),
        )
        for ratio in ratios
    ]


SAME_CAUSE = 0.1
"""How often two effects of one slow family act, against one of it alone: a device that warms up
changes its bias with the temperature, behind the temperature and with the time since power-on. In
addition to the pairs of unrelated effects."""


def siblings(hypotheses: Sequence[Hypothesis]) -> list[tuple[Hypothesis, Hypothesis, float]]:
    """Two effects of one slow family at once, each on all its parameters, and their log prior.

    Effects of the other families bend a characteristic, and any two make what any characteristic
    shows at 1 g. A step is an event, which no warming up makes, and of two effects one at most has
    a setting.
    """
    whole: dict[str, list[Hypothesis]] = {}
    for one in hypotheses:
        course = one.kind == EFFECT and not one.event
        if course and not one.parameter and one.families[0] not in BENT:
            whole.setdefault(one.families[0], []).append(one)
    made = []
    for family in whole.values():
        both = [
            (first, second)
            for first, second in itertools.combinations(family, 2)
            if first.terms != second.terms and (first.variant is None or second.variant is None)
        ]
        if both:
            alone = np.logaddexp.reduce([one.log_prior for one in family])
            prior = np.array([first.log_prior + second.log_prior for first, second in both])
            prior += alone + np.log(SAME_CAUSE) - np.logaddexp.reduce(prior)
            made += [(*each, own) for each, own in zip(both, prior.tolist(), strict=True)]
    return made


def disturbances(misfit: WhitenedResiduals, frame: Frame) -> list[Hypothesis]:
    """One hold or one rotation that is simply wrong, in all its rows.

    A hold between two rotations is the end of both. Up may be measured wrongly there, so that both
    end or begin in another direction; and if the device moves during the hold, each of them ends or
    begins in a direction of its own. The end of one rotation alone is that rotation's.
    """
    items = distinct(misfit.item)
    prior = float(np.log(PRIOR[DISTURBED] / max(len(items), 1)))
    # an error of each row by the standard deviation of its noise
    wrong = frame.across.T @ misfit.whitened(np.diag(misfit.sigma))
    of_item = misfit.item == items[:, None]
    at_end = misfit.table.joins(items.tolist()).any(axis=2) & ~of_item
    between = np.array([len(distinct(misfit.item[ends])) > 1 for ends in at_end], np.bool_)
    share = at_end[between] / np.maximum(at_end[between].sum(axis=1, keepdims=True), 1)
    usual = np.sqrt(share @ misfit.sigma**2)
    tilted = usual[:, None, None] * misfit.table.tilted(items[between].tolist())
    columns = np.moveaxis(tilted, 0, 1).reshape(len(misfit), 2 * len(usual))
    tilts = (frame.across.T @ misfit.whitened(columns)).reshape(len(wrong), len(usual), 2)
    each_tilt = iter(np.moveaxis(tilts, 1, 0))
    made = []
    for item, own, ends, inner in zip(items.tolist(), of_item, at_end, between, strict=True):
        ways = [wrong[:, own]]
        if inner:
            ways += [next(each_tilt), wrong[:, ends], wrong[:, own | ends]]
        made += [
            Hypothesis(
                DISTURBED,
                (),
                (DISTURBED,),
                float(item),
                "",
                prior - float(np.log(len(ways))),
                patterns,
                DISTURBANCES,
            )
            for patterns in ways
        ]
    return made


PAIR_SPREAD = 2.0
"""Size of both against what is typical; two effects that both show are both large."""
SAME_AXIS = 0.2
"""Share of pairs that bend one axis' characteristic, evenly and oddly: one cause makes both."""
WITH_DISTURBED = 0.15
"""Share of an effect and a disturbed hold."""
TWO_DISTURBED = 0.1
"""Share of two disturbed holds or rotations."""
MAX_ALONG = 1e10
"""Largest product of a pattern and a residual: its square times a pattern fits in 32 bits."""
BENT = ("even-order", "odd-order")


@dataclass(frozen=True, eq=False)
class Pairs:
    """All pairs of a design.

    Attributes:
        patterns: of the single parameters that pair, shape (m, d).
        first: of each pair, shape (p,).
        second: of each pair, shape (p,).
        log_prior: shape (p,).
        members: the single explanations that pair, d of them.
        newest: the gains last found, by the residual, the weights and the squares of σ they are of:
            a set that is widened by single explanations asks for them again.
    """

    patterns: FloatArray
    first: NDArray[np.intp]
    second: NDArray[np.intp]
    log_prior: FloatArray
    members: tuple[Hypothesis, ...]
    newest: dict[bytes, NDArray[np.float32]] = field(default_factory=dict, repr=False)

    def __len__(self) -> int:
        return len(self.first)

    def both(self, place: int) -> list[Hypothesis]:
        """The two explanations of a pair."""
        return [self.members[self.first[place]], self.members[self.second[place]]]

    def gains(
        self, coordinates: FloatArray, each_weights: Sequence[FloatArray], squares: FloatArray
    ) -> NDArray[np.float32]:
        """What each adds to the log likelihood of noise alone, shape (wanders, p, sigmas).

        Args:
            coordinates: of a residual, shape (m,).
            each_weights: of each coordinate, shape (m,), under each wander.
            squares: of each σ, shape (sigmas,).
        """
        key = np.concatenate([coordinates, *each_weights, squares]).tobytes()
        if key in self.newest:
            return self.newest[key].copy()
        # single precision: millions of numbers of which a thousandth is enough
        t = (1.0 / squares).astype(np.float32)
        found = np.empty((len(each_weights), len(self), len(t)), np.float32)
        determinant = np.empty(found.shape[1:], np.float32)
        for form, weights in zip(found, each_weights, strict=True):
            products = self.patterns.T @ (weights[:, None] * self.patterns)
            along = self.patterns.T @ (weights * coordinates)
            # a wild residual would leave the range of single precision
            scale = max(float(np.abs(along).max()) / MAX_ALONG, 1.0)
            along /= scale
            a, b = products[self.first, self.first], products[self.second, self.second]
            c = products[self.first, self.second]
            y, z = along[self.first], along[self.second]
            np.multiply.outer((a * b - c * c).astype(np.float32), t, out=determinant)
            determinant += (a + b).astype(np.float32)[:, None]
            determinant *= t
            determinant += 1.0
            crossed = b * y * y - 2.0 * c * y * z + a * z * z
            np.multiply.outer(crossed.astype(np.float32), t, out=form)
            form += (y * y + z * z).astype(np.float32)[:, None]
            form *= t * t
            form /= determinant
            form *= np.float32(scale**2)
            form -= np.log(determinant, out=determinant)
            form *= np.float32(0.5)
        self.newest.clear()
        self.newest[key] = found
        return found.copy()


def _numbered(names: Sequence[str]) -> NDArray[np.intp]:
    """The same number for the same name."""
    known: dict[str, int] = {}
    return np.array([known.setdefault(one, len(known)) for one in names])


def all_pairs(hypotheses: Sequence[Hypothesis]) -> Pairs | None:
    """Pairs of single parameters and disturbed holds; None without any."""
    single = [
        one
        for one in hypotheses
        if one.patterns.shape[1] == 1 and one.kind in (EFFECT, DISTURBED) and one.paired
    ]
    if not single:
        return None
    number = _numbered([one.families[0] for one in single])
    bent = np.array([one.families[0] in BENT for one in single])
    axis = _numbered([one.parameter for one in single])
    wrong = np.array([one.families[0] == DISTURBED for one in single])
    term = _numbered([one.terms[0] if one.terms else "" for one in single])
    alike = number[:, None] == number
    lasting = ~bent & np.array([not one.event for one in single])
    related = alike & (axis[:, None] == axis) & (term[:, None] != term)
    related &= lasting[:, None] & lasting
    sparse = np.array([one.sparsely for one in single])
    setting = np.array([one.variant is not None for one in single])
    apart = sparse[:, None] & setting
    keep = (~alike | (wrong[:, None] & wrong) | related) & ~(apart | apart.T)
    first, second = np.nonzero(np.triu(keep, 1))
    related = related[first, second]
    if not len(first):
        return None
    both, mixed = wrong[first] & wrong[second], wrong[first] ^ wrong[second]
    same = bent[first] & bent[second] & (axis[first] == axis[second])
    rest = 1.0 - TWO_DISTURBED - WITH_DISTURBED - SAME_AXIS
    kinds = [
        (both, TWO_DISTURBED),
        (mixed, WITH_DISTURBED),
        (same, SAME_AXIS),
        (~both & ~mixed & ~same & ~related, rest),
    ]
    shares = np.array([one.log_prior for one in single])
    prior = np.zeros(len(first))
    for where, share in kinds:
        if where.any():
            # a setting among many, as a step's moment, is as likely in a pair as it is alone
            weight = np.exp(shares[first[where]] + shares[second[where]])
            prior[where] = PRIOR[PAIR] * share * weight / weight.sum()
    for one in distinct(number[first[related]]):
        where = related & (number[first] == one)
        weight = np.exp(shares[first[where]] + shares[second[where]])
        alone = np.exp(shares[number == one]).sum()
        prior[where] = SAME_CAUSE * alone * weight / weight.sum()
    patterns = np.concatenate([one.patterns for one in single], axis=1)
    size = np.where(wrong, np.array([one.spreads[1] for one in single]), PAIR_SPREAD)
    return Pairs(patterns * size, first, second, np.log(prior), tuple(single))
