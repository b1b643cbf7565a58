"""Sensors that start, stop and pause at times of their own."""

import traceback
from dataclasses import replace
from typing import cast

import numpy as np

from benchmarks.attacks import Outcome
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.estimate.recording import fit_readings
from tests.calibrate.collecting import recording

NUMBER = 7
ATTACK = "recordings whose sensors start, stop and pause on their own"

FULL_TRIES, FEW_TRIES = 400, 5


def run(full: bool) -> Outcome:
    """Fit recordings of which each sensor lacks parts."""
    rng = np.random.default_rng(7)
    outcome, fitted = Outcome(), 0
    for _ in range(FULL_TRIES if full else FEW_TRIES):
        readings = _with_gaps(rng)
        try:
            fit_readings(readings)
            fitted += 1
            outcome.count("")
        except ImucalError as refusal:
            outcome.count("" if len(str(refusal).split()) > 5 else f"says only {refusal}")
        except Exception as error:  # noqa: BLE001 - any other error is what this looks for
            place = traceback.extract_tb(error.__traceback__)[-1]
            outcome.count(f"{type(error).__name__} in {place.name}, line {place.lineno}: {error}")
    outcome.notes.append(f"{fitted} fitted, {outcome.survived - fitted} refused with the reason")
    return outcome


def _with_gaps(rng: np.random.Generator) -> Readings:
    whole = recording()
    return replace(
        whole,
        accelerometer=_present(whole.accelerometer, rng),
        gyroscope=_present(cast("Series", whole.gyroscope), rng),
        magnetometer=_present(cast("Series", whole.magnetometer), rng),
    )


def _present(series: Series, rng: np.random.Generator) -> Series:
    """The samples from a random start to a random stop, without up to two pauses."""
    share = (series.time - series.time[0]) / np.ptp(series.time)
    start, stop = np.sort(rng.uniform(0.0, 1.0, 2))
    if rng.random() < 0.5:  # half of the sensors lack little
        start, stop = 0.2 * start, 1.0 - 0.2 * (1.0 - stop)
    keep = (share >= start) & (share <= stop)
    for begin in rng.uniform(0.0, 1.0, rng.integers(0, 3)):
        keep &= (share < begin) | (share > begin + rng.uniform(0.0, 0.2))
    return Series(series.time[keep], series.values[keep], series.unit)
