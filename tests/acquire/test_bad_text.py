"""Lines that are cut, lack columns or are no text: each gets a message that says what to do."""

import numpy as np

from imucal_wizard.acquire.detect import BAUDS, GarbageDetector
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.resolve import NEEDS_ACCELEROMETER
from imucal_wizard.acquire.setup import StreamSetup, named_columns
from imucal_wizard.run.link_health import LinkHealth
from tests.acquire.streams import HEADER, at_rest, contract, feed, printed, read, warned


def test_half_lines_are_counted_and_named() -> None:
    lines = contract(400).splitlines(keepends=True)
    lines[20::20] = [line[:25] + b"\r\n" for line in lines[20::20]]
    intake, _ = read(b"".join(lines))
    assert intake.malformed == 20
    assert any("cannot be read" in text for text in intake.warnings)


def test_what_was_thrown_away_is_not_called_lost_as_well() -> None:
    values = at_rest(1000)
    values[::15, 2] = np.nan
    text = warned(values)
    assert "have no number" in text
    assert "is missing" not in text
    cut = printed(at_rest(1000)).splitlines(keepends=True)
    for place in range(7, 1000, 20):
        cut[place] = cut[place][:30]
    intake, _ = read(HEADER + b"".join(cut))
    assert any("cannot be read" in text for text in intake.warnings)
    assert not any("is missing" in text for text in intake.warnings)


def test_a_missing_column_is_named() -> None:
    rows = printed(at_rest(100)[:, [0, 1, 3, 4, 5, 6]])
    intake, _ = read(b"t[s],ax[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s]\r\n" + rows)
    assert intake.needs == ("columns",)
    assert "ay is missing" in intake.warnings[0]


def test_a_magnetometer_alone_is_told_that_the_steps_need_gravity() -> None:
    """No column is asked for: all of them are known."""
    rows = printed(at_rest(100)[:, [0, 4, 5, 6]])
    intake, _ = read(b"t[s],mx[uT],my[uT],mz[uT]\r\n" + rows)
    assert intake.needs == NEEDS_ACCELEROMETER
    problem = LinkHealth().problem(intake, "")
    assert f"{problem[:1].upper()}{problem[1:]}." in " ".join(intake.warnings)
    assert "gravity is the reference" in intake.warnings[0]
    assert "from a recording" in intake.warnings[0]


def test_half_a_gyroscope_is_named_and_left_out() -> None:
    rows = printed(at_rest(100)[:, :6])
    intake, readings = read(b"t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s]\r\n" + rows)
    assert readings.gyroscope is None
    assert len(readings) == 100
    assert "gz is missing" in intake.warnings[0]


def test_the_wrong_speed_names_the_speeds_to_try() -> None:
    rng = np.random.default_rng(0)
    intake = Intake()
    intake.feed(rng.integers(0, 256, 3000, dtype=np.uint8).tobytes(), 0.0)
    assert "speed is probably wrong" in intake.problem
    assert all(str(baud) in intake.problem for baud in BAUDS)


def test_garbage_in_the_middle_is_a_problem_until_good_lines_come_again() -> None:
    rng = np.random.default_rng(0)
    noise = rng.integers(128, 256, 3000, dtype=np.uint8).tobytes()
    intake, _ = read(contract(200))
    feed(intake, noise)
    assert "not text" in intake.problem
    feed(intake, b"\n\n" + printed(at_rest(400)[200:]))
    assert intake.problem == ""
    assert intake.samples == 400


def test_a_device_that_prints_something_else_now_is_noticed() -> None:
    intake, _ = read(contract(200))
    feed(intake, b"1.0,2.0,3.0\r\n" * 80)
    assert "80 lines could not be read" in intake.problem


def test_lines_that_do_not_fit_the_chosen_columns_say_so() -> None:
    setup = StreamSetup(format="csv", columns=named_columns("ax[g],ay[g],az[g],gx,gy,gz"))
    intake, _ = read(b"0.1,0.2,0.9\r\n" * 100, setup)
    assert "none is csv with 6 columns" in intake.problem


def test_text_without_samples_says_what_to_print() -> None:
    intake, _ = read(b"hello, this is a device\r\n" * 100)
    assert "t[s],ax[m/s^2]" in intake.problem


def test_text_without_line_ends_says_so() -> None:
    garbage = GarbageDetector()
    for _ in range(600):
        garbage.feed(b"0.1,0.2,9.8 ")
    assert "line ends" in garbage.problem


def test_control_characters_of_a_device_are_not_shown() -> None:
    intake, _ = read(contract(60) + b"\x1b[2J\x1b]0;owned\x07\r\n")
    assert "\x1b" not in intake.preview.line
    assert "\x07" not in intake.preview.line
