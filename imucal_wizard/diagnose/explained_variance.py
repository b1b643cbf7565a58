"""The share of the misfit that the likeliest explanations remove, and how well data discriminate.

Faces and edges hold an axis at five inputs only: 0, ±0.71 and ±1 g. Bias and scale absorb so much
that two numbers are left of any characteristic, and a second and a third order together make any
two. Corners and tilts at other angles show more of it: that is the discriminability.
"""

from functools import cached_property

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import median
from imucal_wizard.diagnose.hypotheses import BENT, DISTURBED, Hypothesis
from imucal_wizard.diagnose.posterior import HypothesisSet, Posterior
from imucal_wizard.diagnose.random_walk import MIN_WANDER_SHARE, Frame, shown_axes, usual_errors
from imucal_wizard.diagnose.residuals import RowKind, WhitenedResiduals
from imucal_wizard.diagnose.thermometer import delay_of_thermometer, step_of
from imucal_wizard.diagnose.unknown_structure import WAVES
from imucal_wizard.estimate.lack_of_fit import LackOfFit
from imucal_wizard.model.effect import BiasEffect, Circumstances, Effect

MAX_SHARE_UNLIKE = 0.03
"""Share of a pattern, rms, that another effect may leave and be called its alias: the two effects
that are most alike without being aliases at 1 g leave 0.12 (√(1 − 0.992²))."""

MAX_SHARE_UNLIKE_SETTLING = 0.05
"""The same of effects that are aliases while the temperature settles exponentially: by so much the
slope of a temperature that rises by 4 °C differs from it where a thermometer has steps of a
sixteenth of a degree (0.034)."""
MAX_SHARE_UNLIKE_BLURRED = 0.5
"""The same where the temperature itself is seen to settle: coarse steps blur its slope so far. A
temperature that rises steadily has a slope that makes nothing."""


Terms = tuple[str, ...]
Members = tuple[Hypothesis, ...]
TEMPERATURE, LAG, WARM_UP = "bias-temperature", "thermal-lag", "warm-up"
MIN_OTHER_SETTING = 1.5
"""Ratio of two time constants from which on they make different courses."""

MAX_EVIDENCE_AGAINST = 7.0
"""Logarithm of the evidence for one effect over that for two which settle, above which the data
decide: a thousand to one. The sizes of two that look like one need not be a coincidence, as the
evidence has it: one stress in the package makes both."""
MIN_EVIDENCE_FOR_ONE = 3.0
"""The same above which one of two explanations is usually preferred: twenty to one."""


