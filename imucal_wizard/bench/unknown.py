"""Structure without a name: an error smooth over the sphere, or a characteristic of one axis.

Both are Gaussian processes with a Gaussian kernel, written with the values at a few nodes
(Nyström's method), so that no matrix of the size of the data has to be taken apart.
"""

import itertools
from functools import cache

import numpy as np

from imucal_wizard.bench.hypotheses import PRIOR, UNKNOWN, Hypothesis
from imucal_wizard.bench.misfit import Misfit, RowKind
from imucal_wizard.bench.noise import Frame, shown_axes
from imucal_wizard.procedure.poses import DIRECTIONS
from imucal_wizard.readings import FloatArray

LENGTHS = (0.22, 0.4)
"""Lengths over which unknown structure changes, rad on the sphere or g along an axis."""
SIZES = (1.5, 5.0, 16.0)
"""Its size in noise standard deviations."""
WAVES = tuple(np.linspace(4.5, 12.0, 11))
"""Wave numbers of a rippled characteristic, rad/g."""
SHARES = {"sphere": 0.15, "odd": 0.15, "even": 0.1, "axes": 0.1, "axis": 0.06, "wave": 0.1}
"""How often it lies anywhere on the sphere, is odd or even under inversion, lies along all axes,
along one certain axis in any shape or as a wave. Most errors of a sensor are either odd or even."""
_LEVELS = np.linspace(-1.0, 1.0, 13)
_NODES = np.array(list(DIRECTIONS.values()))
_HALF = _NODES[[i for i, v in enumerate(_NODES) if tuple(v) > (0.0, 0.0, 0.0)]]


def unknown(misfit: Misfit, frame: Frame) -> list[Hypothesis]:
    """Unknown structure at every length and place."""
    seen = misfit.kind != RowKind.ROTATION
    up = np.where(seen[:, None], misfit.direction, 0.0)
    shown = shown_axes(misfit)
    dips = misfit.kind == RowKind.DIP
    apart = np.where(dips, 3, misfit.axis)
    axes = [seen & (apart == axis) for axis in np.unique(apart[seen])]
    made = []
    for length in LENGTHS:
        shapes: list[tuple[float, list[FloatArray]]] = []
        for kind, sign in (("sphere", 0), ("odd", -1), ("even", 1)):
            field = _sphere(up, length, sign)
            shapes.append((SHARES[kind], [field * rows[:, None] for rows in axes]))
        along = [_along(up[:, k], length) * shown[:, [k]] for k in range(3)]
        shapes.append((SHARES["axes"], along))
        shapes += [(SHARES["axis"], [one]) for one in along]
        for share, patterns in shapes:
            if not patterns:
                continue
            prior = float(np.log(PRIOR[UNKNOWN] * share / len(LENGTHS)))
            inside = frame.across.T @ np.concatenate(patterns, axis=1)
            made.append(Hypothesis(UNKNOWN, (), (UNKNOWN,), None, "", prior, inside, SIZES))
    return made + _waves(up, shown, frame)


def _waves(up: FloatArray, shown: FloatArray, frame: Frame) -> list[Hypothesis]:
    """A rippled characteristic of each axis, of any phase."""
    made = []
    for axis, wave in itertools.product(range(3), WAVES):
        phase = wave * up[:, [axis]]
        patterns = np.concatenate([np.sin(phase), np.cos(phase)], axis=1) * shown[:, [axis]]
        prior = float(np.log(PRIOR[UNKNOWN] * SHARES["wave"] / len(WAVES)))
        inside = frame.across.T @ patterns
        made.append(Hypothesis(UNKNOWN, (), (UNKNOWN,), None, "", prior, inside, SIZES))
    return made


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


def _along(values: FloatArray, length: float) -> FloatArray:
    near = np.exp(-0.5 * ((values[:, None] - _LEVELS) / length) ** 2)
    return np.asarray(near @ _level_root(length))


@cache
def _level_root(length: float) -> FloatArray:
    return _whitener(np.exp(-0.5 * ((_LEVELS[:, None] - _LEVELS) / length) ** 2))


def _whitener(kernel: FloatArray) -> FloatArray:
    """Root of the kernel's inverse, without what is rounding."""
    values, vectors = np.linalg.eigh(kernel)
    seen = values > 1e-6 * values[-1]
    return np.asarray(vectors[:, seen] / np.sqrt(values[seen]))
