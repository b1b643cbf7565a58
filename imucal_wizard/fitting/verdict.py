"""The fit in plain sentences, the most important first."""

import numpy as np

from imucal_wizard.solver.result import FitReport, SensorFit
from imucal_wizard.units import STANDARD_GRAVITY

MISSING_RATIO = 3.0
"""Held-out error against the noise floor beyond which the model is said to lack something."""


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
    if fit.floor and fit.rms_held_out > MISSING_RATIO * fit.floor:
        ratio = fit.rms_held_out / fit.floor
        return f"{text}: {ratio:.0f} times what the noise makes. Something is missing in the model"
    return f"{text}: about what the noise makes"


def _left_out(fit: SensorFit) -> str:
    return "direction" if fit.sensor == "accelerometer" else "rotation"
