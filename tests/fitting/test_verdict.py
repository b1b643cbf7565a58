"""The plain sentence about each sensor."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

from imucal_wizard.fitting.verdict import UNLIKELY, lack_of_fit, shown, verdict
from imucal_wizard.solver.result import FitReport, Parameter, SensorFit
from imucal_wizard.units import STANDARD_GRAVITY

MILLI_G = STANDARD_GRAVITY / 1000.0
FIT = SensorFit(
    sensor="accelerometer",
    model=("bias", "scale", "non-orthogonality"),
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
    """Before, after, left out, in mg; and the noise that it is held against."""
    assert _said(FIT) == (
        "accelerometer: 20.00 mg before, 0.20 mg after, 0.30 mg on directions left out: "
        "about what the noise makes (0.20 mg)"
    )


GYROSCOPE = replace(
    FIT,
    sensor="gyroscope",
    unit="rad",
    model=("bias", "scale", "non-orthogonality"),
    rms_before=None,
    rms_fitted=np.radians(0.4),
    rms_held_out=np.radians(0.5),
    floor=np.radians(0.1),
)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"floor": 0.05 * MILLI_G},
            "6 times what the noise makes (0.050 mg). Something is missing",
        ),
        ({"floor": 0.05 * MILLI_G}, "hold some of them twice to tell"),
        ({"rms_held_out": None}, "no direction could be left out"),
        ({"rms_held_out": None, "not_held_out": "there is one only"}, "after; there is one only"),
        ({"rms_held_out": 5.0 * MILLI_G}, "too few directions to foretell one"),
        ({"suspects": (3,), "floor": 0.01}, "one hold does not fit"),
        ({"rms_before": None}, "accelerometer: 0.20 mg after"),
        ({"floor": None}, "the noise is not known"),
        ({"floor": 0.0}, "the noise is not known"),
        (
            {"validation_rms": 0.4 * MILLI_G, "validation": (0.0,) * 4},
            "left out, 0.40 mg on your 4 new poses: about",
        ),
        (
            {"validation_rms": 1.2 * MILLI_G, "validation": (0.0,) * 4},
            "1.20 mg on your 4 new poses: on new poses it errs more than all before lets expect",
        ),
    ],
)
def test_what_is_wrong_is_said(changes: dict[str, object], words: str) -> None:
    """One thing, the one that decides."""
    assert words in _said(replace(FIT, **changes))  # type: ignore[arg-type] # fields by name


def test_a_gyroscope_is_held_against_the_noise_of_rates_and_directions() -> None:
    """Its floor has the accelerometer's errors in it; and it has no repeats to ask for."""
    assert _said(GYROSCOPE) == (
        "gyroscope: 0.40° after, 0.50° on rotations left out: 5 times what the noise of rates and "
        "directions makes (0.10°). Something is missing in the model"
    )


def test_a_model_without_cross_axis_gains_is_known_to_lack_them() -> None:
    """Of all that may be missing this is the first."""
    assert "cross-axis gains to begin with" in _said(replace(GYROSCOPE, model=("bias", "scale")))


FIELD = replace(
    FIT,
    sensor="magnetometer",
    unit="uT",
    model=("bias", "soft-iron"),
    parameters=(Parameter("soft_iron_xy", 0.01, 0.001, "1"),),
    rms_before=12.0,
    rms_fitted=0.62,
    rms_held_out=0.63,
    floor=0.6,
)


def test_a_magnetometer_that_errs_by_its_noise_again_lacks_something() -> None:
    """Noise and a misfit 1.4 times as large in every direction: 1.7 times the noise."""
    assert "about what the noise makes (0.6" in _said(FIELD)
    missing = _said(replace(FIELD, rms_fitted=1.03, rms_held_out=1.05))
    assert "1.8 times what the noise makes (0.6" in missing
    assert "repeat it one metre away" in missing


def test_directions_that_do_not_show_the_soft_iron_prove_nothing_about_it() -> None:
    """However well a model fits a few circles that leaves the soft iron at nothing."""
    left = (Parameter("soft_iron_xy", 0.0, None, "1", carried=False),)
    said = _said(replace(FIELD, parameters=left))
    assert "say nothing of the soft iron that is left out" in said
    assert "each of its six faces" in said
    assert "about what" not in said


