"""Everything bad that a stream can bring gets a message that says what to do."""

from collections.abc import Callable

import numpy as np
import pytest

from imucal_wizard.devices import checks
from imucal_wizard.devices.garbage import BAUDS, Garbage
from imucal_wizard.devices.intake import Intake, StreamSetup
from imucal_wizard.devices.setup import named_columns
from imucal_wizard.readings import FloatArray
from tests.devices.streams import HEADER, at_rest, contract, feed, printed, read


def warned(values: FloatArray, header: bytes = HEADER, form: str = "%.6f") -> str:
    """All warnings about a stream of these rows."""
    data = header + printed(values, form)
    intake = Intake(compare_arrivals=False)
    feed(intake, data)
    assert intake.samples > 0
    return " | ".join(intake.warnings)


def spoilt(change: Callable[[FloatArray], None], count: int = 1200) -> FloatArray:
    """A device at rest with one thing wrong."""
    values = at_rest(count)
    change(values)
    return values


def test_a_healthy_stream_gets_no_warning() -> None:
    assert warned(at_rest(3000)) == ""


def test_two_printed_decimals_are_named_with_their_step() -> None:
    text = warned(at_rest(300), form="%.2f")
    assert "accelerometer is printed in m/s^2 with 2 digits" in text
    assert "10 mm/s²" in text
    assert "gyroscope is printed in rad/s with 2 digits" in text
    assert "Serial.print(x, 5)" in text


@pytest.mark.parametrize(
    ("sensor", "unit", "decimals", "coarse"),
    [
        ("accelerometer", "m/s^2", 2, True),
        ("accelerometer", "m/s^2", 3, False),
        ("accelerometer", "g", 3, True),
        ("accelerometer", "g", 4, False),
        ("accelerometer", "mg", 0, True),
        ("accelerometer", "mg", 2, False),
        ("accelerometer", "count", 0, False),
        ("accelerometer", "g", -1, False),
        ("gyroscope", "deg/s", 0, True),
        ("gyroscope", "deg/s", 2, False),
        ("gyroscope", "rad/s", 2, True),
        ("gyroscope", "rad/s", 4, False),
    ],
)
def test_digits_are_judged_by_the_step_they_make(
    sensor: str, unit: str, decimals: int, coarse: bool
) -> None:
    assert bool(checks.too_few_digits(sensor, unit, decimals)) is coarse


def test_repeated_samples_are_noticed() -> None:
    def repeat(values: FloatArray) -> None:
        values[1::2, 1:7] = values[0::2, 1:7]

    assert "50% of the samples repeat" in warned(spoilt(repeat))


def test_values_that_never_change_are_noticed() -> None:
    def stop(values: FloatArray) -> None:
        values[:, 1:7] = values[0, 1:7]

    assert "No value changes at all" in warned(spoilt(stop))


def test_a_dead_axis_is_named() -> None:
    def kill(values: FloatArray) -> None:
        values[:, 2] = 0.0

    assert "accelerometer's y axis never changes" in warned(spoilt(kill))


def test_gravity_of_1000_in_the_wrong_unit_says_which_unit_it_is() -> None:
    def wrong(values: FloatArray) -> None:
        values[:, 1:4] *= 1000 / 9.80665

    text = warned(spoilt(wrong))
    assert "Gravity reads 99" in text
    assert "mg taken for m/s^2" in text


def test_linear_acceleration_is_recognised_as_useless() -> None:
    def float_away(values: FloatArray) -> None:
        values[:, 1:4] -= (0.1, -0.2, 9.8)

    assert "taken gravity out" in warned(spoilt(float_away))


def test_a_gyroscope_that_compensates_itself_is_recognised() -> None:
    def zero(values: FloatArray) -> None:
        values[:, 4:7] = 0.0

    text = warned(spoilt(zero))
    assert "reads exactly zero" in text
    assert "AMG" in text


def test_a_clipped_axis_is_named_with_its_limit() -> None:
    def clip(values: FloatArray) -> None:
        swing = 6 * np.sin(values[:, 0] * 3)
        values[:, 6] = np.clip(swing + values[:, 6], -4.36, 4.36)

    text = warned(spoilt(clip))
    assert "gyroscope's z axis stands at its limit" in text
    assert "4.36 rad/s" in text


def test_the_top_of_a_smooth_turn_in_coarse_steps_is_not_clipped() -> None:
    """Two printed decimals: the peak stands on one value, but comes there step by step."""

    def turn(values: FloatArray) -> None:
        values[:, 6] = np.round(2.2 * np.sin(values[:, 0] * 1.5), 2)

    text = warned(spoilt(turn))
    assert "stands at its limit" not in text


def test_counts_at_the_end_of_int16_are_clipped() -> None:
    columns = named_columns("ax[count],ay[count],az[count],gx[count],gy[count],gz[count]")
    rng = np.random.default_rng(0)
    values = np.round(rng.normal((0, 0, 16384, 0, 0, 0), 30, (600, 6)))
    values[300, 3] = 32767
    intake = Intake(StreamSetup(columns=columns, rate=100.0))
    feed(intake, printed(values, "%d"))
    assert any("gyroscope's x axis" in text for text in intake.warnings)


