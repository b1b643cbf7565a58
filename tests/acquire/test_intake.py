"""Bytes become Readings: SI or counts, timed, and never dependent on how the bytes were cut."""

import json
import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.acquire.intake import LINK_BREAK, Intake
from imucal_wizard.acquire.resolve import resolve_columns
from imucal_wizard.acquire.setup import StreamSetup, named_columns
from imucal_wizard.core.errors import FormatError, UsageError
from imucal_wizard.core.readings import join_readings
from tests.acquire.streams import HEADER, at_rest, contract, feed, printed, read, same


def test_the_csv_of_the_contract_is_read_without_a_question() -> None:
    values = at_rest(300)
    intake, readings = read(HEADER + printed(values, "%.9f"))
    assert intake.ready
    assert intake.needs == ()
    assert intake.rate == pytest.approx(100.0)
    assert intake.digits == 9
    assert len(readings) == intake.samples == 300
    assert readings.gyroscope is not None
    assert readings.temperature is not None
    np.testing.assert_allclose(readings.accelerometer.values, values[:, 1:4], atol=1e-9)
    np.testing.assert_allclose(readings.gyroscope.values, values[:, 4:7], atol=1e-9)
    np.testing.assert_allclose(readings.accelerometer.time, np.arange(300) / 100, atol=1e-9)
    assert readings.temperature.values.shape == (300, 1)


@pytest.mark.parametrize("chunk", [1, 7, 64, 4096, 10**6])
def test_the_readings_do_not_depend_on_how_the_bytes_were_cut(chunk: int) -> None:
    data = contract(150)
    assert same(read(data, chunk=chunk)[1], read(data, chunk=13)[1])


@settings(max_examples=25, deadline=None)
@given(cuts=st.lists(st.integers(0, 5000), max_size=12))
def test_any_cuts_give_the_same_readings(cuts: list[int]) -> None:
    data = contract(60) + b"half a li" + contract(20)
    intake = Intake()
    whole = feed(intake, data, chunk=10**6)
    places = sorted({0, len(data), *(c for c in cuts if c < len(data))})
    other = Intake()
    parts = [other.feed(data[a:b], 1.0) for a, b in pairwise(places)]
    there = [p for p in parts if p is not None]
    assert same(join_readings(there), whole)
    assert (other.lost, other.malformed, other.digits) == (
        intake.lost,
        intake.malformed,
        intake.digits,
    )


@settings(max_examples=60, deadline=None)
@given(noise=st.binary(max_size=400), after=st.binary(max_size=200))
def test_arbitrary_bytes_do_not_make_it_fail(noise: bytes, after: bytes) -> None:
    intake = Intake()
    feed(intake, noise)
    feed(intake, contract(60)[200:] + after)
    feed(intake, noise)
    assert intake.preview.line.isprintable()


def test_units_of_the_header_are_brought_to_si() -> None:
    rows = b"".join(b"%d,1000,0,0,180,0,0\n" % (10 * i) for i in range(80))
    _, readings = read(b"t[ms],ax[mg],ay[mg],az[mg],gx[deg/s],gy[deg/s],gz[deg/s]\n" + rows)
    assert readings.gyroscope is not None
    assert readings.accelerometer.values[0, 0] == pytest.approx(9.80665)
    assert readings.gyroscope.values[0, 0] == pytest.approx(math.pi)
    assert readings.accelerometer.time[-1] == pytest.approx(0.79)


def test_a_stream_without_gyroscope_gives_an_accelerometer_alone() -> None:
    rows = b"".join(b"%.2f,0.1,0.2,9.8\n" % (0.01 * i) for i in range(80))
    _, readings = read(b"t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]\n" + rows)
    assert readings.gyroscope is None
    assert len(readings) == 80


def test_the_gyroscope_unit_is_asked_for_and_nothing_is_lost_meanwhile() -> None:
    data = b"t[s],ax,ay,az,gx,gy,gz\n" + printed(at_rest(200)[:, :7])
    intake, readings = read(data)
    assert intake.needs == ("gyroscope unit",)
    assert not intake.ready
    assert len(readings) == 0
    answered, readings_now = intake.reconfigured(StreamSetup(gyroscope_unit="rad/s"))
    assert answered.needs == ()
    assert readings_now is not None
    assert len(readings_now) == 200
    assert readings_now.accelerometer.unit == "m/s^2"


def test_the_setup_as_resolved_reads_the_same_bytes_alike() -> None:
    data = b"a banner\r\n" + contract(200)
    intake, readings = read(data)
    stored = StreamSetup.from_json(json.loads(json.dumps(intake.setup.to_json())))
    assert stored == intake.setup
    again, readings_again = read(data, stored, chunk=17)
    assert same(readings, readings_again)
    assert again.rate == intake.rate


