"""One road to every fit with effects, whatever the sensor."""

from collections.abc import Sequence

from imucal_wizard.solver.extended.accelerometer import fit_accelerometer_with
from imucal_wizard.solver.extended.hold_data import BASE, HoldData
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.terms import Term

Measured = HoldData


def fit_with(
    measured: Measured, terms: Sequence[Term] = (), base: Sequence[str] = BASE
) -> Extended:
    """The MAP fit of the base terms and effects asked for.

    Args:
        measured: see ``hold_data``.
        terms: the effects.
        base: terms of the base model that are fitted.

    Raises:
        DataError: the data do not carry it, or it does not converge.
        UsageError: a term or an effect that this sensor does not have.
    """
    return fit_accelerometer_with(measured, terms, base)
