"""Closure of a rotation against gravity: up carried by the gyroscope, less up measured afterwards.

Up in the body frame obeys ``du/dt = u × w``. Carried from the hold before, ``û = Cᵀ u_before`` with
C the rotation in between; the closure is the rotation vector from ``û`` to ``u_after``. Its two
components across gravity are the rows; they do not contain the part of a rotation about gravity.

``w = M (y − b) − ε(w, f, T, t) − Ω``, the force f at each sample being gravity carried there. ε is
taken at the rates and forces of the rows before; it is so small against them that each further
step of the fit adds two or three digits. A change δw of the rates turns û by ``û × ψ`` with
``ψ = Cᵀ Σ L ∫δw dt``, L being the attitude averaged over a step (Simpson's rule; the attitude half
way is the normalised sum of those at either end). With ``Σ L ∫ … dt`` written as weights of the
samples, the derivative by anything is one product of these weights with what it does to each
sample's rate. It leaves out what δw does to ε itself and to the coning: some thousandths of it.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import field, replace
from functools import cached_property

import numpy as np

from imucal_wizard.core.attitude import Attitudes, RotationSamples
from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quaternions import (
    carried_back,
    cross,
    matrices,
    matrices_of,
    products,
    quaternions,
)
from imucal_wizard.core.readings import BoolArray, FloatArray, IntArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median
from imucal_wizard.model.effect import GYROSCOPE, Circumstances
from imucal_wizard.model.rows.earth import EarthAxes, earth_names
from imucal_wizard.model.rows.source import (
    ENTRIES,
    Influence,
    Loading,
    Parameters,
    RowLabels,
    Rows,
    RowSource,
    reference_names,
    rounding_names,
    unmeasured,
)
from imucal_wizard.model.terms import Term, Terms, axis_columns_of, columns_of

COARSE_STEP = 1.0 / 30.0
"""Seconds between the moments at which an effect outside the model is evaluated: a hand does
nothing faster."""
TERMS_AT_ONCE = 16
"""Effects whose columns at all samples are in memory together: they stay in the cache."""

LEVI_CIVITA = np.zeros((3, 3, 3))
for _i, _j, _k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
    LEVI_CIVITA[_i, _j, _k], LEVI_CIVITA[_i, _k, _j] = 1.0, -1.0


class ClosureRows(Rows):
    """Two rows per rotation.

    Attributes:
        rate: corrected rate of each sample, rad/s, shape (n, 3).
        ends: rotation from the hold before to the hold after, shape (m, 3, 3).
        closure: closure of each rotation, rad, shape (m, 3).
    """

    def __init__(
        self,
        source: "GravityClosure",
        calibration: Parameters,
        terms: Terms,
        near: "ClosureRows | None",
    ) -> None:
        self._source, self._calibration = source, calibration
        samples = source.samples
        rate = (samples.reading - calibration.bias) @ calibration.matrix.T
        if len(terms):
            motion = source.motion if near is None else near.motion
            rate = rate - terms.columns(motion) @ calibration.sizes
        turned = quaternions(samples.rotation_vectors(rate))
        self._attitudes = Attitudes(turned, samples.step_offsets)
        self.rate = rate
        self.ends = np.moveaxis(matrices(self._attitudes.whole), -1, 0)
        self.closure = between(carry(self.ends, source.before), source.after)
        self.residual = source.rows_of(self.closure[:, :, None])[:, 0]
        self.own = np.repeat(source.noise, len(self.residual) // len(source.noise))
        self.direction = np.full((len(self.residual), 3), np.nan)
        self._coarse: _Moments | None = None

    @cached_property
    def force(self) -> FloatArray:
        """Specific force at each sample, m/s², shape (n, 3)."""
        samples = self._source.samples
        attitude = samples.at_samples(*self._attitudes.each)
        before = self._source.before if self._source.up is None else self._source.up
        up = carried_back(attitude, before[samples.rotation].T).T
        return np.asarray(self._source.gravity * up)

    @cached_property
    def weights(self) -> FloatArray:
        """``Σ L ∫ … dt`` as weights of the samples, s, shape (3, n, 3)."""
        weights = self._source.samples.sample_weights(self._means).reshape(3, 3, -1)
        return np.ascontiguousarray(np.moveaxis(weights, 1, 2))

    @property
    def motion(self) -> Circumstances:
        """Circumstances of the samples at this point."""
        return replace(self._source.motion, rate=self.rate, force=self.force)

    @cached_property
    def _means(self) -> FloatArray:
        """``L dt`` of each step, s, shape (9, s)."""
        return attitude_means(*self._attitudes.each) * self._source.samples.dt

    @cached_property
    def lever(self) -> FloatArray:  # type: ignore[override]  # computed when it is asked for
        """See ``Rows``: the seconds that a rate error on each axis acts."""
        first = self._source.samples.step_offsets[:-1]
        return self._closed(np.add.reduceat(self._means, first, axis=1).T.reshape(-1, 3, 3))

    def base_columns(self) -> FloatArray:
        """See ``Rows``: ``∂w/∂M_ij = e_i (y − b)_j`` and ``∂w/∂b = −M``."""
        samples = self._source.samples
        middle = np.ones((len(samples.dt), 4))
        middle[:, :3] = samples.at_middles(samples.reading - self._calibration.bias)
        turned = np.empty((len(self.closure), 3, ENTRIES))
        for index, (first, past) in enumerate(itertools.pairwise(samples.step_offsets.tolist())):
            product = (self._means[:, first:past] @ middle[first:past]).reshape(3, 3, 4)
            turned[index, :, :9] = product[:, :, :3].reshape(3, 9)
            turned[index, :, 9:] = -product[:, :, 3] @ self._calibration.matrix
        return self._closed(turned)

    def term_columns(self, terms: Sequence[Term]) -> FloatArray:
        """See ``Rows``."""
        if not terms:
            return np.zeros((len(self.residual), 0))
        offsets = self._source.samples.offsets
        return self._effects(terms, _Moments(self.weights, offsets, self.motion))

    def design_columns(self, terms: Sequence[Term]) -> FloatArray:
        """See ``Rows``: evaluated at some thirty moments a second, straight lines in between."""
        if self._coarse is None:
            self._coarse = self._moments()
        return self._effects(terms, self._coarse)

    def _moments(self) -> "_Moments":
        samples = self._source.samples
        every = max(int(np.round(COARSE_STEP / max(median(samples.dt), 1e-9))), 1)
        nodes, offsets = [], [0]
        for first, past in itertools.pairwise(samples.offsets.tolist()):
            own = np.append(np.arange(first, past - 1, every), past - 1)
            nodes.append(own)
            offsets.append(offsets[-1] + len(own))
        chosen = np.concatenate(nodes)
        left = np.searchsorted(chosen, np.arange(len(samples.time)), side="right") - 1
        right = np.minimum(left + 1, len(chosen) - 1)
        length = np.maximum(samples.time[chosen[right]] - samples.time[chosen[left]], 1e-12)
        share = np.where(chosen[left] == np.arange(len(left)), 0.0, 1.0)
        share *= (samples.time - samples.time[chosen[left]]) / length
        ahead = np.add.reduceat(share[:, None] * self.weights, chosen, axis=1)
        weights = np.add.reduceat((1.0 - share[:, None]) * self.weights, chosen, axis=1)
        weights[:, 1:] += ahead[:, :-1]
        return _Moments(weights, np.array(offsets, np.int64), self.motion.select(chosen))

    def _effects(self, terms: Sequence[Term], moments: "_Moments") -> FloatArray:
        parts = [np.zeros((len(self.closure), 3, 0))]
        for first in range(0, len(terms), TERMS_AT_ONCE):
            some = terms[first : first + TERMS_AT_ONCE]
            own = [axis_columns_of(term, GYROSCOPE, moments.motion) for term in some]
            by_axis = iter(moments.turned_by_axis([one for one in own if one is not None]))
            others = [term for term, one in zip(some, own, strict=True) if one is None]
            whole = iter(
                moments.turned([columns_of([t], GYROSCOPE, moments.motion) for t in others])
            )
            parts += [next(whole if one is None else by_axis) for one in own]
        return self._closed(-np.concatenate(parts, axis=2))

    def shared_columns(self) -> FloatArray:
        """See ``Rows``: errors of the reference, rounding shifts of the means at rest, and Ω.

        By one standard deviation of each. Rounding shifts the samples as long as the device rests,
        and by another error that the rotations share while it begins to move.
        """
        source = self._source
        carried = carry(self.ends, source.before)
        moved = np.einsum("mji,mjk->mik", self.ends, source.before_doubt)
        # the error runs from the carried to the measured direction: it falls with the one, and
        # moves with the other as the other way round
        change = error_slope(carried, source.after, moved)
        change = change - error_slope(source.after, carried, source.after_doubt)
        parts, shifted = [source.rows_of(change)], source.rounding > 0.0
        at_rest = None if source.resting is None else np.sqrt(source.rounding) * source.resting
        for error in (at_rest, source.begun):
            if error is not None:
                rates = -(self.weights @ self._calibration.matrix) * error
                turned = np.add.reduceat(rates, source.samples.offsets[:-1], axis=1)
                parts.append(self._closed(np.moveaxis(turned, 1, 0)[:, :, shifted]))
        if source.earth is not None:
            # fixed against gravity, as the attitudes are
            seconds = np.add.reduceat(source.samples.dt, source.samples.step_offsets[:-1])
            parts.append(self._closed(-seconds[:, None, None] * source.earth))
        return np.concatenate(parts, axis=1)

    def loading(self) -> Loading | None:
        """See ``Rows``: each rotation shares the direction errors of both its holds.

        By the noise of an axis beyond that of the quietest one its two rows move together.
        """
        source = self._source
        if not len(source.tilts):
            return None
        before, after = source.holds.T
        size = np.sqrt(np.repeat(source.tilts[source.joined], 2, axis=1))
        latent = np.stack([2 * before, 2 * before + 1, 2 * after, 2 * after + 1], axis=1)
        own = 2 * len(source.tilts) + np.arange(3 * len(before)).reshape(-1, 3)
        latent = np.repeat(np.concatenate([latent, own], axis=1), 2, axis=0)
        return Loading(latent, np.concatenate([size * self.tilts, self._uneven()], axis=1))

    @cached_property
    def tilts(self) -> FloatArray:
        """See ``Rows``: along two directions across up, the same for all rotations of a hold."""
        source = self._source
        carried = carry(self.ends, source.before)
        before, after = source.holds.T
        up = np.ones((int(source.holds.max()) + 1, 3))
        up[before], up[after] = source.before, source.after
        sides = np.swapaxes(across(up), 1, 2)
        moved, measured = np.einsum("mji,mjk->mik", self.ends, sides[before]), sides[after]
        change = [
            error_slope(carried, source.after, moved),
            -error_slope(source.after, carried, measured),
        ]
        return source.rows_of(np.concatenate(change, axis=2))

    def _uneven(self) -> FloatArray:
        """A root of the covariance of each rotation's rows by what axes have over the quietest."""
        source, samples = self._source, self._source.samples
        walk = np.broadcast_to(source.walk, (len(source.before), 3))
        uneven = np.sqrt(walk - walk.min(axis=1)[:, None])
        means, root = self._means.reshape(3, 3, -1), np.sqrt(np.maximum(samples.dt, 1e-12))
        whole = np.empty((len(uneven), 3, 3))
        for index, (first, past) in enumerate(itertools.pairwise(samples.step_offsets.tolist())):
            scale = uneven[index][:, None] / root[first:past]
            steps = (means[:, :, first:past] * scale).reshape(3, -1)
            whole[index] = steps @ steps.T
        values, vectors = np.linalg.eigh(whole)
        return self._closed(vectors * np.sqrt(np.maximum(values, 0.0))[:, None, :])

    def _closed(self, turned: FloatArray) -> FloatArray:
        """Derivative of the rows from ``Σ L ∫ ∂w dt``, shape (m, 3, p)."""
        psi = np.einsum("mji,mjp->mip", self.ends, turned)
        carried = carry(self.ends, self._source.before)
        moved = np.einsum("iab,ma,mbp->mip", LEVI_CIVITA, carried, psi)
        return self._source.rows_of(error_slope(carried, self._source.after, moved))


