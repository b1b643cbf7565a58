"""Samples without a number: left out, and the axis that lacks it is named."""

from collections.abc import Callable
from functools import partial

from imucal_wizard.acquire.intake import Intake

HEADER = b"t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s]\n"


def _fed(count: int, blank: Callable[[int], dict[int, str]]) -> Intake:
    """An intake after so many lines, some of their fields replaced."""
    intake = Intake()
    intake.feed(HEADER, 0.0)
    for number in range(count):
        fields = [f"{number / 100:.3f}", "0.1", "0.2", "9.81", "0.01", "0.02", "0.03"]
        fields[1:] = [f"{field}{(number * 7) % 10}" for field in fields[1:]]
        for place, text in blank(number).items():
            fields[place] = text
        intake.feed(",".join(fields).encode() + b"\n", number / 100)
    return intake


def _always(place: int, _number: int) -> dict[int, str]:
    return {place: "nan"}


def _notes(intake: Intake) -> str:
    return " ".join(intake.warnings)


def test_single_blanks_are_left_out_and_their_axis_is_named() -> None:
    intake = _fed(600, lambda number: {2: "nan"} if number % 50 == 0 else {})
    assert intake.problem == ""
    assert "for the accelerometer's y axis" in _notes(intake)
    assert intake.samples == 588


def test_an_axis_that_never_has_a_number_is_a_problem_that_says_what_to_do() -> None:
    for place, name in ((1, "the accelerometer's x axis"), (6, "the gyroscope's z axis")):
        intake = _fed(200, partial(_always, place))
        assert name in intake.problem
        assert "wiring" in intake.problem
        assert intake.samples == 0


def test_an_axis_that_fails_later_is_a_problem_until_it_is_back() -> None:
    def failing(number: int) -> dict[int, str]:
        return {4: "", 5: ""} if 300 <= number < 400 else {}

    assert "the gyroscope's x and y axes" in _fed(400, failing).problem
    assert _fed(401, failing).problem == ""
    assert "the gyroscope's x and y axes" in _notes(_fed(500, failing))


def test_the_worst_column_is_named_and_not_one_that_failed_once() -> None:
    def failing(number: int) -> dict[int, str]:
        return {1: "nan"} if number == 250 else {3: "nan"} if number > 300 else {}

    assert "accelerometer's z axis" in _fed(420, failing).problem