def _repeating(repeats: float, freedom: int, held_out: float, fitted: float) -> SensorFit:
    return replace(
        FIT,
        residuals=np.zeros(36),
        degrees_of_freedom=27,
        rms_fitted=fitted * MILLI_G,
        rms_held_out=held_out * MILLI_G,
        floor=0.1 * MILLI_G,
        repeat_rms=repeats * MILLI_G,
        repeat_degrees_of_freedom=freedom,
    )


def test_poses_that_do_not_repeat_are_not_called_noise() -> None:
    """1.9 mg beside noise of 0.1 mg, and holds of one pose differ by as much: it moved."""
    said = _said(_repeating(1.9, 18, 1.86, 1.4))
    assert "poses repeat to 1.90 mg, where the noise makes 0.10 mg" in said
    assert "the device, its seat or its bias moved" in said
    assert "about what" not in said
    assert "Something is missing" not in said


def test_more_than_repeats_show_is_missing_in_the_model() -> None:
    """By the F test of the lack of fit, whose floor the sentence names."""
    said = _said(_repeating(0.3, 18, 1.86, 1.4))
    assert "6.2 times what holds of one direction differ by (0.30 mg). Something is missing" in said


def test_one_repeat_proves_nothing() -> None:
    """A single pair may agree or differ by chance."""
    assert "19 times what the noise makes" in _said(_repeating(1.9, 1, 1.86, 1.4))


def test_repeats_that_agree_by_chance_do_not_lower_the_floor() -> None:
    """What is within the noise is noise, however well a few repeats agree."""
    assert "about what the noise makes" in _said(_repeating(0.02, 4, 0.15, 0.1))


@pytest.mark.parametrize("pure", [6, 18])
def test_the_lack_of_fit_is_the_textbooks(pure: int) -> None:
    """Sum of squares less the pure error's, each over its degrees of freedom; F by SciPy."""
    fit = _repeating(0.3, pure, 1.0, 0.5)
    squares = 36 * 0.5**2 - pure * 0.3**2
    expected = stats.f.sf(squares / (27 - pure) / 0.3**2, 27 - pure, pure)
    assert lack_of_fit(fit) == pytest.approx(expected, rel=1e-9)


def test_noise_alone_is_called_missing_as_rarely_as_it_says() -> None:
    """Of 2,000 sets of noise about one in a hundred; without repeats none is called missing."""
    rng = np.random.default_rng(0)
    poses, repeats, parameters = 18, 18, 9
    alarms = 0
    for _ in range(2000):
        pure = rng.chisquare(repeats)
        rest = rng.chisquare(poses - parameters)
        fit = _repeating(np.sqrt(pure / repeats), repeats, 1.0, np.sqrt((pure + rest) / 36))
        alarms += lack_of_fit(fit) < UNLIKELY
    assert 7 <= alarms <= 36


def test_holds_that_the_method_does_not_use_are_held_out_as_they_are() -> None:
    """The six-position method errs on edges, which it never saw; that is said."""
    six = replace(
        FIT,
        rms_held_out=None,
        not_held_out="it needs all six faces",
        residuals=np.array([0.0, 0.0, 3.0, 4.0]) * MILLI_G,
        unused=(2, 3),
    )
    assert _said(six).endswith(
        "it needs all six faces; on the 2 holds it does not use it errs 3.54 mg"
    )


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


@pytest.mark.parametrize(
    ("sensor", "unit", "value", "text"),
    [
        ("accelerometer", "m/s^2", 36.38 * MILLI_G, "36.38 mg"),
        ("accelerometer", "m/s^2", 0.0744 * MILLI_G, "0.074 mg"),
        ("gyroscope", "rad", np.radians(0.0283), "0.028°"),
        ("gyroscope", "rad/s", np.radians(1.244), "1.244 °/s"),
        ("magnetometer", "uT", 0.4, "0.400 µT"),
        ("magnetometer", "count", 48496.0, "48496 count"),
    ],
)
def test_an_error_is_shown_so_that_methods_can_be_told_apart(
    sensor: str, unit: str, value: float, text: str
) -> None:
    """Two digits at the least: two errors of 0.03° may differ by half."""
    assert shown(replace(FIT, sensor=sensor, unit=unit), value) == text
