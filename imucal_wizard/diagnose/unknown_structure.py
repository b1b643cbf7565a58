"""Structure that no effect causes, as hypotheses: without them a misfit goes to what resembles it.

An error smooth over the sphere of directions, or a characteristic of one axis over what it feels:
in any smooth shape, as a wave, or as a jump. Smooth ones are Gaussian processes written with their
values at a few nodes (Nyström's method). The input of a gyroscope is a rate, which rotations show;
its rests show how it depends on the force. The axes of a sensor may also change while it is
calibrated, once or in a smooth course.
"""

import itertools
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial

import numpy as np

from imucal_wizard.core.poses import AXES, DIRECTIONS
from imucal_wizard.core.readings import FloatArray, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import median, root_mean_square, sample_quantile
from imucal_wizard.diagnose.hypotheses import PRIOR, UNKNOWN, Hypothesis
from imucal_wizard.diagnose.random_walk import Frame, shown_axes, usual_errors
from imucal_wizard.diagnose.residuals import RowKind, WhitenedResiduals
from imucal_wizard.model.effect import step_moments
from imucal_wizard.model.requirements import FELT_IN_MOTION
from imucal_wizard.model.terms import Term
from imucal_wizard.model.unknown_shape import Course

LENGTHS = (0.22, 0.4)
"""Lengths over which it changes, rad on the sphere, or g or the largest rate along an axis."""
SIZES = (1.5, 5.0, 16.0, 64.0, 256.0)
"""Its size in noise standard deviations."""
USUAL_MISFIT = 100.0
"""Misfit, rms in units of the noise, up to which these sizes, and those of jumps, suffice. Data
without noise have a larger one."""
WAVES = tuple(np.linspace(3.5, 12.0, 12))
"""Wave numbers of a rippled characteristic, rad per g or per largest rate."""
SHARES = {
    "sphere": 0.14,
    "odd": 0.14,
    "even": 0.09,
    "axes": 0.09,
    "axis": 0.05,
    "wave": 0.09,
    "jump": 0.04,
    "knee": 0.04,
    "across": 0.05,
    "gain": 0.05,
    "power": 0.01,
}
"""How often it lies anywhere on the sphere, is odd or even under inversion, lies along all axes,
along one certain axis in any shape, as a wave, as a jump or as a knee; how often the error or the
scale of one certain axis follows the force along one certain other one, smoothly or as a power of
its size. Most errors of a sensor are either odd or even. Along axes it is over the rate as often as
over the force."""
SIGNS = {"sphere": 0, "odd": -1, "even": 1}
"""By which inversion multiplies structure on the sphere; 0 by nothing certain."""
JUMPS = tuple(np.linspace(-0.9, 0.9, 13))
"""Inputs at which a characteristic may jump, as at a missing code, g or largest rates."""
KNEES = tuple(one for one in JUMPS if 0.25 < abs(one) < 0.7)
"""Inputs at which its slope may change. One at 0 is the asymmetry of the catalogue, and beyond the
edges of a cube, at 0.71 g, one hold shows it: the same as a disturbed hold."""
POWERS = (1.0, 3.0)
"""Of the size of the force along another axis. Two is a cross effect of the catalogue, whose curve
these are told from only by inputs between the faces and edges of a cube, or by little noise. Each
is about as likely as a knee at one place."""
JUMP_WIDTH = 0.02
"""Half width of a jump, g: poses are placed less exactly."""
STEEP_SIZES = (5.0, 25.0, 125.0, 500.0, 2000.0)
"""Size of a jump, a knee or a power in noise standard deviations: bias and scale take up most."""
MAX_PATTERNS = 9
"""Patterns of an explanation up to which fewer are not looked for: the entries of a matrix."""
_LEVELS = np.linspace(-1.0, 1.0, 13)
_NODES = np.array(list(DIRECTIONS.values()))
_HALF = _NODES[[i for i, v in enumerate(_NODES) if tuple(v) > (0.0, 0.0, 0.0)]]


