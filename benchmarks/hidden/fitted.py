"""From simulated holds to what the bench judges, through the program's own fit."""

from dataclasses import replace

import numpy as np

from benchmarks.hidden.recording import Recorded
from imucal_wizard.bench.from_fit import misfit_of
from imucal_wizard.bench.misfit import Misfit
from imucal_wizard.effects.catalogue import effects_for
from imucal_wizard.effects.effect import ACCELEROMETER
from imucal_wizard.solver.extended.fit import fit_with
from imucal_wizard.solver.extended.hold_data import HoldData, hold_data
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.units import STANDARD_GRAVITY


def measured_of(recorded: Recorded) -> HoldData:
    """All that the program knows of the holds; the session begins at 0 s."""
    data = hold_data(recorded.holds, STANDARD_GRAVITY, "m/s^2")
    time = np.array([0.5 * (hold.start + hold.end) for hold in recorded.holds])
    around = replace(
        data.circumstances,
        time=time,
        reference_time=np.nan,
        vibration=recorded.vibration,
    )
    return replace(data, circumstances=around)


def left_over(measured: HoldData, fit: Extended | None = None) -> Misfit:
    """What a fit leaves, that of the base model when none is given."""
    fit = fit_with(measured) if fit is None else fit
    known = set(fit.model)
    suspects = [
        effect
        for effect in effects_for(ACCELEROMETER)
        if effect.name not in known
        and effect.lacking(ACCELEROMETER, measured.circumstances) is None
    ]
    return misfit_of(fit.linear, ACCELEROMETER, measured.circumstances, suspects)
