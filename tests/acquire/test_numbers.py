"""A printed number has one value, whether it is read alone or with a thousand others."""

import math
import time
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from imucal_wizard.acquire.decode import numbers
from imucal_wizard.acquire.decode.delimited import split_fields
from imucal_wizard.acquire.decode.lines import MAX_LINE_BYTES, LineCutter, split_lines

fields = st.one_of(
    st.floats(allow_nan=False, allow_infinity=False).map(repr),
    st.integers(-(10**6), 10**6).map(str),
    st.text("0123456789+-.eE \t,;_naif", max_size=8),
    st.sampled_from(["", "nan", "NaN"]),
)


long_numbers = st.builds(
    lambda sign, digits, place: f"{sign}{digits[:place]}.{digits[place:]}",
    st.sampled_from(["", "-", "+"]),
    st.integers(0, 10**15 - 1).map(str),
    st.integers(0, 15),
)
sizes = st.one_of(st.integers(-99_999, 99_999).map(lambda one: one / 1e3), st.floats(-1e29, 1e29))


@given(rows=st.lists(st.lists(fields, min_size=3, max_size=3), min_size=1, max_size=6))
@example(rows=[["0\t"] * 3])
@pytest.mark.parametrize("separator", [",", ";", "\t", " "])
def test_a_batch_agrees_with_reading_one_by_one_wherever_it_answers(
    separator: str, rows: list[list[str]]
) -> None:
    lines = [separator.join(row).encode() for row in rows]
    together = numbers.number_table(b"".join(line + b"\n" for line in lines), separator.encode(), 3)
    if together is None:
        return
    alone = []
    for line in filter(bytes.strip if separator == " " else None, lines):
        alone.append([numbers.printed_number(field) for field in split_fields(line)])
        if len(alone[-1]) == 2 and line.endswith(separator.encode()):
            alone[-1].append(math.nan)
    assert list(map(repr, together.tolist())) == list(map(repr, alone))


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("separator", [b"\t", b" "])
def test_empty_lines_are_no_table_and_no_warning(separator: bytes) -> None:
    assert numbers.number_table(b"\n  \n".replace(b" ", separator), separator, 3) is None


@given(
    rows=st.lists(st.lists(sizes, min_size=3, max_size=3), min_size=2, max_size=6),
    place=st.integers(0, 48),
    byte=st.sampled_from([None, *"0123456789+-.eE \t\n"]),
)
def test_a_batch_of_matlab_s_lines_agrees_too_whatever_byte_is_another_one(
    rows: list[list[float]], place: int, byte: str | None
) -> None:
    text = "".join("".join(f"{value:16.7e}" for value in row) + "\n" for row in rows)
    if byte is not None:
        text = text[:place] + byte + text[place + 1 :]
    together = numbers.number_table(text.encode(), b" ", 3)
    assert together is not None or byte is not None
    if together is None:
        return
    alone = [numbers.printed_number(field) for field in text.encode().split()]
    assert list(map(repr, together.ravel().tolist())) == list(map(repr, alone))


@given(
    rows=st.lists(st.lists(fields, min_size=3, max_size=3), min_size=1, max_size=6),
    separator=st.sampled_from([",", ";", "\t"]),
)
def test_the_digits_of_many_numbers_at_once_give_the_same_values(
    rows: list[list[str]], separator: str
) -> None:
    """With lines of any fields in the middle."""
    plain = [["-12.5", "+0.0625", "123456.789012"], ["7", "-0", ""], ["-.5", "8.", "-0.0"]]
    lines = [separator.join(row).encode() for row in (*plain * 5, *rows, *plain * 5)]
    block = b"".join(line + b"\n" for line in lines)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(numbers, "_MIN_DECIMAL_BYTES", 0)
        whole = "\n".join(separator.join(row) for row in plain) + "\n"
        assert numbers._decimal_table(whole.encode(), separator.encode(), 3) is not None
        together = numbers.number_table(block, separator.encode(), 3)
    if together is None:
        return
    alone = []
    for line in filter(None, lines):
        alone.append([numbers.printed_number(field) for field in split_fields(line)])
        if len(alone[-1]) == 2 and line.endswith(separator.encode()):
            alone[-1].append(math.nan)
    assert list(map(repr, together.tolist())) == list(map(repr, alone))


