"""Everything measured of an accelerometer: holds, their noise and circumstances."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.errors import UsageError
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.readings import FloatArray, IntArray, Readings
from imucal_wizard.solver.carried import Carried, basis_of
from imucal_wizard.solver.extended.surroundings import circumstances_of, visits
from imucal_wizard.solver.magnitude import BIAS, NON_ORTHOGONALITY, SCALE, triangle
from imucal_wizard.solver.noise import hold_noise
from imucal_wizard.solver.start import sphere
from imucal_wizard.solver.task import Task, make_task, up_directions
from imucal_wizard.units import COUNT

BASE = ("bias", "scale", "non-orthogonality")
PLACES = dict(zip(BASE, (BIAS, SCALE, NON_ORTHOGONALITY), strict=True))
SMALLEST_NOISE = 1e-7
"""Of gravity; no average is better, and data without any noise keep a weight."""


@dataclass(frozen=True, eq=False)
class HoldData:
    """What is known of an accelerometer.

    Attributes:
        holds: still periods in the order of time, n of them.
        gravity: m/s².
        unit: of the readings, ``m/s^2`` or ``count``.
        task: the fit of the base model: readings made dimensionless, what they carry, directions.
        full: parameters of the whole base model, shape (9,).
        noise: variance of each hold's error by the noise within holds alone, (m/s²)², shape (n,).
        circumstances: of each hold.
        visits: number of the rest that each hold is a piece of, shape (n,).
        scatter: standard deviation of what comes on top of that noise from hold to hold, m/s²;
            None has it estimated from what the fit leaves.
    """

    holds: tuple[Hold, ...]
    gravity: float
    unit: str
    task: Task
    full: FloatArray
    noise: FloatArray
    circumstances: Circumstances
    visits: IntArray
    scatter: float | None = None

    def nominal(self) -> FloatArray:
        """Parameters of a sensor without errors, shape (9,); of counts, the sphere nearest."""
        problem = self.task.problem
        if self.unit == COUNT:
            return sphere(problem)
        theta = np.zeros(9)
        theta[:3] = -problem.centre / problem.span
        theta[list(SCALE)] = problem.span / problem.magnitude
        return theta

    def basis(self, base: Sequence[str]) -> FloatArray:
        """Free directions of the nine parameters: of ``base`` what the holds carry, (9, p)."""
        carried = self.task.carried
        places = {place for term in base for place in PLACES[term]}
        if places.issuperset(range(9)):
            return carried.basis
        free = tuple(place for place in carried.places if place in places)
        common = "scale" in base and not set(carried.places) & set(SCALE)
        return basis_of(free, common) if free or common else np.zeros((9, 0))


def hold_data(
    holds: Sequence[Hold],
    gravity: float,
    unit: str,
    readings: Readings | None = None,
    scatter: float | None = None,
) -> HoldData:
    """All that is known of an accelerometer from its holds.

    Args:
        holds: still periods, in the order of time.
        gravity: local gravity, m/s².
        unit: of the readings.
        readings: what the holds were found in: beginning of the session, vibration.
        scatter: see ``HoldData``.

    Raises:
        DataError: the holds do not carry a calibration.
    """
    task = make_task(holds, gravity, "least_squares")
    full = task.solve().theta
    gain = float(np.linalg.norm(triangle(full), ord=2)) * gravity / task.problem.span
    noise = hold_noise(holds).accelerometer * gain**2
    up = up_directions(full, task.problem.points)
    return HoldData(
        holds=tuple(holds),
        gravity=gravity,
        unit=unit,
        task=task,
        full=full,
        noise=np.maximum(noise, (SMALLEST_NOISE * gravity) ** 2),
        circumstances=circumstances_of(holds, up, gravity, gain, readings),
        visits=visits(holds, up),
        scatter=scatter,
    )


def checked_base(base: Sequence[str], whole: Sequence[str] = BASE) -> tuple[str, ...]:
    """The terms of a base model that were asked for, in their usual order.

    Args:
        base: as asked for.
        whole: all terms of the sensor's base model.

    Raises:
        UsageError: one of them is none.
    """
    unknown = [term for term in base if term not in whole]
    if unknown:
        raise UsageError(f"{unknown[0]!r} is not in the base; it has {', '.join(whole)}")
    return tuple(term for term in whole if term in base)


def carried_base(carried: Carried, base: Sequence[str]) -> tuple[str, ...]:
    """Of the base terms asked for, those the holds carry."""
    return tuple(term for term in base if term in carried.terms)
