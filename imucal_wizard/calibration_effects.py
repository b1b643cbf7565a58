"""The effects of a saved model: sizes, and what they are told from, so that they can be applied."""

from collections.abc import Sequence
from dataclasses import replace

import msgspec
import numpy as np

from imucal_wizard.digits import finite
from imucal_wizard.effects.catalogue import effect
from imucal_wizard.effects.effect import ACCELEROMETER, Circumstances, Effect
from imucal_wizard.errors import UsageError
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.result import Extended, corrected
from imucal_wizard.solver.extended.terms import Term


class SavedEffect(msgspec.Struct, frozen=True):
    """One effect: ``x = matrix · (reading − bias) − ε(x)`` with ``ε = Σ size · shape``.

    Attributes:
        term: its name.
        sensor: whose.
        equation: as it is written, sizes in ``unit``.
        parameters: names of the sizes.
        sizes: in ``unit``.
        unit: of the first size.
        variant: setting of what is not linear in it.
        reference_temperature: °C at which an effect of the temperature is zero.
        reference_time: s after the session's first sample at which a drift is zero.
    """

    term: str
    sensor: str
    equation: str
    parameters: list[str]
    sizes: list[float]
    unit: str
    variant: float | None = None
    reference_temperature: float | None = None
    reference_time: float | None = None


def saved_effects(model: Extended, where: Circumstances) -> list[SavedEffect]:
    """The effects of a model, in their order.

    Args:
        model: the fit.
        where: the circumstances that it was fitted under.
    """
    sensor = model.fit.sensor
    found = []
    for term, sizes in zip(model.terms, model.sizes, strict=True):
        parameters = term.effect.parameters(sensor)
        found.append(
            SavedEffect(
                term=term.name,
                sensor=sensor,
                equation=term.effect.equation,
                parameters=[one.name for one in parameters],
                sizes=sizes.tolist(),
                unit=parameters[0].unit,
                variant=term.variant,
                reference_temperature=finite(where.reference_temperature),
                reference_time=finite(where.reference_time),
            )
        )
    return found


def apply_effects(
    effects: Sequence[SavedEffect],
    calibration: tuple[FloatArray, FloatArray],
    readings: FloatArray,
    where: Circumstances | None,
    own: Sequence[Effect] = (),
) -> FloatArray:
    """Corrected vectors, SI, shape (n, 3).

    Args:
        effects: of one sensor.
        calibration: matrix and bias.
        readings: in the bias's unit, shape (n, 3).
        where: the circumstances of each reading; None where the effects follow the reading alone.
        own: effects of the user's own that the model has.

    Raises:
        UsageError: an effect is not known here, or follows what was not given.
    """
    sensor = effects[0].sensor
    terms = [Term(effect(one.term, own), one.variant) for one in effects]
    if where is None:
        where = _of_readings_alone(sensor, terms, len(readings))
    first = effects[0]
    where = replace(
        where,
        reference_temperature=_or_nan(first.reference_temperature),
        reference_time=_or_nan(first.reference_time),
    )
    sizes = [np.array(one.sizes) for one in effects]
    return corrected(sensor, calibration, terms, sizes, readings, where)


def _of_readings_alone(sensor: str, terms: Sequence[Term], count: int) -> Circumstances:
    """Circumstances that nothing is known of but the reading itself."""
    alone = ("input", "force") if sensor == ACCELEROMETER else ("input",)
    for term in terms:
        if term.effect.against not in alone:
            raise UsageError(
                f"{term.name} follows the {term.effect.against}: give the circumstances of each "
                "reading too"
            )
    unknown, nothing = np.full(count, np.nan), np.zeros((count, 3))
    return Circumstances(nothing, nothing, unknown, np.zeros(count), nothing, np.zeros(count))


def _or_nan(value: float | None) -> float:
    return np.nan if value is None else value
