"""Which parameters are identifiable: decided from the directions of the holds before any fit.

At rest a calibration error shows only along the reading, as ``e(u) = j(u)·θ``: bias gives ``u``,
scale the squares ``u_i²``, non-orthogonality the products ``u_i u_j``. The distinct directions
alone determine the error that a fit of some of the nine parameters leaves in any orientation,

    E(u)² = σ² j_f(u)ᵀ (X_fᵀX_f)⁻¹ j_f(u) + | (j_d(u) − j_f(u) X_f⁺ X_d) s_d |²

with f the parameters that are free, d those left at their nominal value, X their columns at the
directions held, σ the noise of a hold and s the usual size of each parameter. The first term grows
with the parameters that are fitted, the second with those that are not. Only models with spare
directions are considered. The one with the least E (rms over the sphere) is taken; its E must be
less than the error of the sensor without any calibration.
"""

import itertools
from collections.abc import Iterator
from functools import cache

import numpy as np

from imucal_wizard.core.directions import even_directions
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.quantities import plural
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass

BIAS, SCALE, NON_ORTHOGONALITY = (0, 1, 2), (3, 6, 8), (4, 5, 7)
"""Places of the nine parameters: biases, then M's xx, xy, xz, yy, yz, zz."""
SIZE = 9

TYPICAL_SIZE = np.array([0.03, 0.03, 0.03, 0.02, 0.015, 0.015, 0.02, 0.015, 0.02])
"""Usual errors of a sensor, in units of g and rad (datasheets: 20–80 mg, 1–4 %, 1–2 % cross axis),
in the order of the parameters."""
TYPICAL_NOISE = 1e-3
"""How far repeated holds differ, in units of g: 0.1 mg on a table to 1 mg by hand."""
SPARE_DIRECTIONS = 2
"""For a model with angles: one to leave out and one to contradict what is left. Bias and scale
alone need none: six faces are the classic minimum, and nothing judges them then."""
ANGLES = {4: "theta_yz", 5: "theta_zy", 7: "theta_zx"}
"""Name of the angle that each off-diagonal place holds."""
EDGES_OF = {4: "x and y", 5: "x and z", 7: "y and z"}
"""Between which faces the edges are that show an angle when they are on top."""


@dataclass(frozen=True, eq=False)
class Identifiable:
    """What these directions determine.

    Attributes:
        basis: free directions of the nine parameters, shape (9, p).
        places: which parameters are free on their own.
        terms: the terms of the model, in order.
        dropped: names of parameters left at their nominal value.
        reason: why, in one sentence, or "".
        spare: directions left over.
    """

    basis: FloatArray
    places: tuple[int, ...]
    terms: tuple[str, ...]
    dropped: tuple[str, ...]
    reason: str
    spare: int


def design(up: FloatArray) -> FloatArray:
    """Radial effect of each parameter at each direction, ordered as the parameters, (n, 9)."""
    x, y, z = up[:, 0], up[:, 1], up[:, 2]
    return np.column_stack([x, y, z, x * x, x * y, x * z, y * y, y * z, z * z])


def amplification(directions: FloatArray, basis: FloatArray) -> FloatArray:
    """What the noise of a hold becomes all over the sphere, as a factor, shape (400,).

    ``sqrt(j(u)ᵀ (XᵀX)⁻¹ j(u))``; infinite where the directions do not determine the parameters.

    Args:
        directions: unit vectors, shape (n, 3).
        basis: free directions of the parameters, shape (9, p).
    """
    rows = design(directions) @ basis
    _, values, axes = np.linalg.svd(rows, full_matrices=False)
    if len(rows) < rows.shape[1] or values[-1] < 1e-9 * values[0]:
        return np.full(len(_SPHERE), np.inf)
    everywhere = design(_SPHERE) @ basis @ axes.T / values
    return np.asarray(np.sqrt((everywhere**2).sum(axis=1)))


def expected_error(directions: FloatArray, basis: FloatArray, noise: float) -> float:
    """E of a model, rms over the sphere, in units of g; infinite when it is not determined.

    Args:
        directions: unit vectors, shape (n, 3).
        basis: free directions of the parameters, shape (9, p).
        noise: σ, in units of g.
    """
    return _expected_error(design(directions), basis, noise)


def _expected_error(columns: FloatArray, basis: FloatArray, noise: float) -> float:
    """The same of the radial effects at the directions, shape (n, 9)."""
    rows = columns @ basis
    left, values, axes = np.linalg.svd(rows, full_matrices=False)
    if len(rows) < rows.shape[1] or values[-1] < 1e-9 * values[0]:
        return np.inf
    spread = basis @ (axes.T / values)
    kept = _SPHERE_ROOT @ (np.eye(SIZE) - spread @ (left.T @ columns)) * TYPICAL_SIZE
    return float(np.sqrt(((noise * _SPHERE_ROOT @ spread) ** 2).sum() + (kept**2).sum()))


_SPHERE = even_directions(400)
_SPHERE_ROOT = np.linalg.qr(design(_SPHERE), mode="r") / np.sqrt(len(_SPHERE))
"""R with ``|R v|²`` the mean square of ``j(u)·v`` over the sphere, shape (9, 9)."""
UNCALIBRATED = float(np.linalg.norm(_SPHERE_ROOT * TYPICAL_SIZE))
"""What a sensor errs without calibration, rms over the sphere, in units of g."""


def basis_of(places: tuple[int, ...], common_scale: bool = False) -> FloatArray:
    """Columns that free single parameters, and one that moves the three scales together."""
    columns = np.zeros((SIZE, len(places) + common_scale))
    columns[places, range(len(places))] = 1.0
    if common_scale:
        columns[SCALE, -1] = 1.0 / np.sqrt(3.0)
    return columns


