"""The models tried so far with their errors: one sees the error fall, or only seem to.

A rung is kept only if data that the fit has not seen agree: other directions or rotations for an
effect of orientation, the later part of the session for an effect of time.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from imucal_wizard.bench.floors import Floors, Rounding, floors_of
from imucal_wizard.solver.extended.result import Extended


@dataclass(frozen=True)
class Rung:
    """One model and its errors, in the sensor's unit.

    Attributes:
        model: names of its terms, base first.
        added: the term that was added to the model below it, or None.
        rms_fitted: error on the data fitted.
        rms_held_out: error on directions or rotations left out; None where none can be.
        rms_late: error of the later part of the session under a fit of the earlier one, or None.
        floor: what is left by any model (of rotations: what the noise alone makes).
        floors: how that is known.
    """

    model: tuple[str, ...]
    added: str | None
    rms_fitted: float
    rms_held_out: float | None
    rms_late: float | None
    floor: float
    floors: Floors


def rung(extended: Extended, added: str | None = None, rounding: Rounding | None = None) -> Rung:
    """The rung of a fit.

    Args:
        extended: the fit.
        added: what was added to the model below it.
        rounding: of its readings, where they are known.
    """
    floors = floors_of(extended, rounding)
    return Rung(
        model=extended.model,
        added=added,
        rms_fitted=extended.rms_fitted,
        rms_held_out=extended.rms_held_out,
        rms_late=extended.rms_late,
        floor=floors.floor if extended.fit.unit != "rad" else extended.fit.floor or 0.0,
        floors=floors,
    )


def confirmed(below: Rung, above: Rung, of_time: bool) -> bool:
    """Whether data held out agree that the upper rung is better.

    Args:
        below: the model without the effect.
        above: the model with it.
        of_time: the effect follows time or temperature, so that early data must predict late ones.
    """
    pairs = [(below.rms_held_out, above.rms_held_out)]
    if of_time:
        pairs.append((below.rms_late, above.rms_late))
    known = [(old, new) for old, new in pairs if old is not None and new is not None]
    return bool(known) and all(new < old for old, new in known)


def noise_of(ladder: Sequence[Rung]) -> float:
    """What the noise alone makes, by the model that shows it most purely.

    Repeats are never exact: what a model lacks makes them differ, too, and noise does not depend on
    the model.
    """
    return min(rung.floor for rung in ladder)
