"""Spoilt lines, cut anywhere, or no lines at all: what comes out is the same, and whole."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.acquire.decode import decoder_for, format_names
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.readings import join_readings
from tests.acquire.firmware import FIRMWARE, STREAMS
from tests.acquire.streams import same


@pytest.mark.parametrize("firmware", FIRMWARE)
def test_the_cuts_do_not_matter_to_any_format(firmware: str) -> None:
    name, sample, *_ = FIRMWARE[firmware]
    data = sample * 60
    one, other = decoder_for(name), decoder_for(name)
    whole = one.feed(data)
    pieces = [other.feed(data[i : i + 7]) for i in range(0, len(data), 7)]
    parts = [p.values for p in pieces if len(p.values)]
    np.testing.assert_array_equal(np.concatenate(parts), whole.values)
    assert sum(p.malformed for p in pieces) == whole.malformed
    assert pieces[-1].decimals == whole.decimals


def test_a_wrong_checksum_is_malformed_and_loses_one_sample() -> None:
    good = FIRMWARE["VectorNav VNIMU"][1]
    rows = decoder_for("vnimu").feed(good * 10 + good.replace(b"+09.948", b"+09.949") + good)
    assert (len(rows.values), rows.malformed) == (11, 1)
    assert rows.skipped[-1] == 1


def test_a_lost_line_of_a_block_spoils_one_sample_and_mixes_none() -> None:
    lines = [
        line
        for i in range(20)
        for line in (b"#A-R=%d,0,256\n" % i, b"#M-R=%d,0,0\n" % i, b"#G-R=%d,0,0\n" % i)
    ]
    del lines[31]  # the magnetometer of sample 10
    rows = decoder_for("razor-ahrs").feed(b"".join(lines))
    assert len(rows.values) == 19
    np.testing.assert_array_equal(rows.values[:, 0], -rows.values[:, 6])
    assert rows.malformed == 1


def test_a_header_that_no_line_fits_is_given_up_and_the_columns_learned() -> None:
    """Lines with a word among their numbers fit neither; they must not be tried for ever."""
    decoder = decoder_for("csv")
    decoder.feed(b"first\nax,ay,az\n" + b"1.0,2.0,3.0,4.0,bad\n" * 5)
    rows = decoder.feed(b"1.0,2.0,3.0,4.0,5.0\n" * 40)
    assert rows.values.shape == (40, 5)


@settings(max_examples=40, deadline=None)
@given(data=st.binary(max_size=500))
@pytest.mark.parametrize("name", format_names())
def test_arbitrary_bytes_do_not_make_a_decoder_fail(name: str, data: bytes) -> None:
    decoder = decoder_for(name)
    decoder.feed(b"\n" + data)
    decoder.feed(data + b"\n")
    rows = decoder.feed(b"\n" + data + b"\n")
    assert rows.values.shape[1] == len(decoder.columns)


SPOIL = st.lists(
    st.tuples(
        st.floats(0, 1),
        st.one_of(st.binary(min_size=1, max_size=20), st.sampled_from([b"\r", b"\x00\n", b"nan"])),
    ),
    max_size=6,
)


@settings(max_examples=40, deadline=None)
@given(
    name=st.sampled_from(sorted(STREAMS)),
    spoil=SPOIL,
    cuts=st.lists(st.floats(0, 1), max_size=30),
)
def test_spoilt_streams_too_give_the_same_whatever_the_cuts(
    name: str, spoil: list[tuple[float, bytes]], cuts: list[float]
) -> None:
    data = STREAMS[name] * 60
    for where, what in spoil:
        place = int(where * len(data))
        data = data[:place] + what + data[place:]
    places = sorted({0, len(data), *(int(c * len(data)) for c in cuts)})
    setup = StreamSetup(gyroscope_unit="deg/s", rate=100.0)
    whole, pieces = Intake(setup), Intake(setup)
    one = whole.feed(data, 1.0)
    there = [pieces.feed(data[a:b], 1.0) for a, b in pairwise(places)]
    parts = [part for part in there if part is not None]
    assert (one is None) == (not parts)
    assert (whole.setup, whole.malformed, whole.lost) == (
        pieces.setup,
        pieces.malformed,
        pieces.lost,
    )
    if one is not None:
        assert same(join_readings(parts), one)
        again = Intake(whole.setup).feed(data, 1.0)
        assert again is not None
        assert same(again, one)


LINE = st.lists(st.sampled_from(["1", "2.5", "-3", "nan", "x", "ax", "10:00:00", ""]), max_size=7)


@settings(max_examples=60, deadline=None)
@given(lines=st.lists(st.tuples(LINE, st.sampled_from([",", ";", "\t", " "])), max_size=60))
def test_lines_of_any_width_and_words_are_read_without_end(
    lines: list[tuple[list[str], str]],
) -> None:
    data = "".join(sign.join(fields) + "\n" for fields, sign in lines).encode()
    intake = Intake(StreamSetup(gyroscope_unit="rad/s"))
    intake.feed(b"begin\n" + data * 3, 0.0)
    assert intake.preview.line.isprintable()
