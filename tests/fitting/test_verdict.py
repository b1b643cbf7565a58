"""The plain sentence about each sensor."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.fitting.verdict import shown, verdict
from imucal_wizard.solver.result import FitReport, SensorFit
from imucal_wizard.units import STANDARD_GRAVITY

MILLI_G = STANDARD_GRAVITY / 1000.0
FIT = SensorFit(
    sensor="accelerometer",
    model=("bias", "scale"),
    method="least_squares",
    frame="own",
    matrix=np.eye(3),
    bias=np.zeros(3),
    bias_unit="m/s^2",
    parameters=(),
    unit="m/s^2",
    rms_before=20.0 * MILLI_G,
    rms_fitted=0.2 * MILLI_G,
    rms_held_out=0.3 * MILLI_G,
    floor=0.2 * MILLI_G,
    residuals=np.zeros(18),
)


def _said(fit: SensorFit) -> str:
    report = FitReport(9.8, {"accelerometer": 100.0}, (), (), {fit.sensor: fit})
    (sentence,) = verdict(report)
    return sentence


def test_a_good_fit_is_told_as_such() -> None:
    """Before, after, left out, in mg."""
    assert _said(FIT) == (
        "accelerometer: 20.00 mg before, 0.20 mg after, 0.30 mg on directions left out: "
        "about what the noise makes"
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"floor": 0.05 * MILLI_G}, "6 times what the noise makes. Something is missing"),
        ({"rms_held_out": None}, "no direction could be left out"),
        ({"rms_held_out": 5.0 * MILLI_G}, "too few directions to foretell one"),
        ({"suspects": (3,), "floor": 0.01}, "one hold does not fit"),
        ({"rms_before": None}, "accelerometer: 0.20 mg after"),
        ({"floor": None}, "about what the noise makes"),
    ],
)
def test_what_is_wrong_is_said(changes: dict[str, object], words: str) -> None:
    """One thing, the one that decides."""
    assert words in _said(replace(FIT, **changes))  # type: ignore[arg-type] # fields by name


def test_repeats_are_a_better_floor_than_noise_when_there_are_enough() -> None:
    """Slow drift that repeats show is not missing physics; one repeat proves nothing."""
    quiet = replace(FIT, floor=0.05 * MILLI_G, repeat_rms=0.2 * MILLI_G)
    assert "Something is missing" in _said(replace(quiet, repeat_degrees_of_freedom=1))
    assert "about what the noise makes" in _said(replace(quiet, repeat_degrees_of_freedom=6))


def test_errors_are_shown_in_the_unit_people_read() -> None:
    """Milli-g and degrees."""
    assert shown(FIT, 1.5 * MILLI_G) == "1.50 mg"
    assert shown(replace(FIT, unit="rad"), np.radians(0.43)) == "0.43°"
    assert shown(FIT, None) == "not known"


def test_a_gyroscope_that_is_not_calibrated_is_not_forgotten() -> None:
    """It is there, and it has no result."""
    rates = {"accelerometer": 100.0, "gyroscope": 100.0}
    report = FitReport(9.8, rates, (), (), {"accelerometer": FIT})
    assert verdict(report)[1] == "gyroscope: not calibrated"
