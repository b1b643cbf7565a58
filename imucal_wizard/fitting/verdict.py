"""The fit in plain sentences, the most important first: each says what it compares with what.

An error of the fit and one of what was left out lie on either side of the truth: with leverage h
the noise σ shows as ``σ √(1 − h)`` in the one and as ``σ / √(1 − h)`` in the other. Their geometric
mean is σ whatever the number of parameters, and is what is held against the floors.
"""

import numpy as np

from imucal_wizard.digits import decimals, fixed
from imucal_wizard.solver.fisher import exceeded
from imucal_wizard.solver.result import FitReport, SensorFit
from imucal_wizard.units import STANDARD_GRAVITY

ABOUT = 2.0
"""Up to so many times the noise within the holds an error is "about what the noise makes": that
noise is known to a fifth, and slow noise is seen but in part within a hold."""
ABOUT_FIELD = 1.5
"""The same of a magnetometer: the noise of thousands of samples is known well, but where a sensor
filters them it looks smaller; beyond, the model lacks more than a sample's noise everywhere."""
FEW_RATIO = 3.0
"""Held-out error against the fitted one beyond which there are too few data to predict any: with
twice as many equations as unknowns the ratio is about two."""
WORSE = 3.0
"""New poses that err so many times more than those left out: in four poses chance makes twice."""
ENOUGH_REPEATS = 4
"""Degrees of freedom from which the scatter of repeats is a better floor than the noise."""
UNLIKELY = 0.01
"""A misfit this rare by the scatter of the repeats is the model's."""


def verdict(report: FitReport) -> tuple[str, ...]:
    """What the user should know, a sentence each."""
    sentences = []
    for name, fit in report.sensors.items():
        sentences.append(_judged(name, fit))
    if "gyroscope" not in report.sensors and report.rates.get("gyroscope"):
        sentences.append("gyroscope: not calibrated")
    return tuple(sentences)


def shown(fit: SensorFit, value: float | None) -> str:
    """An error of this sensor in the unit people read: mg, degrees, µT or counts."""
    if value is None:
        return "not known"
    if fit.unit == "rad":
        return f"{_fine(np.degrees(value), 2)}°"
    if fit.unit == "rad/s":
        return f"{_fine(np.degrees(value), 3)} °/s"
    if fit.sensor == "magnetometer":
        unit = "µT" if fit.unit == "uT" else fit.unit
        return f"{fixed(value, min(decimals(value, 3), 3))} {unit}"
    return f"{_fine(value / STANDARD_GRAVITY * 1000.0, 2)} mg"


def _fine(value: float, least: int) -> str:
    """At least so many decimals, and one more where it takes that to see two digits."""
    return fixed(value, min(max(decimals(value), least), least + 1))


def _judged(name: str, fit: SensorFit) -> str:
    before = "" if fit.rms_before is None else f"{shown(fit, fit.rms_before)} before, "
    text = f"{name}: {before}{shown(fit, fit.rms_fitted)} after"
    if fit.rms_held_out is None:
        return f"{text}; {_unchecked(fit)}"
    text += f", {shown(fit, fit.rms_held_out)} on {_left_out(fit)}s left out"
    if fit.validation_rms is not None:
        text += f", {shown(fit, fit.validation_rms)} on {_new_poses(fit)}"
    if fit.suspects:
        one = "hold" if fit.sensor == "accelerometer" else "rotation"
        return f"{text}: one {one} does not fit with the others; measure it again"
    if fit.rms_held_out > FEW_RATIO * fit.rms_fitted:
        return f"{text}: too few {_left_out(fit)}s to foretell one that is left out; add some"
    if _changed(fit):
        return (
            f"{text}: on new poses it errs more than all before lets expect. Something has changed "
            "since (warmth, a knock), or they were held less still: take them again"
        )
    if fit.sensor == "magnetometer" and not all(one.carried for one in fit.parameters):
        return (
            f"{text}, which say nothing of the soft iron that is left out: it errs elsewhere. Turn "
            "the device through a circle with each of its six faces up"
        )
    return f"{text}: {_against_floors(fit, fit.rms_held_out)}"


def _new_poses(fit: SensorFit) -> str:
    count = len(fit.validation)
    return f"your {count} new poses" if count > 1 else "your new pose"


def _changed(fit: SensorFit) -> bool:
    """Whether the validation errs far more than what was left out did."""
    if fit.validation_rms is None or fit.rms_held_out is None:
        return False
    return fit.validation_rms > WORSE * max(fit.rms_held_out, fit.floor or 0.0)


def _unchecked(fit: SensorFit) -> str:
    """Why nothing was held out, and what was not fitted all the same."""
    why = fit.not_held_out or f"no {_left_out(fit)} could be left out to check it"
    if not fit.unused:
        return why
    error = float(np.sqrt(np.mean(fit.residuals[list(fit.unused)] ** 2)))
    return f"{why}; on the {len(fit.unused)} holds it does not use it errs {shown(fit, error)}"


def _against_floors(fit: SensorFit, held_out: float) -> str:
    """The error against the noise, and against what repeats show where they are worse."""
    noise = fit.floor
    if not noise:
        return "the noise is not known, so nothing says whether that is all it can do"
    makes = f"what {_noise_of(fit)} makes ({shown(fit, noise)})"
    about = ABOUT_FIELD if fit.sensor == "magnetometer" else ABOUT
    if np.sqrt(fit.rms_fitted * held_out) <= about * noise:
        return f"about {makes}"
    repeats = fit.repeat_rms
    if repeats and repeats > noise and fit.repeat_degrees_of_freedom >= ENOUGH_REPEATS:
        return _against_repeats(fit, held_out, noise, repeats)
    ratio = held_out / noise
    text = f"{ratio:{'.2g' if ratio < 10.0 else '.0f'}} times {makes}. {_missing(fit)}"
    if fit.sensor == "accelerometer":
        text += ", or poses do not repeat better than that: hold some of them twice to tell"
    return text


def _noise_of(fit: SensorFit) -> str:
    """What makes the floor: a gyroscope is judged by directions, which have errors of their own."""
    return "the noise of rates and directions" if fit.sensor == "gyroscope" else "the noise"


def _missing(fit: SensorFit) -> str:
    what = "Something is missing in the model"
    if fit.sensor == "magnetometer":
        return f"{what}, or the field is not the same everywhere: repeat it one metre away"
    return (
        what if "non-orthogonality" in fit.model else f"{what}, its cross-axis gains to begin with"
    )


def _against_repeats(fit: SensorFit, held_out: float, noise: float, repeats: float) -> str:
    if lack_of_fit(fit) < UNLIKELY:
        return (
            f"{held_out / repeats:.1f} times what holds of one direction differ by "
            f"({shown(fit, repeats)}). {_missing(fit)}"
        )
    return (
        f"poses repeat to {shown(fit, repeats)}, where the noise makes {shown(fit, noise)}: "
        "between holds the device, its seat or its bias moved, and no model mends that"
    )


def lack_of_fit(fit: SensorFit) -> float:
    """Chance of a misfit this large if repeats showed all there is: the classic F test."""
    freedom, pure = fit.degrees_of_freedom, fit.repeat_degrees_of_freedom
    if fit.repeat_rms is None or freedom <= pure:
        return 1.0
    misfit = len(fit.residuals) * fit.rms_fitted**2 - pure * fit.repeat_rms**2
    return exceeded(misfit / (freedom - pure) / fit.repeat_rms**2, freedom - pure, pure)


def _left_out(fit: SensorFit) -> str:
    return "rotation" if fit.sensor == "gyroscope" and fit.unit == "rad" else "direction"