class ExplainedVariance:
    """The likeliest explanations, and what they take away.

    Args:
        misfit: what is left.
        hypotheses: the explanations.
        posterior: their probabilities.
    """

    def __init__(
        self, misfit: WhitenedResiduals, hypotheses: HypothesisSet, posterior: Posterior
    ) -> None:
        self._misfit, self._hypotheses, self._posterior = misfit, hypotheses, posterior
        self.coordinates = hypotheses.frame.across.T @ misfit.residual
        self._wandering = posterior.noise.sum(axis=1)
        self.largest_wander = hypotheses.frame.largest_wander(posterior.noise)
        single, paired = posterior.single, posterior.paired
        self._pair_wins = len(paired) > 0 and paired.max() > single.max()
        self.noise = float(
            posterior.sigma_paired[paired.argmax()]
            if self._pair_wins
            else posterior.sigma[single.argmax()]
        )

    @property
    def left(self) -> float:
        """What is left in all, rms over its degrees of freedom, in the same units as ``noise``."""
        return float(np.sqrt(np.mean(self.coordinates**2))) if len(self.coordinates) else 0.0

    def lack_beside(self, inside: FloatArray) -> LackOfFit:
        """Whether noise makes what is left beside these directions, see ``span``."""
        return self._misfit.lack_beside(self._hypotheses.frame.across @ inside)

    @property
    def left_by_all(self) -> float:
        """The same with every effect of the catalogue taken away, whatever sizes that needs."""
        columns = [one.columns * one.typical for one in self._misfit.candidates]
        if not columns:
            return self.left
        inside = self._hypotheses.frame.across.T @ np.concatenate(columns, axis=1)
        left, values, _ = np.linalg.svd(inside, full_matrices=False)
        taken = left[:, values > 1e-9 * values.max(initial=0.0)]
        rest = self.coordinates - taken @ (taken.T @ self.coordinates)
        return float(np.sqrt((rest @ rest) / max(len(rest) - taken.shape[1], 1)))

    def taken_away(self, families: tuple[str, ...]) -> dict[str, float]:
        """Squares of the noise that each of these families takes away beside the others.

        The noise is at least what was measured within the holds: that residuals happen to be
        smaller makes no effect more certain.
        """
        parts, noise = self._likeliest(families)
        whole = self._explained([patterns for _, patterns in parts])
        return {
            family: (whole - self._explained([x for own, x in parts if own != family]))
            / max(noise, 1.0) ** 2
            for family in families
            if parts
        }

    def taken_beside(self, both: tuple[str, ...]) -> float:
        """Squares of the noise that the weaker of two effects takes away beside the other one."""
        likeliest = self._together(both)
        if likeliest is None:
            return 0.0
        noise, members = likeliest
        patterns = [one.patterns for one in members]
        alone = max(self._explained([one]) for one in patterns)
        return (self._explained(patterns) - alone) / max(noise, 1.0) ** 2

    def _together(self, both: tuple[str, ...]) -> tuple[float, Members] | None:
        """The likeliest explanation by two effects alone, with its noise; None without any."""
        pairs, posterior, found = self._hypotheses.pairs, self._posterior, []
        for one, share, sigma in zip(
            self._hypotheses.single, posterior.single, posterior.sigma, strict=True
        ):
            if one.members and one.terms == both:
                found.append((float(share), float(sigma), one.members))
        if pairs is not None:
            own = [one.terms in [(name,) for name in both] for one in pairs.members]
            joined = np.array(own)[pairs.first] & np.array(own)[pairs.second]
            of_two = np.array([one.terms == both[:1] for one in pairs.members])
            joined &= of_two[pairs.first] ^ of_two[pairs.second]
            place = int(np.argmax(np.where(joined, posterior.paired, -1.0)))
            if joined.any():
                share, sigma = posterior.paired[place], posterior.sigma_paired[place]
                found.append((float(share), float(sigma), tuple(pairs.both(place))))
        return max(found, key=lambda each: each[0])[1:] if found else None

    def span(self, families: tuple[str, ...]) -> FloatArray:
        """What the likeliest explanation with these families can make, orthonormal, (m, k)."""
        parts, _ = self._likeliest(families)
        patterns = [np.zeros((len(self.coordinates), 0)), *(x for _, x in parts)]
        return span_of(np.concatenate(patterns, axis=1))

    def own_span(self, family: str) -> FloatArray:
        """The part of ``span`` that this family makes, without what it is paired with, (m, k)."""
        parts, _ = self._likeliest((family,))
        return span_of(np.concatenate([x for own, x in parts if own == family], axis=1))

    def aliases(self, first: str) -> list[str]:
        """The aliases of an effect that make exactly what its likeliest form takes away here.

        A pattern of one parameter is the plainer explanation, but these poses do not decide for it.
        """
        return self._alike(first, self._effect(first).aliases, MAX_SHARE_UNLIKE)

    def aliases_while_settling(self, first: str) -> list[str]:
        """The same of effects that are aliases where the temperature has settled exponentially.

        The slope of a temperature is known much less well than the temperature itself: that it has
        settled exponentially is also seen by a warm-up that makes the same as the temperature.
        """
        names, known = self._effect(first).aliases_while_settling, self._terms
        course = first if first == WARM_UP else TEMPERATURE
        other = TEMPERATURE if first == WARM_UP else WARM_UP
        most = MAX_SHARE_UNLIKE_SETTLING
        if names and course in known and self._alike(course, (other,), most):
            most = MAX_SHARE_UNLIKE_BLURRED
        return self._alike(first, names, most)

    def instead_of(self, first: str) -> list[Terms]:
        """What may act where one effect of a family is named: two of it, or the temperature.

        An exponential course and another one with a longer time constant nearly make a third one:
        of two effects whose courses settle, the data may show no more than one that settles between
        them, or a drift. A warm-up whose time constant is fitted may be any two courses. Both must
        be needed, and together leave no more than noise.
        """
        single, pairs, posterior = self._hypotheses.single, self._hypotheses.pairs, self._posterior
        evidence = _log(posterior.single) - self._hypotheses.log_prior
        alone = [k for k, one in enumerate(single) if one.terms == (first,)]
        named = max(alone, key=lambda k: posterior.single[k])
        least = evidence[named] - MAX_EVIDENCE_AGAINST
        likely = [
            (own, one.members) for own, one in zip(evidence, single, strict=True) if own > least
        ]
        if pairs is not None:
            of_pairs = _log(posterior.paired) - pairs.log_prior
            likely += [
                (of_pairs[k], tuple(pairs.both(k)))
                for k in np.flatnonzero(of_pairs > least).tolist()
            ]
        of_single = dict(zip(single, evidence.tolist(), strict=True))
        both: dict[Terms, Members] = {}
        for own, members in sorted(likely, key=lambda each: -each[0]):
            names = tuple(sorted(term for one in members for term in one.terms))
            families = {family for one in members for family in one.families}
            if len({*names}) < 2 or names in both or families != {*single[named].families}:
                continue
            settling = all(self._effect(name).aliases_while_settling for name in names)
            if not settling and not self._effect(first).graded:
                continue
            if any(_alike(one, single[named]) for one in members):
                continue
            # as likely as the one and each of them less likely, or each leaves more than noise
            fall = own - max(of_single[one] for one in members)
            likely_too = own > evidence[named] - MIN_EVIDENCE_FOR_ONE
            if (likely_too and fall > MIN_EVIDENCE_FOR_ONE) or self._needs_both(members):
                both[names] = members
        every = [(single[named],), *both.values()]
        return [*both, *(one for members in every for one in self._by_temperature(members))]

    def instead_of_both(self, both: Terms) -> list[Terms]:
        """What may act where two effects of one family are named: the temperature."""
        likeliest = self._together(both)
        return [] if likeliest is None else self._by_temperature(likeliest[1])

    def _by_temperature(self, members: Members) -> list[Terms]:
        """Effects of the temperature that make the same, if the thermometer reads as it may.

        Courses of the bias that the temperature of the chip may follow, all of them or all but one.
        """
        names = {term for one in members for term in one.terms}
        biases = [effect for effect in map(self._effect, names) if isinstance(effect, BiasEffect)]
        known = self._terms
        if TEMPERATURE in names or TEMPERATURE not in known or len(biases) < len(names):
            return []
        c = self._misfit.minimum.experiment.circumstances
        courses = np.column_stack([self._course(one, c) for one in members])
        patterns = np.stack([one.patterns for one in members])
        weights = _one_cause(courses, patterns, self.coordinates)
        follows = span_of(np.tensordot(weights, patterns, axes=1))
        if len(members) == 1 or self.lack_beside(follows).within_noise:
            delay = delay_of_thermometer(c, (courses @ weights)[:, None], self._step)
            if delay is not None:
                return [(TEMPERATURE, *((LAG,) if delay and LAG in known else ()))]
        if len(members) == 1 or delay_of_thermometer(c, courses, self._step) != 0.0:
            return []
        return [tuple(sorted((TEMPERATURE, term))) for term in sorted(names)]

    @cached_property
    def _terms(self) -> set[str]:
        """The effects that these data can show."""
        return {one.term for one in self._misfit.candidates}

    @cached_property
    def _step(self) -> float:
        """Step of the thermometer, °C."""
        experiment = self._misfit.minimum.experiment
        recorded = None if experiment.readings is None else experiment.readings.temperature
        means = experiment.circumstances.temperature
        return step_of(means if recorded is None else recorded.values.ravel())

    def _course(self, one: Hypothesis, c: Circumstances) -> FloatArray:
        """Course of the bias at a size of one in the units of the patterns, shape (n,)."""
        effect, sensor = self._effect(one.terms[0]), self._misfit.minimum.experiment.sensor
        sizes = effect.typical(sensor, one.variant)
        return effect.error(sensor, c, sizes, one.variant)[:, 0]

    def _needs_both(self, members: Members) -> bool:
        """Whether explanations leave no more than noise together, and more than it each alone."""
        every = np.concatenate([one.patterns for one in members], axis=1)
        spans = [span_of(every), *(span_of(one.patterns) for one in members)]
        together, *alone = [self.lack_beside(one).within_noise for one in spans]
        return together and not any(alone)

    def _effect(self, name: str) -> Effect:
        return next(one.effect for one in self._misfit.candidates if one.term == name)

    def _alike(self, first: str, names: tuple[str, ...], most: float) -> list[str]:
        """Those of some effects that leave no more than a share of what an effect takes away."""
        named = [
            (share, one)
            for one, share in zip(self._hypotheses.single, self._posterior.single, strict=True)
            if one.terms == (first,)
        ]
        inside = span_of(max(named, key=lambda each: each[0])[1].patterns)
        taken = inside @ (inside.T @ self.coordinates)
        found = []
        for name in names:
            each = [one for one in self._misfit.candidates if one.term == name]
            spans = [
                span_of(self._hypotheses.frame.across.T @ (x.columns * x.typical)) for x in each
            ]
            left = [float(np.linalg.norm(taken - span @ (span.T @ taken))) for span in spans]
            if min(left, default=np.inf) < most * float(np.linalg.norm(taken)):
                found.append(name)
        return found

    def strongest(self) -> float:
        """Squares of the noise that the likeliest explanation by effects takes away as a whole."""
        parts, noise = self._likeliest(())
        return self._explained([patterns for _, patterns in parts]) / max(noise, 1.0) ** 2

    def _likeliest(self, families: tuple[str, ...]) -> tuple[list[tuple[str, FloatArray]], float]:
        """Patterns by family of the likeliest explanation that has these families; its noise."""
        hypotheses, posterior = self._hypotheses, self._posterior
        wanted = set(families)
        fits = np.array(
            [
                (bool(h.terms) or DISTURBED in wanted) and wanted <= set(h.families)
                for h in hypotheses.single
            ]
        )
        single = np.where(fits, posterior.single, 0.0)
        paired = posterior.paired * self._pairs_with(wanted)
        if not single.any() and not paired.any():
            return [], 1.0
        if len(paired) and paired.max() > single.max():
            place = int(paired.argmax())
            both = [] if hypotheses.pairs is None else hypotheses.pairs.both(place)
            return [(h.families[0], h.patterns) for h in both], float(posterior.sigma_paired[place])
        place = int(single.argmax())
        one = hypotheses.single[place]
        return one.parts, float(posterior.sigma[place])

    def _pairs_with(self, wanted: set[str]) -> FloatArray:
        pairs = self._hypotheses.pairs
        if pairs is None:
            return np.zeros(0)
        found = np.ones(len(pairs))
        if DISTURBED not in wanted:
            wrong = np.array([DISTURBED in one.families for one in pairs.members])
            found[wrong[pairs.first] & wrong[pairs.second]] = 0.0
        for family in wanted:
            own = np.array([family in one.families for one in pairs.members])
            found *= own[pairs.first] | own[pairs.second]
        return found

    def _explained(self, patterns: list[FloatArray]) -> float:
        """Squares that patterns take away, averaged over how far the noise may wander.

        The squares are averaged and not the wander: a medium wander would take nearly all of a slow
        effect away, a large but improbable one does not.
        """
        if not patterns:
            return 0.0
        weights, shares = self._hypotheses.frame.each_weights, self._wandering
        return sum(
            float(share) * self._explained_under(patterns, own)
            for own, share in zip(weights, shares, strict=True)
            if share > MIN_WANDER_SHARE
        )

    def _explained_under(self, patterns: list[FloatArray], weights: FloatArray) -> float:
        root = np.sqrt(weights)
        columns = root[:, None] * np.concatenate(patterns, axis=1)
        inside = span_of(columns).T @ (root * self.coordinates)
        return float(inside @ inside)