@dataclass(frozen=True, eq=False)
class Characteristic:
    """What an error of one axis makes that follows what the axis feels.

    Attributes:
        parameter: see ``Hypothesis``.
        place: inputs from −1 to 1, shape (k,).
        shown: how much an error at each of them shows, shape (k,).
        errors: what it makes there, shape (m, k).
    """

    parameter: str
    place: FloatArray
    shown: FloatArray
    errors: FloatArray

    def of(self, course: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """Patterns of courses over the input, (k, 1) to (k, q), shape (m, q)."""
        return np.asarray(self.errors @ (course(self.place[:, None]) * self.shown[:, None]))


def unknown_structure(misfit: WhitenedResiduals, frame: Frame) -> list[Hypothesis]:
    """Unknown structure at every length and place."""
    seen = misfit.kind != RowKind.ROTATION
    up = np.where(seen[:, None], misfit.direction, 0.0)
    shown = shown_axes(misfit)
    errors = usual_errors(misfit, frame) * _reach(misfit)
    apart = np.where(misfit.kind == RowKind.DIP, 3, misfit.axis)
    groups = [seen & (apart == axis) for axis in distinct(apart[seen])]
    made = []
    for length, (kind, sign) in itertools.product(LENGTHS, SIGNS.items() if groups else ()):
        field = _sphere(up, length, sign)
        patterns = np.concatenate([field * rows[:, None] for rows in groups], axis=1)
        made.append(_unknown("", PRIOR[UNKNOWN] * SHARES[kind] / len(LENGTHS), errors @ patterns))
    # as free curves and effects name what moves an axis
    felt = 1 + (misfit.minimum.experiment.sensor in FELT_IN_MOTION)
    by_force = [
        Characteristic(felt * axis, up[:, k], shown[:, k], errors) for k, axis in enumerate(AXES)
    ]
    made += _of_axes(by_force) + _of_axes(_by_rate(misfit, frame))
    for (i, own), (j, other) in itertools.permutations(enumerate(AXES), 2):
        for kind, size in (("across", shown[:, i]), ("gain", shown[:, i] * up[:, i])):
            one = Characteristic(own + other, up[:, j], size, errors)
            prior = PRIOR[UNKNOWN] * SHARES[kind] / len(LENGTHS)
            courses = [one.of(partial(_smooth, length=length)) for length in LENGTHS]
            made += [_unknown(one.parameter, prior, course) for course in courses]
            prior = PRIOR[UNKNOWN] * SHARES["power"] / len(POWERS)
            courses = [one.of(partial(_power, exponent=exponent)) for exponent in POWERS]
            made += [_unknown(one.parameter, prior, course, STEEP_SIZES) for course in courses]
    return made


def _reach(misfit: WhitenedResiduals) -> float:
    """Factor on all sizes: structure must be able to explain a misfit that effects can explain."""
    return max(root_mean_square(misfit.residual) / USUAL_MISFIT, 1.0)


def _of_axes(axes: Sequence[Characteristic]) -> list[Hypothesis]:
    """Characteristics of all axes, and of each of them."""
    made, prior = [], {kind: PRIOR[UNKNOWN] * share for kind, share in SHARES.items()}
    for length in LENGTHS if axes else ():
        along = [one.of(partial(_smooth, length=length)) for one in axes]
        made.append(_unknown(AXES, prior["axes"] / len(LENGTHS), np.concatenate(along, axis=1)))
        made += [
            _unknown(one.parameter, prior["axis"] / len(LENGTHS), patterns)
            for one, patterns in zip(axes, along, strict=True)
        ]
    for one, wave in itertools.product(axes, WAVES):
        patterns = one.of(partial(_wave, number=wave))
        made.append(_unknown(one.parameter, prior["wave"] / len(WAVES), patterns))
    for one, level in itertools.product(axes, JUMPS):
        patterns = one.of(partial(_jump, level=level))
        made.append(_unknown(one.parameter, prior["jump"] / len(JUMPS), patterns, STEEP_SIZES))
    for one, level in itertools.product(axes, KNEES):
        patterns = one.of(partial(_knee, level=level))
        made.append(_unknown(one.parameter, prior["knee"] / len(KNEES), patterns, STEEP_SIZES))
    return made


def _smooth(place: FloatArray, length: float) -> FloatArray:
    """Any smooth course, shape (k, q)."""
    near = np.exp(-0.5 * ((place - _LEVELS) / length) ** 2)
    return np.asarray(near @ _level_root(length))


def _wave(place: FloatArray, number: float) -> FloatArray:
    """A wave of any phase, shape (k, 2)."""
    phase = number * place
    return np.concatenate([np.sin(phase), np.cos(phase)], axis=1)


def _jump(place: FloatArray, level: float) -> FloatArray:
    """A jump, shape (k, 1); poses show it only in between."""
    return np.asarray(np.clip((place - level) / JUMP_WIDTH, -1.0, 1.0))


def _knee(place: FloatArray, level: float) -> FloatArray:
    """A change of slope, as where a mass touches a stop, shape (k, 1)."""
    return np.abs(place - level)


def _power(place: FloatArray, exponent: float) -> FloatArray:
    """A power of the size, shape (k, 1)."""
    return np.abs(place) ** exponent


def _by_rate(misfit: WhitenedResiduals, frame: Frame) -> list[Characteristic]:
    """Characteristics over the rate, which rotations show; none of a sensor without rotations."""
    experiment, turned = misfit.minimum.experiment, misfit.kind == RowKind.ROTATION
    if experiment.sensor not in FELT_IN_MOTION or not turned.any():
        return []
    course = Course(float(np.abs(experiment.everything().rate).max()))
    # a size of one turns a rotation by its noise if it acts from beginning to end
    seconds = np.linalg.norm(misfit.lever[turned], axis=1)
    size = median(misfit.sigma[turned]) / median(seconds)
    errors = misfit.whitened(misfit.table.design_columns([Term(course)]))
    by_axis = np.split(size * frame.across.T @ errors, len(AXES), axis=1)
    shown = np.ones(len(course.nodes))
    return [
        Characteristic(axis, course.nodes, shown, own)
        for axis, own in zip(AXES, by_axis, strict=True)
    ]


def _unknown(
    where: str, prior: float, patterns: FloatArray, sizes: tuple[float, ...] = SIZES
) -> Hypothesis:
    known = (), (UNKNOWN,), None, where, float(np.log(prior)), _compact(patterns), sizes
    return Hypothesis(UNKNOWN, *known)


MIN_PART = 1e-3
"""Size of a pattern over that of the largest one of its explanation, below which it is left out: at
the largest of ``SIZES`` it still moves the rows by less than their noise."""


def _compact(patterns: FloatArray) -> FloatArray:
    """As few patterns with the same covariance: every one costs as much as an explanation."""
    if patterns.shape[1] <= MAX_PATTERNS or not patterns.any():
        return patterns
    left, values, _ = np.linalg.svd(patterns, full_matrices=False)
    shown = values > MIN_PART * values.max(initial=0.0)
    return np.asarray(left[:, shown] * values[shown])


CHANGING_AXES = "axes-change"
"""Parameter of unknown structure that is a change of the axes in the session."""
AXES_CHANGE_PRIOR = 0.03
"""As likely before any data as the effects of the catalogue that change a scale with the time."""
CHANGE_LENGTHS = (0.4, 1.0)
"""Halves of a session over which axes change that do so smoothly; their courses are one kernel."""


def axes_changes(misfit: WhitenedResiduals, frame: Frame) -> list[Hypothesis]:
    """Axes that tilt towards one another: one of them, or all, whose scales then change too.

    A matrix that changes moves each row by what the same change does at its time. What the field of
    a room does to a magnetometer meanwhile is larger, see ``field_changes``.
    """
    turned = misfit.minimum.experiment.sensor in FELT_IN_MOTION
    seen = misfit.kind == (RowKind.ROTATION if turned else RowKind.HOLD)
    time = misfit.time - misfit.time.min(where=seen, initial=np.inf)
    length = float(time.max(where=seen, initial=0.0))
    if length <= 0.0:
        return []
    # a magnitude does not tell which of two axes tilts
    places = [(i, j) for i in range(3) for j in range(0 if turned else i, 3)]
    entries = np.concatenate([rows.base_columns()[:, :9] for rows in misfit.table.at])
    # at a size of one, an input as large as the largest is wrong by the usual noise
    size = median(misfit.sigma[seen]) / float(np.abs(entries[seen]).max())
    entries = size * np.where(seen[:, None], entries, 0.0)
    tilts, whole = [[3 * i + j] for i, j in places if i != j], [3 * i + j for i, j in places]
    middles = step_moments(misfit.minimum.experiment.circumstances)
    late = [(misfit.time >= one)[:, None] for one in middles if one is not None]
    nodes = (2.0 * time / length - 1.0)[:, None]
    smooth = [_smooth(nodes, one) / np.sqrt(len(CHANGE_LENGTHS)) for one in CHANGE_LENGTHS]
    # nine entries at every moment would cost more than all other structure of a gyroscope
    once = tilts if turned else [*tilts, whole]
    columns, priors = [], []
    for courses, ways in ((late, once), ([np.hstack(smooth)], [*tilts, whole])):
        for course, way in itertools.product(courses, ways):
            columns.append(np.hstack([course * entries[:, [entry]] for entry in way]))
            priors.append(0.5 * AXES_CHANGE_PRIOR / len(ways) / len(courses))
    # one product of all columns is much faster than one for each
    patterns = frame.across.T @ misfit.whitened(np.hstack(columns))
    each = np.split(patterns, np.cumsum([one.shape[1] for one in columns])[:-1], axis=1)
    return [_unknown(CHANGING_AXES, prior, own) for prior, own in zip(priors, each, strict=True)]


FIELD_CHANGE_PRIOR = 0.06
"""As likely before any data as structure over the sphere."""
JUMP_MOMENTS = 15
"""At which it may jump, evenly over the rows in their order of time."""
CHANGE_WINDOWS = (0.08, 0.2)
"""Shares of the rows during which it may differ."""
MIN_FIELD_ROWS = 12
"""Rows with fewer of which no course is looked for."""


def field_changes(misfit: WhitenedResiduals, frame: Frame) -> list[Hypothesis]:
    """Jumps, and stretches in which the field differs, at every time."""
    field = misfit.kind >= RowKind.FIELD
    if field.sum() < MIN_FIELD_ROWS:
        return []
    courses = list(_courses(misfit.time, field))
    usual = median(misfit.sigma[field])
    shown = misfit.lever * (usual / misfit.sigma)[:, None]
    prior = FIELD_CHANGE_PRIOR / len(courses)
    return [_unknown("", prior, frame.across.T @ (shown * one[:, None])) for one in courses]


def _courses(time: FloatArray, field: np.ndarray) -> Iterator[FloatArray]:
    """1 where the field is another one, else 0, shape (n,)."""
    moments = np.sort(time[field])
    for share in np.linspace(0.0, 1.0, JUMP_MOMENTS + 2)[1:-1]:
        yield (time >= sample_quantile(moments, share)).astype(float)
    for width in CHANGE_WINDOWS:
        for start in np.arange(0.0, 1.0 - 0.5 * width, 0.5 * width):
            ends = start, min(start + width, 1.0)
            low, high = (sample_quantile(moments, end) for end in ends)
            yield ((time >= low) & (time <= high)).astype(float)


def _sphere(up: FloatArray, length: float, sign: int) -> FloatArray:
    nodes, root = _sphere_nodes(length, sign)
    return np.asarray(_sphere_kernel(up, nodes, length, sign) @ root)


def _sphere_kernel(a: FloatArray, b: FloatArray, length: float, sign: int) -> FloatArray:
    """``k(a, b)``, or its part that is odd (−1) or even (+1) under inversion."""
    cosine = a @ b.T
    near = np.exp((cosine - 1.0) / length**2)
    return np.asarray(near + sign * np.exp((-cosine - 1.0) / length**2))


@cache
def _sphere_nodes(length: float, sign: int) -> tuple[FloatArray, FloatArray]:
    nodes = _HALF if sign else _NODES
    return nodes, _whitener(_sphere_kernel(nodes, nodes, length, sign))


@cache
def _level_root(length: float) -> FloatArray:
    return _whitener(np.exp(-0.5 * ((_LEVELS[:, None] - _LEVELS) / length) ** 2))


def _whitener(kernel: FloatArray) -> FloatArray:
    """Root of the kernel's inverse, without what is rounding."""
    values, vectors = np.linalg.eigh(kernel)
    seen = values > 1e-6 * values[-1]
    return np.asarray(vectors[:, seen] / np.sqrt(values[seen]))
