"""The fit in plain sentences, the most important first."""

import numpy as np

from imucal_wizard.solver.result import FitReport, SensorFit
from imucal_wizard.units import STANDARD_GRAVITY

MISSING_RATIO = 3.0
"""Held-out error against the noise floor beyond which the model is said to lack something."""
FEW_RATIO = 3.0
"""Held-out error against the fitted one beyond which there are too few data to predict any: with
twice as many equations as unknowns the ratio is about two."""
ENOUGH_REPEATS = 4
"""Degrees of freedom from which the scatter of repeats is a better floor than the noise."""


def verdict(report: FitReport) -> tuple[str, ...]:
    """What the user should know, a sentence each."""
    sentences = []
    for name, fit in report.sensors.items():
        sentences.append(_judged(name, fit))
    if "gyroscope" not in report.sensors and report.rates.get("gyroscope"):
        sentences.append("gyroscope: not calibrated")
    return tuple(sentences)


def shown(fit: SensorFit, value: float | None) -> str:
    """An error of this sensor in the unit people read: mg, or degrees."""
    if value is None:
        return "not known"
    if fit.unit == "rad":
        return f"{np.degrees(value):.2f}°"
    return f"{value / STANDARD_GRAVITY * 1000.0:.2f} mg"


def _judged(name: str, fit: SensorFit) -> str:
    before = "" if fit.rms_before is None else f"{shown(fit, fit.rms_before)} before, "
    text = f"{name}: {before}{shown(fit, fit.rms_fitted)} after"
    if fit.rms_held_out is None:
        return f"{text}; no {_left_out(fit)} could be left out to check it"
    text += f", {shown(fit, fit.rms_held_out)} on {_left_out(fit)}s left out"
    if fit.suspects:
        one = "hold" if fit.sensor == "accelerometer" else "rotation"
        return f"{text}: one {one} does not fit with the others; measure it again"
    if fit.rms_held_out > FEW_RATIO * fit.rms_fitted:
        return f"{text}: too few {_left_out(fit)}s to foretell one that is left out; add some"
    floor = _floor(fit)
    if floor and fit.rms_held_out > MISSING_RATIO * floor:
        ratio = fit.rms_held_out / floor
        return f"{text}: {ratio:.0f} times what the noise makes. Something is missing in the model"
    return f"{text}: about what the noise makes"


def _floor(fit: SensorFit) -> float | None:
    """What does not repeat: noise within the holds, or what repeated holds show beyond it."""
    if fit.repeat_rms is None or fit.repeat_degrees_of_freedom < ENOUGH_REPEATS:
        return fit.floor
    return max(fit.repeat_rms, fit.floor or 0.0)


def _left_out(fit: SensorFit) -> str:
    return "direction" if fit.sensor == "accelerometer" else "rotation"