def _alike(first: Hypothesis, second: Hypothesis) -> bool:
    """Whether both are the same effect with about the same setting."""
    if first.terms != second.terms or first.variant is None or second.variant is None:
        return first.terms == second.terms
    return 1.0 / MIN_OTHER_SETTING < first.variant / second.variant < MIN_OTHER_SETTING


def _one_cause(courses: FloatArray, patterns: FloatArray, coordinates: FloatArray) -> FloatArray:
    """Weights of the courses in the one course that most of what they make on the axes follows.

    Args:
        courses: shape (n, k).
        patterns: of each course on each of its axes, shape (k, m, q).
        coordinates: of the residual, shape (m,).
    """
    sizes = np.linalg.lstsq(np.concatenate([*patterns], axis=1), coordinates, rcond=None)[0]
    centred = courses - courses.mean(axis=0)
    _, strength, axes = np.linalg.svd(centred @ sizes.reshape(len(patterns), -1))
    return np.asarray(sizes.reshape(len(patterns), -1) @ axes[0] / max(strength[0], 1e-300))


def _log(share: FloatArray) -> FloatArray:
    return np.asarray(np.log(np.maximum(share, 1e-300)))


def span_of(columns: FloatArray) -> FloatArray:
    """Orthonormal columns that span these, shape (m, k)."""
    left, values, _ = np.linalg.svd(columns, full_matrices=False)
    # no value at all where the model has taken up every row that was measured
    return np.asarray(left[:, values > 1e-6 * values.max(initial=0.0)])


