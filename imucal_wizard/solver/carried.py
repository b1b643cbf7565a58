"""Which parameters the still positions carry: decided from their directions before any fit.

At rest a calibration error shows only along the reading, as ``u·e(u)``: bias gives ``u``, scale the
squares ``u_i²``, non-orthogonality the products ``u_i u_j``. From the distinct directions alone
follows how a hold's noise is amplified in the worst orientation anywhere on the sphere,

    A = max_u sqrt( j(u)ᵀ (XᵀX)⁻¹ j(u) )

(the G-criterion of optimal design). The largest set of parameters is taken whose A is bounded and
which leaves directions over to contradict it; a scale per axis comes before any angle, since axes
differ in scale by more than they are out of square.
"""

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.magnitude import BIAS, NON_ORTHOGONALITY, SCALE, SIZE

MAX_AMPLIFICATION = 5.0
"""Uncalibrated sensors err by 10–50 mg and repeated holds differ by up to about 1 mg, so that five
times the latter still beats no calibration in every orientation; 18 poses have 0.8."""
SPARE_DIRECTIONS = 2
"""One to leave out and one to contradict what is left. Bias and scale alone need none: six faces
are the classic minimum, and nothing judges them then."""
ANGLES = {4: "theta_yz", 5: "theta_zy", 7: "theta_zx"}
"""Name of the angle that each off-diagonal place holds."""


@dataclass(frozen=True, eq=False)
class Carried:
    """What these directions carry.

    Attributes:
        basis: free directions of the nine parameters, shape (9, p).
        places: which parameters are free on their own.
        terms: the terms of the model, in order.
        dropped: names of parameters left at their nominal value.
        reason: why, in one sentence, or "".
        amplification: A of the model chosen.
        spare: directions left over.
    """

    basis: FloatArray
    places: tuple[int, ...]
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
    for candidates in _models(len(directions)):
        grown = {model: amplification(directions, basis_of(*model)) for model in candidates}
        best = min(grown, key=lambda model: grown[model], default=None)
        if best is not None and grown[best] <= MAX_AMPLIFICATION:
            return _carried(directions, *best)
    raise DataError(
        f"{len(directions)} distinct still position{'s' * (len(directions) != 1)} found; they do "
        "not carry even bias and one scale. Hold the device still with each of its six faces up"
    )


def _models(directions: int) -> Iterator[list[tuple[tuple[int, ...], bool]]]:
    """Models from the largest to the smallest, those of one size together.

    Each is the places that are free and whether one scale is common to all axes.
    """
    spare = directions - len(BIAS) - len(SCALE) - SPARE_DIRECTIONS
    for count in range(min(len(NON_ORTHOGONALITY), spare), 0, -1):
        chosen = itertools.combinations(NON_ORTHOGONALITY, count)
        yield [((*BIAS, *SCALE, *angles), False) for angles in chosen]
    yield [((*BIAS, *SCALE), False)]
    yield [(BIAS, True)]


def _carried(directions: FloatArray, places: tuple[int, ...], common: bool) -> Carried:
    basis = basis_of(places, common)
    left = [place for place in NON_ORTHOGONALITY if place not in places]
    dropped = tuple(ANGLES[place] for place in left)
    names = [*dropped, *(["a scale of its own for each axis"] if common else [])]
    count = len(directions)
    reason = ""
    if names:
        reason = (
            f"{count} directions do not carry {', '.join(names)}: left at the nominal value. "
            f"{_advice(left)}"
        )
    angles = len(left) < len(NON_ORTHOGONALITY)
    terms = ("bias", "scale", *(("non-orthogonality",) if angles else ()))
    spare = count - basis.shape[1]
    return Carried(basis, places, terms, dropped, reason, amplification(directions, basis), spare)


EDGES_OF = {4: "x and y", 5: "x and z", 7: "y and z"}
"""Between which faces the edges are that show an angle when they are on top."""


def _advice(left: list[int]) -> str:
    pairs = "; ".join(EDGES_OF[place] for place in left)
    return f"Add holds with the edges between these faces on top: {pairs}"
