"""One word per sensor: the limits of use, and what makes a sensor doubtful or not usable."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.core.errors import ImucalError
from imucal_wizard.core.notices import Notice, NoticeKind, not_calibrated
from imucal_wizard.diagnose.grade import Grade, graded, read_limits
from imucal_wizard.diagnose.survey import diagnosis_of
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.fit_warnings import gyroscope_warnings
from imucal_wizard.estimate.gyroscope_report import GyroscopeReport
from imucal_wizard.estimate.result import FitReport, unchecked_scale, worse_than_none
from tests.diagnose.test_statement import benches
from tests.tui.fakes import diagnoses, report

GOOD = diagnoses(Verdict.COMPLETE)


def test_good_is_complete_and_within_the_limit() -> None:
    found = graded(report(), GOOD)
    assert {one.grade for one in found.values()} == {Grade.GOOD}
    assert found["accelerometer"].limit == pytest.approx(2e-3 * 9.80665)
    assert found["gyroscope"].limit == pytest.approx(math.radians(1.0))
    assert graded(report(), {}) == {}


@pytest.mark.parametrize("verdict", [one for one in Verdict if one is not Verdict.COMPLETE])
def test_any_other_verdict_is_doubtful_and_says_why(verdict: Verdict) -> None:
    one = graded(report(), diagnoses(verdict))["gyroscope"]
    assert one.grade is Grade.DOUBTFUL
    assert one.why


def test_an_error_above_the_limit_is_doubtful() -> None:
    one = graded(report(), GOOD, {"accelerometer": 1e-4, "gyroscope": 1.0})["accelerometer"]
    assert (one.grade, "above the limit of use, 0.010 mg" in one.why) == (Grade.DOUBTFUL, True)


def without(sensor: str) -> FitReport:
    """A report in which a sensor that was measured has no calibration."""
    known = report()
    sensors = {name: fit for name, fit in known.sensors.items() if name != sensor}
    return replace(known, sensors=sensors, warnings=(not_calibrated(sensor, "too few"),))


def test_a_sensor_without_a_calibration_is_not_usable() -> None:
    one = graded(without("gyroscope"), GOOD)["gyroscope"]
    assert (one.grade, one.grade.word) == (Grade.NOT_USABLE, "NOT USABLE")
    assert one.why == "the gyroscope is not calibrated: too few"


def test_the_reason_of_a_missing_calibration_comes_before_other_notes() -> None:
    known = without("gyroscope")
    clipped = "the gyroscope reaches the end of its range"
    one = graded(replace(known, warnings=(clipped, *known.warnings)), GOOD)["gyroscope"]
    assert one.why == "the gyroscope is not calibrated: too few"


def test_a_calibration_that_is_worse_than_none_is_not_usable() -> None:
    known = report()
    worse = replace(known.sensors["accelerometer"], rms_before=1e-4)
    found = graded(replace(known, sensors={**known.sensors, "accelerometer": worse}), GOOD)
    assert found["accelerometer"].grade is Grade.NOT_USABLE
    assert "worse than none" in found["accelerometer"].why


@pytest.mark.parametrize(("freedom", "usable"), [(0, True), (1, False), (20, True)])
def test_few_degrees_of_freedom_do_not_exclude_that_it_is_worse_than_none(
    freedom: int, usable: bool
) -> None:
    """Six faces that are seated to 30 mg leave 11 mg by chance; without any freedom, nothing.

    Six holds that determine six parameters are the usual calibration by six positions.
    """
    seven = "accelerometer", "m/s^2", "m/s^2", 0.3, 0.11, None, freedom, 6
    assert (worse_than_none(*seven) == "") is usable


def test_six_faces_that_are_seated_well_are_usable() -> None:
    assert not worse_than_none("accelerometer", "m/s^2", "m/s^2", 0.25, 0.002, None, 1, 6)


def test_a_gyroscope_with_another_clock_is_doubtful() -> None:
    said = Notice("its clock is 1.0 % fast", NoticeKind.CLOCKS, "gyroscope")
    known = replace(report(), warnings=(said,))
    found = graded(known, {name: replace(one, report=known) for name, one in GOOD.items()})
    assert found["accelerometer"].grade is Grade.GOOD
    assert found["gyroscope"].grade is Grade.DOUBTFUL
    assert "clock" in found["gyroscope"].why


def test_a_term_that_data_held_out_do_not_confirm_makes_a_sensor_doubtful() -> None:
    """The verdict is complete, and says that the term is to be taken out again."""
    made = benches()
    made.accelerometer.add("second-order")
    said = diagnosis_of(made, made.accelerometer)
    assert said.verdict is Verdict.COMPLETE
    one = graded(made.fitted(), {"accelerometer": said})["accelerometer"]
    assert one.grade is Grade.DOUBTFUL
    assert one.why == "data held out do not confirm second-order, which its model has"


def test_limits_are_read_from_a_file(tmp_path: Path) -> None:
    place = tmp_path / "limits.toml"
    place.write_text('grade = "industrial"\naccelerometer = "0.02 m/s^2"\ngyroscope = "0.5 °"\n')
    found = read_limits(place)
    expected = {"accelerometer": 0.02, "gyroscope": math.radians(0.5), "magnetometer": 0.2}
    assert found == pytest.approx(expected)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            "accelerometer = 2",
            "accelerometer = 2 is not a limit; write a number above zero and a unit",
        ),
        ('gyroscope = "1 mg"', "gyroscope = '1 mg' is not a limit"),
        ('magnetometer = "-1 uT"', "magnetometer = '-1 uT' is not a limit"),
        ('barometer = "1 Pa"', "there is no 'barometer'; the keys are grade, accelerometer"),
        ('grade = "toy"', "there is no grade 'toy'; give one of consumer, industrial, tactical"),
        ("grade = [", "is not TOML"),
        (None, "there is no such file"),
    ],
)
def test_a_file_that_holds_no_limits_is_refused(
    tmp_path: Path, text: str | None, says: str
) -> None:
    place = tmp_path / "limits.toml"
    if text is not None:
        place.write_text(text)
    with pytest.raises(ImucalError) as caught:
        read_limits(place)
    assert says in str(caught.value)
    assert "limits.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("scale", "freedom", "unit", "refused"),
    [
        (-58.7, 0, "rad/s", True),
        (1.3, 0, "rad/s", True),
        (1.05, 0, "rad/s", False),
        (57.3, 30, "rad/s", False),
        (2e-4, 0, "count", False),
    ],
)
def test_rotations_that_only_just_determine_an_absurd_scale_are_not_usable(
    scale: float, freedom: int, unit: str, refused: bool
) -> None:
    """Nothing checks them; with more rotations such a scale is a unit, which is warned of."""
    matrix = np.diag([1.0, scale, 1.0])
    said = unchecked_scale("rad", unit, matrix, freedom, None)
    assert ("no rotation is left to check" in said) == (freedom == 0 and unit != "count")
    assert ("no sensor has: do not apply it" in said) == refused
    assert not unchecked_scale("rad", unit, matrix, freedom, 0.001)


@pytest.mark.parametrize("factors", [(0.0101, 0.0101, 0.0101), (1.0, 1.5, 1.0)])
def test_a_scale_that_no_sensor_has_is_never_good(factors: tuple[float, ...]) -> None:
    """The fit is perfect and applies to readings of another unit or to other times."""
    known = report()
    fit = known.sensors["gyroscope"]
    wrong = replace(fit, matrix=fit.matrix * factors)
    one = graded(replace(known, sensors={"gyroscope": wrong}), GOOD)["gyroscope"]
    assert one.grade is Grade.DOUBTFUL
    assert "is impossible: the unit" in one.why
    assert ("sampling rate" in one.why) == (len(set(factors)) == 1)
    counts = replace(wrong, bias_unit="count")
    found = graded(replace(known, sensors={"gyroscope": counts}), GOOD)["gyroscope"]
    assert found.grade is Grade.GOOD


def test_the_grade_and_the_warning_state_the_same_scale() -> None:
    """That of all axes, which differ from one another by some per cent."""
    known = report()
    fit = known.sensors["gyroscope"]
    wrong = replace(fit, matrix=np.diag([0.0173, 0.0178, 0.0175]))
    why = graded(replace(known, sensors={"gyroscope": wrong}), GOOD)["gyroscope"].why
    assert "its scale of about 0.018 is impossible:" in why
    (warned,) = gyroscope_warnings(GyroscopeReport(wrong, (), ()), "rad/s", 100.0)
    assert "scale comes out as about 0.018, which no sensor has" in warned