def discriminability(misfit: WhitenedResiduals, frame: Frame) -> float:
    """Share of a rippled characteristic that differs from every bent one in these poses.

    Args:
        misfit: what is left.
        frame: its coordinates.

    Returns:
        The median over axes and waves of the share of the visible pattern's square; 1 where no
        characteristic is among the suspects, as for a gyroscope, whose input is not gravity.
    """
    if not (misfit.kind == RowKind.HOLD).any():
        return 1.0
    shown, errors = shown_axes(misfit), usual_errors(misfit, frame)
    shares = []
    for axis in range(3):
        bent = _bent(misfit, AXES[axis])
        if bent.shape[1]:
            phase = misfit.direction[:, [axis]] * np.array(WAVES)
            waves = np.concatenate([np.sin(phase), np.cos(phase)], axis=1) * shown[:, [axis]]
            shares.append(_outside(errors @ waves, frame.across.T @ bent))
    return median(np.concatenate(shares)) if shares else 1.0


def _bent(misfit: WhitenedResiduals, axis: str) -> FloatArray:
    """Columns of the plainest characteristic of each family on one axis, shape (n, p)."""
    columns = {
        candidate.family: candidate.columns[:, [candidate.names.index(axis)]]
        for candidate in reversed(misfit.candidates)
        if candidate.family in BENT and axis in candidate.names
    }
    return np.concatenate([np.zeros((len(misfit), 0)), *columns.values()], axis=1)


def _outside(waves: FloatArray, bent: FloatArray) -> FloatArray:
    """Share of each wave's square that no combination of the bent makes."""
    scaled = bent / np.maximum(np.linalg.norm(bent, axis=0), 1e-300)
    left, values, _ = np.linalg.svd(scaled, full_matrices=False)
    inside = left[:, values > 1e-6].T @ waves
    whole = np.maximum((waves**2).sum(axis=0), 1e-300)
    return np.asarray(1.0 - (inside**2).sum(axis=0) / whole)
