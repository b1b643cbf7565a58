"""Which parameters the still positions carry: decided from their directions before any fit.

At rest a calibration error shows only along the reading, as ``u·e(u)``: bias gives ``u``, scale the
squares ``u_i²``, non-orthogonality the products ``u_i u_j``. From the distinct directions alone
follows how a hold's noise is amplified in the worst orientation anywhere on the sphere,

    A = max_u sqrt( j(u)ᵀ (XᵀX)⁻¹ j(u) )

(the G-criterion of optimal design). A set of parameters is carried when A is bounded and at least
two directions are left over to contradict it.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.magnitude import BIAS, NON_ORTHOGONALITY, SCALE, SIZE

MAX_AMPLIFICATION = 5.0
SPARE_DIRECTIONS = 2
ANGLES = {4: "theta_yz", 5: "theta_zy", 7: "theta_zx"}
"""Name of the angle that each off-diagonal place holds."""


@dataclass(frozen=True, eq=False)
class Carried:
    """What these directions carry.

    Attributes:
        basis: free directions of the nine parameters, shape (9, p).
        terms: the terms of the model, in order.
        dropped: names of parameters left at their nominal value.
        reason: why, in one sentence, or "".
        amplification: A of the model chosen.
        spare: directions left over.
    """

    basis: FloatArray
    terms: tuple[str, ...]
    dropped: tuple[str, ...]
    reason: str
    amplification: float
    spare: int


def design(up: FloatArray) -> FloatArray:
    """Radial effect of each parameter at each direction, ordered as the parameters, (n, 9)."""
    x, y, z = up[:, 0], up[:, 1], up[:, 2]
    return np.column_stack([x, y, z, x * x, x * y, x * z, y * y, y * z, z * z])


def amplification(directions: FloatArray, basis: FloatArray) -> float:
    """A of these directions, shape (n, 3), for the parameters that ``basis`` frees."""
    return float(np.sqrt(_variance_everywhere(directions, basis).max()))


def mean_amplification(directions: FloatArray, basis: FloatArray) -> float:
    """The same as rms over the sphere instead of its worst place."""
    return float(np.sqrt(_variance_everywhere(directions, basis).mean()))


def _variance_everywhere(directions: FloatArray, basis: FloatArray) -> FloatArray:
    """``j(u)ᵀ (XᵀX)⁻¹ j(u)`` at directions all over the sphere; infinite without full rank."""
    rows = design(directions) @ basis
    if len(rows) < rows.shape[1]:
        return np.array([np.inf])
    _, values, axes = np.linalg.svd(rows, full_matrices=False)
    if values[-1] < 1e-9 * values[0]:
        return np.array([np.inf])
    everywhere = design(_SPHERE) @ basis @ axes.T / values
    return np.asarray((everywhere**2).sum(axis=1))


def _sphere(count: int = 400) -> FloatArray:
    """Directions spread evenly over the sphere (Fibonacci lattice), shape (count, 3)."""
    index = np.arange(count) + 0.5
    z = 1.0 - 2.0 * index / count
    turn = np.pi * (1.0 + np.sqrt(5.0)) * index
    ring = np.sqrt(1.0 - z * z)
    return np.column_stack([ring * np.cos(turn), ring * np.sin(turn), z])


_SPHERE = _sphere()


def basis_of(places: tuple[int, ...], common_scale: bool = False) -> FloatArray:
    """Columns that free single parameters, and one that moves the three scales together."""
    columns = [np.eye(SIZE)[place] for place in places]
    if common_scale:
        columns.append(np.eye(SIZE)[list(SCALE)].sum(axis=0) / np.sqrt(3.0))
    return np.column_stack(columns)


def decide(directions: FloatArray) -> Carried:
    """The largest model that these distinct directions, shape (n, 3), carry.

    Raises:
        DataError: not even bias and one common scale.
    """
    angles = list(NON_ORTHOGONALITY)
    while angles:
        basis = basis_of((*BIAS, *SCALE, *angles))
        grown = amplification(directions, basis)
        spare = len(directions) - basis.shape[1]
        if grown <= MAX_AMPLIFICATION and spare >= SPARE_DIRECTIONS:
            return _carried(basis, directions, ("bias", "scale", "non-orthogonality"), angles)
        blind = _most_blind(directions, angles)
        if blind is None:
            break
        angles.remove(blind)
    for places, common, terms in (
        ((*BIAS, *SCALE), False, ("bias", "scale")),
        (BIAS, True, ("bias", "scale")),
    ):
        basis = basis_of(places, common)
        if amplification(directions, basis) <= MAX_AMPLIFICATION:
            return _carried(basis, directions, terms, [], common)
    raise DataError(
        f"{len(directions)} distinct still position{'s' * (len(directions) != 1)} found; they do "
        "not carry even bias and one scale. Hold the device still with each of its six faces up"
    )


def _most_blind(directions: FloatArray, angles: list[int]) -> int | None:
    """The angle these directions say least about, if the others would be better off without it."""
    worst = {}
    for angle in angles:
        others = [other for other in angles if other != angle]
        worst[angle] = amplification(directions, basis_of((*BIAS, *SCALE, *others)))
    best = min(worst, key=lambda angle: worst[angle])
    spare = len(directions) - len(BIAS) - len(SCALE) - len(angles) + 1
    return best if worst[best] < np.inf and spare >= SPARE_DIRECTIONS else None


def _carried(
    basis: FloatArray,
    directions: FloatArray,
    terms: tuple[str, ...],
    angles: list[int],
    common: bool = False,
) -> Carried:
    dropped = tuple(ANGLES[place] for place in NON_ORTHOGONALITY if place not in angles)
    names = [*dropped, *(["separate scales"] if common else [])]
    count = len(directions)
    reason = ""
    if names:
        reason = (
            f"{count} directions do not carry {', '.join(names)}: left at the nominal value. "
            "Add holds with edges up to determine it"
        )
    spare = count - basis.shape[1]
    return Carried(basis, terms, dropped, reason, amplification(directions, basis), spare)