@dataclass(frozen=True, eq=False)
class _Moments:
    """How rates at some moments turn the closures.

    Attributes:
        weights: of the moments' rates, s, shape (3, k, 3).
        offsets: first moment of each rotation, and k, shape (m + 1,).
        motion: circumstances of the moments.
    """

    weights: FloatArray
    offsets: IntArray
    motion: Circumstances

    def turned(self, columns: Sequence[FloatArray]) -> list[FloatArray]:
        """How effects turn the closures.

        Args:
            columns: of each effect, shape (k, 3, p) each.

        Returns:
            Per shown unit of the effects' parameters, shape (m, 3, p) each.
        """
        if not columns:
            return []
        moved = np.concatenate(columns, axis=2)
        found = np.empty((len(self.offsets) - 1, 3, moved.shape[2]))
        for index, (first, past) in enumerate(itertools.pairwise(self.offsets.tolist())):
            weights = self.weights[:, first:past].reshape(3, -1)
            found[index] = weights @ moved[first:past].reshape(-1, moved.shape[2])
        return np.split(found, np.cumsum([one.shape[2] for one in columns])[:-1], axis=2)

    def turned_by_axis(self, columns: Sequence[FloatArray]) -> list[FloatArray]:
        """The same where each parameter moves one axis: a ninth or a third of the products.

        Args:
            columns: see ``Effect.axis_columns``, shape (k, 3, q) each.

        Returns:
            Shape (m, 3, 3 q) each.
        """
        if not columns:
            return []
        ends = np.cumsum([one.shape[2] for one in columns])
        # one parameter after the other in memory, as the products take them
        moved = np.empty((3, ends[-1], len(self.motion)))
        for one, end in zip(columns, ends.tolist(), strict=True):
            moved[:, end - one.shape[2] : end] = np.transpose(one, (1, 2, 0))
        found = np.empty((len(self.offsets) - 1, 3, ends[-1], 3))
        for index, (first, past) in enumerate(itertools.pairwise(self.offsets.tolist())):
            np.matmul(moved[:, :, first:past], self._by_axis[:, first:past], out=found[index])
        # by rotation, input axis, its parameters, and axis across which it turns
        each = np.split(found, ends[:-1], axis=2)
        return [np.moveaxis(one, 3, 1).reshape(len(one), 3, -1) for one in each]

    @cached_property
    def _by_axis(self) -> FloatArray:
        """``weights`` by input axis, shape (3, k, 3)."""
        return np.ascontiguousarray(np.transpose(self.weights, (2, 1, 0)))