@cache
def _least_error(places: tuple[int, ...], common_scale: bool) -> float:
    """E of a model whose free parameters make up for the others as well as any directions let."""
    free, _ = np.linalg.qr(_SPHERE_ROOT @ basis_of(places, common_scale))
    left = _SPHERE_ROOT * TYPICAL_SIZE
    return float(np.linalg.norm(left - free @ (free.T @ left)))


def identifiable(directions: FloatArray, noise: float = TYPICAL_NOISE) -> Identifiable:
    """The best model that these distinct directions, shape (n, 3), determine.

    Args:
        directions: unit vectors.
        noise: of a hold, in units of g, where it is larger than usual.

    Raises:
        DataError: none is better than no calibration.
    """
    level, columns = max(noise, TYPICAL_NOISE), design(directions)
    best, least = None, UNCALIBRATED
    for model in _models(len(directions)):
        if _least_error(*model) < least:
            error = _expected_error(columns, basis_of(*model), level)
            best, least = (model, error) if error < least else (best, least)
    if best is not None:
        return _carried(directions, *best)
    found, missing = plural(len(directions), "distinct still position"), _missing(directions)
    enough = len(directions) >= len(BIAS) + len(SCALE) and missing
    why = f"none of them with {missing} up" if enough else "too few for bias and one scale"
    raise DataError(f"{found} found, {why}. Hold the device still with each of its six faces up")


def _missing(directions: FloatArray) -> str:
    """The faces that are the uppermost one in no direction: ``+x, −z``; "" where all were."""
    axis = np.abs(directions).argmax(axis=1)
    largest = np.take_along_axis(directions, axis[:, None], axis=1)[:, 0]
    up = {(k, value > 0.0) for k, value in zip(axis.tolist(), largest.tolist(), strict=True)}
    faces = [(k, positive) for k in range(3) for positive in (True, False)]
    return ", ".join(
        f"{'+' if face[1] else '−'}{'xyz'[face[0]]}" for face in faces if face not in up
    )


def _models(directions: int) -> Iterator[tuple[tuple[int, ...], bool]]:
    """Models that so many directions may determine: free places, and whether the scale is common.

    Scales come before angles, since axes differ in scale by more than they are out of square.
    """
    spare = directions - len(BIAS) - len(SCALE) - SPARE_DIRECTIONS
    for count in range(min(len(NON_ORTHOGONALITY), spare), 0, -1):
        for angles in itertools.combinations(NON_ORTHOGONALITY, count):
            yield (*BIAS, *SCALE, *angles), False
    yield (*BIAS, *SCALE), False
    yield BIAS, True


LEAST_SHOWN = 0.1
"""Least singular value of the radial effects by which the directions are said to determine a
parameter, in units of the parameter: a hundred times what a hold's noise moves it by."""
SMALLEST_MODE = 1e-9
"""Length of an error mode, in units of g and rad, below which it is rounding."""


def undetermined_modes(up: FloatArray, basis: FloatArray) -> FloatArray:
    """Error modes of what a fit leaves at its nominal value, in units of g and rad, shape (9, k).

    Each is a parameter of usual size together with the shift that it causes in the fitted
    parameters at these directions.

    Args:
        up: unit vectors, shape (n, 3).
        basis: free directions of the nine parameters, shape (9, p).
    """
    columns = design(up)
    taken = basis @ np.linalg.pinv(columns @ basis) @ columns
    modes = (np.eye(SIZE) - taken) * TYPICAL_SIZE
    return np.asarray(modes[:, np.linalg.norm(modes, axis=0) > SMALLEST_MODE])


def _carried(directions: FloatArray, places: tuple[int, ...], common: bool) -> Identifiable:
    count, columns = len(directions), design(directions)
    free = [*BIAS, *SCALE, *(place for place in places if place in NON_ORTHOGONALITY)]
    left = [place for place in NON_ORTHOGONALITY if place not in places]
    shown = {
        place: np.linalg.matrix_rank(columns[:, [*free, place]], LEAST_SHOWN) > len(free)
        for place in left
    }
    unknown = [ANGLES[place] for place in left if common or not shown[place]]
    unjudged = [ANGLES[place] for place in left if not common and shown[place]]
    used = "nominal angles and one scale" if common else "nominal values"
    reasons = []
    if common:
        names = ", ".join((*unknown, "a scale of its own for each axis"))
        faces = _missing(directions) or "other faces"
        reasons.append(f"do not determine {names}: {used} are used. Add holds with {faces} up")
    elif unknown:
        pairs = "; ".join(EDGES_OF[place] for place in left if not shown[place])
        reasons.append(
            f"do not determine {', '.join(unknown)}: {used} are used. "
            f"Add holds with the edges between these faces on top: {pairs}"
        )
    if unjudged:
        more = plural(SIZE + SPARE_DIRECTIONS - count, "direction")
        reasons.append(
            f"leave nothing to judge {', '.join(unjudged)} by: {used} are used. Add {more}"
        )
    reason = ". They ".join(reasons)
    reason = f"{count} directions {reason}" if reason else ""
    angles = len(left) < len(NON_ORTHOGONALITY)
    terms = ("bias", "scale", *(("non-orthogonality",) if angles else ()))
    basis = basis_of(places, common)
    dropped = tuple(ANGLES[place] for place in left)
    return Identifiable(basis, places, terms, dropped, reason, count - basis.shape[1])