def test_nan_is_left_out_and_named() -> None:
    def gap(values: FloatArray) -> None:
        values[::20, 1] = np.nan

    text = warned(spoilt(gap))
    assert "NaN" in text
    assert "wiring" in text


def test_lost_samples_are_counted_and_named() -> None:
    values = np.delete(at_rest(1200), slice(None, None, 10), axis=0)
    assert "one sample in a hundred is missing" in warned(values)


def test_a_device_that_was_away_for_a_while_dropped_nothing() -> None:
    def leave(values: FloatArray) -> None:
        values[600:, 0] += 60.0

    intake = Intake()
    feed(intake, HEADER + printed(spoilt(leave)))
    assert intake.lost == 6000
    assert intake.warnings == ()


def test_half_lines_are_counted_and_named() -> None:
    lines = contract(400).splitlines(keepends=True)
    lines[20::20] = [line[:25] + b"\r\n" for line in lines[20::20]]
    intake, _ = read(b"".join(lines))
    assert intake.malformed == 20
    assert any("cannot be read" in text for text in intake.warnings)


def test_a_missing_column_is_named() -> None:
    rows = printed(at_rest(100)[:, [0, 1, 3, 4, 5, 6]])
    intake, _ = read(b"t[s],ax[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s]\r\n" + rows)
    assert intake.needs == ("columns",)
    assert "ay is missing" in intake.warnings[0]


def test_half_a_gyroscope_is_named_and_left_out() -> None:
    rows = printed(at_rest(100)[:, :6])
    intake, readings = read(b"t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s]\r\n" + rows)
    assert readings.gyroscope is None
    assert len(readings) == 100
    assert "gz is missing" in intake.warnings[0]


def test_a_restart_and_a_wrap_of_time_are_explained() -> None:
    restarted = at_rest(400)
    restarted[200:, 0] -= 4.0
    assert "it has restarted" in warned(restarted)
    wrapped = at_rest(400)
    wrapped[:, 0] = np.mod(wrapped[:, 0] + 4290.0, 2**32 / 1e6)
    assert "counter was full" in warned(wrapped)


def test_a_clock_that_is_wrong_by_a_factor_is_noticed_by_the_hosts() -> None:
    intake = Intake()
    for i, row in enumerate(at_rest(1500, rate=204.8)):
        intake.feed((HEADER if i == 0 else b"") + printed(row[None]), i / 102.4)
    assert any("204.8 samples/s, but 102.4 arrive" in text for text in intake.warnings)


def test_a_silence_or_a_faster_playing_is_no_wrong_clock() -> None:
    intake, silent = Intake(), 0.0
    for i, row in enumerate(at_rest(3000)):
        silent = 60.0 if i > 1000 else 0.0
        intake.feed((HEADER if i == 0 else b"") + printed(row[None]), i / 100 + silent)
    assert intake.warnings == ()
    fast = Intake()
    for i, row in enumerate(at_rest(3000)):
        fast.feed((HEADER if i == 0 else b"") + printed(row[None]), i / 300)
    assert fast.warnings == ()


def test_time_in_milliseconds_under_a_header_of_seconds_is_noticed() -> None:
    intake = Intake()
    values = at_rest(1000)
    values[:, 0] *= 1000
    for i, row in enumerate(values):
        intake.feed((HEADER if i == 0 else b"") + printed(row[None]), i / 100)
    assert intake.rate == pytest.approx(100.0, rel=0.01)
    assert "The time column in s would mean 0.1 samples/s" in intake.warnings[0]
    assert "so it is in ms" in intake.warnings[0]


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
    assert "no text" in intake.problem
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
    garbage = Garbage()
    for _ in range(600):
        garbage.feed(b"0.1,0.2,9.8 ")
    assert "line ends" in garbage.problem


def test_a_time_column_that_stands_still_is_replaced_by_arrival() -> None:
    intake = Intake()
    values = at_rest(400)
    values[:, 0] = 7.0
    for i, row in enumerate(values):
        intake.feed((HEADER if i == 0 else b"") + printed(row[None]), i / 100)
    assert intake.ready
    assert intake.rate == pytest.approx(100.0, rel=0.01)
    assert any("does not run" in text for text in intake.warnings)


def test_control_characters_of_a_device_are_not_shown() -> None:
    intake, _ = read(contract(60) + b"\x1b[2J\x1b]0;owned\x07\r\n")
    assert "\x1b" not in intake.preview.line
    assert "\x07" not in intake.preview.line


def test_a_unit_of_time_that_cannot_be_is_replaced_by_what_the_arrivals_say() -> None:
    intake = Intake()
    header = HEADER.replace(b"t[s]", b"t[ns]")
    values = at_rest(400)
    for i, row in enumerate(values):
        intake.feed((header if i == 0 else b"") + printed(row[None]), i / 100)
    assert intake.rate == pytest.approx(100.0, rel=0.01)
    assert "The time column in ns would mean 1e+11 samples/s" in intake.warnings[0]


def test_exchanged_columns_are_named_as_such() -> None:
    def exchange(values: FloatArray) -> None:
        values[:, 1:7] = values[:, [4, 5, 6, 1, 2, 3]]

    assert "their columns are exchanged" in warned(spoilt(exchange))


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
