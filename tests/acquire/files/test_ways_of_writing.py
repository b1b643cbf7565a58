"""Encodings, decimal commas, quotes, words between the numbers: ways to write the same samples."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imucal_wizard.acquire.decode import decoder_for
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.acquire.setup import named_columns
from imucal_wizard.core.errors import RecordingError
from tests.acquire.files.lines import samples, written


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_two_bytes_per_character_and_marks_of_their_order_do_not_matter(
    tmp_path: Path, encoding: str
) -> None:
    path, lines = written(tmp_path)
    path.write_text("\r\n".join(lines) + "\r\n", encoding=encoding, newline="")
    readings = read_files([path])
    assert (len(readings), readings.warnings) == (400, ())


def test_units_written_in_latin_1_are_understood(tmp_path: Path) -> None:
    path, lines = written(tmp_path)
    lines[0] = lines[0].replace("rad/s", "°/s")
    path.write_bytes(("\n".join(lines) + "\n").encode("latin-1"))
    readings = read_files([path])
    assert readings.gyroscope is not None
    assert readings.gyroscope.unit == "rad/s"


@pytest.mark.parametrize("separator", [";", " ", "\t"])
def test_a_decimal_comma_is_understood(tmp_path: Path, separator: str) -> None:
    path, lines = written(tmp_path)
    body = [line.replace(",", separator).replace(".", ",") for line in lines[1:]]
    path.write_text("\n".join([lines[0].replace(",", separator), *body, ""]))
    np.testing.assert_allclose(
        read_files([path]).accelerometer.values, samples()[:, 1:4], atol=1e-6
    )


def test_a_decimal_comma_is_seen_though_the_first_row_has_whole_numbers(tmp_path: Path) -> None:
    path, lines = written(tmp_path)
    lines[1] = "0;0;0;10;0;0;0;25"
    body = [line.replace(",", ";").replace(".", ",") for line in lines[2:]]
    path.write_text("\n".join([lines[0].replace(",", ";"), lines[1], *body, ""]))
    np.testing.assert_allclose(
        read_files([path]).accelerometer.values[1:], samples()[1:, 1:4], atol=1e-6
    )


def test_decimal_commas_in_quotes_are_understood_and_bare_ones_are_explained(
    tmp_path: Path,
) -> None:
    path, lines = written(tmp_path)
    rows = [[field.replace(".", ",") for field in line.split(",")] for line in lines[1:]]
    quoted = [",".join(f'"{field}"' for field in row) for row in rows]
    path.write_text("\n".join([lines[0], *quoted, ""]))
    np.testing.assert_allclose(
        read_files([path]).accelerometer.values, samples()[:, 1:4], atol=1e-6
    )
    path.write_text("\n".join([lines[0], *(",".join(row) for row in rows), ""]))
    with pytest.raises(RecordingError, match="decimal comma between commas"):
        read_files([path])


def test_columns_of_words_and_a_comma_at_the_end_do_no_harm(tmp_path: Path) -> None:
    path, lines = written(tmp_path)
    body = [f"01/07/2000,16:18:45.54,{line}," for line in lines[1:]]
    path.write_text("\n".join(["rtcDate,rtcTime," + lines[0] + ",", *body, ""]))
    readings = read_files([path])
    assert (len(readings), readings.warnings) == (400, ())


@given(
    st.lists(st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3), min_size=1, max_size=300),
    st.sampled_from([",", ";", "\t", " "]),
)
def test_printed_numbers_are_read_back_exactly(rows: list[list[float]], separator: str) -> None:
    """One by one, and in the fast way that many lines take."""
    text = "".join(separator.join(map(repr, row)) + "\n" for row in rows)
    decoder = decoder_for("csv", named_columns("ax,ay,az"), whole=True)
    np.testing.assert_array_equal(decoder.feed(text.encode()).values, np.array(rows))