def test_a_header_that_comes_later_is_still_used() -> None:
    data = printed(at_rest(100)) + HEADER + printed(at_rest(200)[100:])
    intake, readings = read(data)
    assert intake.needs == ()
    assert len(readings) == 199  # the very first line may be half of one


def test_a_repeated_header_and_comments_are_no_malformed_lines() -> None:
    data = contract(60) + b"# hello\r\n" + HEADER + printed(at_rest(120)[60:])
    intake, readings = read(data)
    assert intake.malformed == 0
    assert len(readings) == 120


def test_half_lines_and_missing_columns_are_counted_and_leave_out_nothing_else() -> None:
    lines = contract(200).splitlines(keepends=True)
    lines[100] = lines[100][:20] + b"\r\n"
    lines[150] = b"1,2\r\n"
    intake, readings = read(b"".join(lines))
    assert intake.malformed == 2
    assert intake.lost == 2
    assert len(readings) == 198


def test_no_half_line_is_joined_to_another_half_when_the_link_broke() -> None:
    lines = contract(200).splitlines(keepends=True)
    cut = lines[100][:-6] + LINK_BREAK + lines[130][5:]
    _, readings = read(b"".join([*lines[:100], cut, *lines[131:]]))
    assert len(readings) == 169
    assert float(np.max(readings.accelerometer.values)) < 11


def test_rows_with_nan_are_left_out_and_counted_as_lost() -> None:
    lines = contract(100).splitlines(keepends=True)
    lines[50] = b"3.49,nan,0,9.8,0,0,0,24\r\n"
    lines[60] = b"3.59,inf,0,9.8,0,0,0,24\r\n"
    intake, readings = read(b"".join(lines))
    assert len(readings) == 98
    assert intake.lost == 2


def test_columns_without_names_are_proposed_from_gravity_and_time() -> None:
    intake, _ = read(printed(at_rest(100)))
    assert [c.channel for c in intake.columns] == ["t", "ax", "ay", "az", "gx", "gy", "gz", "temp"]
    assert intake.needs == ("gyroscope unit",)


def test_columns_that_cannot_be_guessed_are_asked_for() -> None:
    rng = np.random.default_rng(3)
    intake, _ = read(printed(rng.normal(0, 1, (100, 5))))
    assert intake.needs == ("columns",)
    assert "which column is which" in intake.warnings[0]
    setup = StreamSetup(columns=named_columns("-,-,ax[g],ay[g],az[g]"), rate=50.0)
    answered, readings = intake.reconfigured(setup)
    assert answered.ready
    assert readings is not None
    assert readings.accelerometer.rate == pytest.approx(50.0)


def test_a_known_rate_times_a_stream_without_time() -> None:
    setup = StreamSetup(columns=named_columns("ax[g],ay[g],az[g]"), rate=200.0)
    intake, readings = read(b"0.01 -0.02 1.00\n" * 100, setup)
    assert intake.ready
    assert intake.rate == 200.0
    assert readings.accelerometer.time[-1] == pytest.approx(98 / 200)


def test_counts_stay_counts() -> None:
    columns = named_columns("ax[count],ay[count],az[count],gx[count],gy[count],gz[count]")
    _, readings = read(b"1,2,16384,4,5,6\n" * 60, StreamSetup(columns=columns, rate=100.0))
    assert readings.gyroscope is not None
    assert readings.accelerometer.unit == readings.gyroscope.unit == "count"
    assert readings.accelerometer.values[0].tolist() == [1, 2, 16384]


def test_wrong_words_in_a_setup_are_named() -> None:
    with pytest.raises(FormatError, match=r"no format 'morse'.*csv"):
        Intake(StreamSetup(format="morse"))
    with pytest.raises(UsageError, match="furlong"):
        StreamSetup(accelerometer_unit="furlong")
    with pytest.raises(UsageError, match="'up' is not a column"):
        named_columns("up,ay,az")
    with pytest.raises(UsageError, match="rate"):
        StreamSetup(rate=-1.0)
    garbled: tuple[object, ...] = ({"colour": "red"}, {"format": []}, {"columns": [3]}, [], None)
    for wrong in garbled:
        with pytest.raises(UsageError, match="cannot be read"):
            StreamSetup.from_json(wrong)


def test_a_stream_with_unanswered_questions_stays_cheap_to_read(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Without an answer for minutes, the reader must not fall behind."""
    looks: list[int] = []

    def counted(*arguments: Any) -> Any:
        looks.append(1)
        return resolve_columns(*arguments)

    monkeypatch.setattr("imucal_wizard.acquire.search.resolve_columns", counted)
    intake = Intake()
    rows = printed(at_rest(500)[:, 1:7])
    for second in range(50):
        intake.feed(rows, float(second))
    assert intake.needs == ("gyroscope unit",)
    assert len(looks) < 50