@given(rows=st.lists(st.lists(long_numbers, min_size=3, max_size=3), min_size=1, max_size=9))
@example(rows=[["1700000000.12345", "-999999999999999", "0.00000000000001"]])
@example(rows=[["12345678", "12345678.", ".12345678"], ["123456789", "123456789.", "1.123456789"]])
def test_numbers_of_any_fifteen_digits_are_read_at_once(rows: list[list[str]]) -> None:
    block = "".join(",".join(row) + "\n" for row in rows).encode()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(numbers, "_MIN_DECIMAL_BYTES", 0)
        values = numbers._decimal_table(block, b",", 3)
    assert values is not None
    assert list(map(repr, values.ravel().tolist())) == [repr(float(x)) for row in rows for x in row]


def test_plain_lines_are_read_as_a_batch() -> None:
    table = numbers.number_table(b"1,2.5,-3e2\n" * 50, b",", 3)
    assert table is not None
    np.testing.assert_array_equal(table, [[1, 2.5, -300]] * 50)


def test_lines_of_a_sensor_that_is_slower_are_read_as_a_batch() -> None:
    table = numbers.number_table(b"1,,\n,NaN,3\n" * 50, b",", 3)
    assert table is not None
    np.testing.assert_array_equal(table, [[1, np.nan, np.nan], [np.nan, np.nan, 3]] * 50)


@pytest.mark.parametrize("field", [b"nan", b"NaN", b"inf", b"-inf", b"ovf", b"", b" ", b"1e999"])
def test_what_firmware_prints_instead_of_a_number_is_nan(field: bytes) -> None:
    value = numbers.printed_number(field)
    assert value is not None
    assert math.isnan(value)


@pytest.mark.parametrize("field", [b"abc", b"1_000", b"0x10", b"1.2.3", b"--1", b"e", b"1e"])
def test_what_is_no_number_is_text(field: bytes) -> None:
    assert numbers.printed_number(field) is None


def test_a_line_of_digits_is_searched_once() -> None:
    """A pattern that can divide the digits in many ways needs a minute of CPU for one line."""
    begin = time.process_time()
    assert numbers.NUMBER.search("9" * MAX_LINE_BYTES + "x") is None
    assert time.process_time() - begin < 1.0


def test_a_time_of_day_is_seconds() -> None:
    assert numbers.printed_number(b"16:18:45.54") == pytest.approx(58725.54)


@pytest.mark.parametrize(
    ("field", "digits"), [(b"1.25", 2), (b"-0.00001 ", 5), (b"7", 0), (b"1e-5", 17)]
)
def test_printed_decimals_are_counted(field: bytes, digits: int) -> None:
    assert numbers.printed_decimals(field) == digits


@given(data=st.binary(max_size=300), cuts=st.lists(st.integers(0, 300), max_size=8))
def test_lines_do_not_depend_on_the_cuts(data: bytes, cuts: list[int]) -> None:
    places = sorted({0, len(data), *(c for c in cuts if c < len(data))})
    cutter = LineCutter()
    pieces = [line for a, b in pairwise(places) for line in split_lines(cutter.feed(data[a:b]))]
    assert pieces == split_lines(LineCutter().feed(data))


@pytest.mark.parametrize("chunk", [100, 10**6])
def test_an_endless_line_takes_no_memory_and_spoils_only_itself(chunk: int) -> None:
    data = b"1" * (3 * MAX_LINE_BYTES) + b"\n" + b"good\r\n\r\n"
    cutter = LineCutter()
    lines: list[bytes] = []
    for place in range(0, len(data), chunk):
        lines += split_lines(cutter.feed(data[place : place + chunk]))
    assert lines == [b"\x01", b"good", b""]