@dataclass(frozen=True, eq=False)
class GravityClosure(RowSource):
    """Two rows per rotation.

    Attributes:
        samples: of the gyroscope in m rotations.
        before: up at the hold before each, unit vectors, shape (m, 3).
        after: up at the hold after, shape (m, 3).
        before_doubt: change of ``before`` with each of the k ways in which the accelerometer may
            be wrong by one standard deviation, shape (m, 3, k).
        after_doubt: the same of ``after``.
        noise: variance of a closure component by the noise of the rates, rad², shape (m,).
        motion: circumstances of the samples; force and rate are replaced by those of the fit.
        gravity: m/s².
        labels: see ``RowSource``.
        rounding: variance by which rounding shifts the readings at rest, reading units², (3,).
        resting: samples of each axis that rounding still shifts like the holds, shape (n, 3); None
            where rounding is no matter.
        begun: error by rounding of each sample while an axis begins to move, one standard deviation
            of what the rotations share, reading units, shape (n, 3).
        walk: variance × time of the corrected rate of each axis, rad²/s, shape (3,), or of each
            rotation, (m, 3); ``noise`` has that of the quietest.
        holds: numbers of the holds before and after each, shape (m, 2).
        tilts: variance of each component of the direction measured in each hold, rad², shape (h,).
        usual: how many of the k ways, the last, nothing measured: parameters of usual size.
        left_open: how many of these, the first, are left to these rows.
        up: up at the hold before each, where ``before`` is another direction, shape (m, 3).
        earth: rate in the hold before by each part of the Earth's rate of usual size, shape
            (m, 3, p); None where it is left out.
        basis: two directions across ``after`` and one another, shape (m, 2, 3).
    """

    samples: RotationSamples
    before: FloatArray
    after: FloatArray
    before_doubt: FloatArray
    after_doubt: FloatArray
    noise: FloatArray
    motion: Circumstances
    gravity: float
    labels: RowLabels
    rounding: FloatArray = field(default_factory=lambda: np.zeros(3))
    resting: BoolArray | None = None
    begun: FloatArray | None = None
    walk: FloatArray = field(default_factory=lambda: np.zeros(3))
    holds: IntArray = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    tilts: FloatArray = field(default_factory=lambda: np.zeros(0))
    usual: int = 0
    left_open: int = 0
    up: FloatArray | None = None
    earth: FloatArray | None = None
    basis: FloatArray = field(init=False)
    kind, moving, needs_reference = "rotation", True, True
    unit = "rad"
    group_word = "rotation"
    part, left = "rotations", "the angle by which each rotation does not close"

    def influences(self) -> tuple[Influence, ...]:
        """See ``RowSource``."""
        first = self.samples.offsets[:-1]
        rate = np.degrees(self.motion.rate)
        fastest = np.maximum.reduceat(np.linalg.norm(rate, axis=1), first)
        mean = np.add.reduceat(rate, first) / np.diff(self.samples.offsets)[:, None]
        found = (
            Influence("rate", "fastest rate, °/s", np.asarray(fastest, float)),
            *(
                Influence(f"rate-{axis}", f"mean rate about {axis}, °/s", mean[:, k])
                for k, axis in enumerate(AXES)
            ),
            Influence("time", "time, min", self.motion.time[first] / 60.0),
            Influence("temperature", "temperature, °C", self.motion.temperature[first]),
            *(
                Influence(f"up-{a}", f"{a} part of up before the rotation, g", self.before[:, k])
                for k, a in enumerate(AXES)
            ),
        )
        number = Influence("number", "number of the rotation", np.asarray(self.labels.index + 1.0))
        rows = len(self.labels) // len(first)
        each = [Influence(one.name, one.label, np.repeat(one.values, rows)) for one in found]
        return (*each[:4], number, *each[4:])

    def per_item(self, of: Callable[[Circumstances], FloatArray]) -> FloatArray:
        """See ``RowSource``."""
        values = of(self.motion)
        ends = itertools.pairwise(self.samples.offsets.tolist())
        each = [values[first:past] for first, past in ends]
        return np.array([one[np.abs(one).argmax()] for one in each])

    def measured(self, row: int) -> tuple[FloatArray, str]:
        """See ``RowSource``: the fastest rate, °/s."""
        rates = self.motion.rate[self._samples(row)]
        return np.degrees(rates[np.argmax(np.linalg.norm(rates, axis=1))]), "deg/s"

    def samples_of(self, row: int) -> tuple[FloatArray, FloatArray]:
        """See ``RowSource``."""
        rows = self._samples(row)
        return self.samples.time[rows], self.samples.reading[rows]

    def _samples(self, row: int) -> slice:
        place = row // (len(self.labels) // len(self.before))
        return slice(*self.samples.offsets[place : place + 2])

    def __post_init__(self) -> None:
        object.__setattr__(self, "basis", across(self.after))

    @property
    def shared(self) -> tuple[str, ...]:  # type: ignore[override]  # follows from the reference
        """See ``RowSource``."""
        names = reference_names(self.before_doubt), rounding_names(self.rounding)
        begun = () if self.begun is None else rounding_names(self.rounding, "rounding_in_motion")
        return (*names[0], *names[1], *begun, *earth_names(self.earth))

    @property
    def undetermined(self) -> tuple[str, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        names = reference_names(self.before_doubt)
        return (*names[len(names) - self.usual :], *earth_names(self.earth))

    @property
    def decided(self) -> tuple[str, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return self.undetermined[: self.left_open]

    @property
    def shared_precision(self) -> tuple[float, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return tuple(np.ones(len(self.shared)).tolist())

    @property
    def bounded(self) -> tuple[str, ...]:  # type: ignore[override]  # as above
        """See ``RowSource``."""
        return earth_names(self.earth)

    @property
    def joined(self) -> IntArray:
        """See ``RowSource``."""
        return np.repeat(self.holds, len(self.labels) // len(self.before), axis=0)

    def on_earth(self, earth: EarthAxes) -> "GravityClosure":
        """See ``RowSource``."""
        return replace(self, earth=earth.rates(self.holds[:, 0]))

    def elsewhere(
        self, directions: FloatArray, calibration: Parameters, terms: Terms
    ) -> "GravityClosure":
        """See ``RowSource``: the same rotations of a device that lies otherwise in the hand.

        Each rotation has its z axis turned to one of the directions.
        """
        del terms  # they move the rate by far less than it is
        count = len(self.before)
        z = directions[np.arange(count) % len(directions)]
        across = np.eye(3)[np.abs(z).argmin(axis=1)]
        x = unit_vectors(np.cross(across, z))
        turns = np.stack([x, np.cross(z, x), z], axis=2)
        each, samples = turns[self.samples.rotation], self.samples
        rate = (samples.reading - calibration.bias) @ calibration.matrix.T

        def turned(vectors: FloatArray, by: FloatArray) -> FloatArray:
            return np.asarray(np.einsum("nij,nj...->ni...", by, vectors))

        reading = turned(rate, each) @ np.linalg.inv(calibration.matrix).T + calibration.bias
        motion = self.motion
        return replace(
            self,
            samples=replace(samples, reading=reading),
            before=turned(self.before, turns),
            after=turned(self.after, turns),
            before_doubt=turned(self.before_doubt, turns),
            after_doubt=turned(self.after_doubt, turns),
            earth=None,
            motion=replace(
                motion,
                force=turned(motion.force, each),
                rate=turned(motion.rate, each),
                previous=turned(motion.previous, each),
            ),
            labels=unmeasured(count, 2),
        )

    def at(self, calibration: Parameters, terms: Terms, near: Rows | None = None) -> ClosureRows:
        """See ``RowSource``."""
        return ClosureRows(
            self, calibration, terms, near if isinstance(near, ClosureRows) else None
        )

    def closures(self, matrix: FloatArray, bias: FloatArray) -> FloatArray:
        """Closure of each rotation without effects, rad, shape (m, 3).

        Args:
            matrix: M, one (3, 3), or one per rotation (m, 3, 3).
            bias: b, one (3,), or one per rotation (m, 3).
        """
        one = self.samples
        if matrix.ndim == 3:
            offset = one.reading - bias[one.rotation]
            rate = np.einsum("nij,nj->ni", matrix[one.rotation], offset)
        else:
            rate = (one.reading - bias) @ matrix.T
        turned = Attitudes(quaternions(one.rotation_vectors(rate)), one.step_offsets)
        ends = np.moveaxis(matrices(turned.whole), -1, 0)
        return between(carry(ends, self.before), self.after)

    def rows_of(self, closures: FloatArray) -> FloatArray:
        """Rows from closures or their derivatives, (m, 3, p) to (2 m, p)."""
        rows = np.einsum("mai,mip->map", self.basis, closures)
        return np.asarray(rows.reshape(2 * len(closures), closures.shape[2]))


def across(up: FloatArray) -> FloatArray:
    """Two directions across each of these unit vectors and one another, shape (m, 2, 3)."""
    axis = np.eye(3)[np.abs(up).argmin(axis=1)]
    first = unit_vectors(np.cross(up, axis))
    return np.stack([first, np.cross(up, first)], axis=1)


def carry(ends: FloatArray, before: FloatArray) -> FloatArray:
    """``Cᵀ u`` for each rotation, shape (m, 3)."""
    return np.asarray(np.einsum("mji,mj->mi", ends, before))


def between(a: FloatArray, b: FloatArray) -> FloatArray:
    """Rotation vector from the direction of each a to that of b, rad, shape (m, 3).

    Between opposite vectors, where every axis across serves, one of them.
    """
    normal = cross(a.T, b.T).T
    sine = np.linalg.norm(normal, axis=1)
    cosine = (a * b).sum(axis=1)
    ratio = np.where(sine > 1e-12, np.arctan2(sine, cosine) / np.maximum(sine, 1e-12), 1.0)
    opposite = (sine <= 1e-12) & (cosine < 0.0)
    if opposite.any():
        axis = np.eye(3)[np.abs(a[opposite]).argmin(axis=1)]
        normal[opposite], ratio[opposite] = unit_vectors(np.cross(a[opposite], axis)), np.pi
    return np.asarray(normal * ratio[:, None])


def attitude_means(first: FloatArray, last: FloatArray) -> FloatArray:
    """``L``: attitude averaged over each step, shape (9, n)."""
    middle = first + last
    middle *= 2.0 / np.sqrt(np.maximum((middle * middle).sum(axis=0), 1e-30))
    total = products(first)
    total += products(middle)
    total += products(last)
    total /= 6.0
    return matrices_of(total).reshape(9, -1)


def error_slope(carried: FloatArray, after: FloatArray, moved: FloatArray) -> FloatArray:
    """Derivative of ``between(carried, after)`` when ``carried`` moves by ``moved`` (m, 3, p).

    With n = û × u, s = |n|, α = atan2(s, û·u), the error is ``(α/s) n``; α/s changes by
    ``(α' − (α/s) s') / s`` with ``s' = n·n'/s`` and ``α' = (c s' − s c')``, c = û·u.
    """
    normal = cross(carried.T, after.T).T
    slope = np.einsum("iab,map,mb->mip", LEVI_CIVITA, moved, after)
    sine = np.linalg.norm(normal, axis=1)
    cosine = (carried * after).sum(axis=1)
    safe = np.maximum(sine, 1e-9)
    ratio = np.where(sine > 1e-9, np.arctan2(sine, cosine) / safe, 1.0)
    direction = normal / safe[:, None]
    sine_slope = np.einsum("mi,mip->mp", direction, slope)
    cosine_slope = np.einsum("mi,mip->mp", after, moved)
    angle_slope = cosine[:, None] * sine_slope - sine[:, None] * cosine_slope
    ratio_slope = (angle_slope - ratio[:, None] * sine_slope) / safe[:, None]
    ratio_slope = np.where(sine[:, None] > 1e-6, ratio_slope, 0.0)
    return np.asarray(ratio[:, None, None] * slope + normal[:, :, None] * ratio_slope[:, None, :])
