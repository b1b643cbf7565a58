"""From simulated holds to what the bench judges, through the program's own fit."""

from dataclasses import replace

import numpy as np

from benchmarks.hidden.recording import Recorded
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.residuals import WhitenedResiduals, whitened_residuals
from imucal_wizard.estimate.accelerometer import AccelerometerExperiment, accelerometer_experiment
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.catalogue import effects_for
from imucal_wizard.model.effect import ACCELEROMETER


def measured_of(recorded: Recorded) -> AccelerometerExperiment:
    """All that the program knows of the holds; the session begins at 0 s."""
    data = accelerometer_experiment(recorded.holds, STANDARD_GRAVITY, "m/s^2")
    time = np.array([0.5 * (hold.start + hold.end) for hold in recorded.holds])
    around = replace(
        data.circumstances,
        time=time,
        reference_time=np.nan,
        history=(time, data.circumstances.temperature),
        vibration=recorded.vibration,
    )
    data.circumstances = around
    data.source = replace(
        data.source, circumstances=around, labels=replace(data.source.labels, time=time)
    )
    data.sources = (data.source,)
    return data


def left_over(
    measured: AccelerometerExperiment, found: SensorFit | None = None
) -> WhitenedResiduals:
    """What a fit leaves, that of the base model when none is given."""
    found = fit(measured) if found is None else found
    known = set(found.model)
    suspects = [
        effect
        for effect in effects_for(ACCELEROMETER)
        if effect.name not in known
        and effect.lacking(ACCELEROMETER, measured.circumstances) is None
    ]
    return whitened_residuals(found, suspects)
