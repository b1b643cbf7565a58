"""Lines of a file that do not fit are left out and named; the others keep their place in time."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.file_bytes import decode_text
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import RecordingError
from tests.acquire.files.lines import samples, write, written


@pytest.mark.parametrize(
    ("place", "line"),
    [
        (7, "0.06,0.0,9.8"),
        (7, "garb@ge"),
        (7, "0.06,0.0,0.0,9.8,0.0,0.0x,0.0,25.0"),
        (7, "\x1b[31m"),
    ],
)
def test_a_line_that_does_not_fit_is_left_out_and_named(
    tmp_path: Path, place: int, line: str
) -> None:
    path, lines = written(tmp_path)
    lines[place - 1] = line
    path.write_text("\n".join(lines) + "\n")
    readings = read_files([path])
    assert len(readings) == 399
    assert any("1 line does not fit the columns, first line 7" in t for t in readings.warnings)
    assert not any("\x1b" in text for text in readings.warnings)


@pytest.mark.filterwarnings("error")
def test_long_stretches_of_comments_are_read_in_silence(tmp_path: Path) -> None:
    path, lines = written(tmp_path)
    pause = ["# a pause of the logger, which it wrote down again and again"] * 2000
    path.write_text("\n".join([*lines[:200], *pause, "garb@ge", *pause, *lines[200:], ""]))
    assert len(read_files([path])) == 400


def test_the_fast_and_the_careful_way_read_the_same_numbers(tmp_path: Path) -> None:
    path, lines = written(tmp_path, 5000)
    clean = read_files([path])
    lines[3000] = "garbage"
    path.write_text("\n".join(lines) + "\n")
    mended = read_files([path])
    kept = np.delete(clean.accelerometer.values, 2999, axis=0)
    np.testing.assert_array_equal(mended.accelerometer.values, kept)
    assert any("first line 3001" in text for text in mended.warnings)


def test_without_times_a_bad_line_still_takes_its_place_in_time(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples()[:, 1:4], "ax[m/s^2],ay[m/s^2],az[m/s^2]")
    lines = path.read_text().splitlines()
    lines[201] = "1.0,?"
    path.write_text("\n".join(lines) + "\n")
    readings = read_files([path], RecordingOptions(rate=100.0))
    assert len(readings) == 399
    assert readings.accelerometer.time[200] == pytest.approx(2.01)


def test_too_many_lines_that_do_not_fit_are_an_error(tmp_path: Path) -> None:
    path, lines = written(tmp_path)
    lines[10:160] = ["0.1,0.2"] * 150
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(RecordingError, match=r"150 of 400 lines do not fit .* first line 11"):
        read_files([path])


def test_a_bad_cable_costs_the_lines_that_it_spoilt_and_no_others(tmp_path: Path) -> None:
    path, lines = written(tmp_path)
    lines[10:300:5] = [line[:20] for line in lines[10:300:5]]
    path.write_text("\n".join(lines) + "\n")
    readings = read_files([path])
    assert len(readings) == 342
    assert any("58 of 400 lines" in t and "Check the cable" in t for t in readings.warnings)


@pytest.mark.parametrize("word", ["nan", "", "inf", "ovf", "1e308"])
def test_rows_without_a_number_are_left_out_and_counted(tmp_path: Path, word: str) -> None:
    path, lines = written(tmp_path)
    for place in (5, 50, 51):
        fields = lines[place].split(",")
        fields[2] = word
        lines[place] = ",".join(fields)
    path.write_text("\n".join(lines) + "\n")
    readings = read_files([path])
    assert readings.gyroscope is not None
    assert (len(readings), len(readings.gyroscope)) == (397, 397)
    assert any("3 of 400 rows have no number for the accelerometer" in t for t in readings.warnings)


def test_rows_with_one_empty_field_each_are_not_said_to_lack_all_columns(tmp_path: Path) -> None:
    path, lines = written(tmp_path)
    for place in range(20, 80):
        fields = lines[place].split(",")
        fields[1 + place % 6] = ""
        lines[place] = ",".join(fields)
    path.write_text("\n".join(lines) + "\n")
    (said,) = [text for text in read_files([path]).warnings if "rows" in text]
    assert said == (
        "60 of 400 rows have no number in one or more of the columns ax, ay, az, gx, gy, gz; "
        "left out"
    )


def test_a_last_line_cut_short_is_left_out(tmp_path: Path) -> None:
    path, _ = written(tmp_path)
    path.write_bytes(path.read_bytes()[:-4])
    readings = read_files([path])
    assert len(readings) == 399
    assert any("cut short" in text for text in readings.warnings)


@pytest.mark.parametrize("above", ["0.1 0.2 0.3 0.4", "[", "]"])
def test_a_last_line_of_nothing_but_brackets_is_left_out(above: str) -> None:
    text, warnings = decode_text(f"0.1 0.2 0.3 0.4\n{above}\n[".encode())
    assert text.endswith(f"{above}\n".encode())
    assert "cut short" in warnings[-1]


def test_a_whole_last_line_without_its_end_is_kept(tmp_path: Path) -> None:
    path, _ = written(tmp_path)
    path.write_bytes(path.read_bytes()[:-1])
    assert len(read_files([path])) == 400


def test_a_line_of_megabytes_costs_itself_and_no_other(tmp_path: Path) -> None:
    path, lines = written(tmp_path)
    path.write_text("\n".join([*lines[:200], "9" * 2_000_000, *lines[200:], ""]))
    readings = read_files([path])
    assert len(readings) == 400
    assert any("1 line does not fit" in text and len(text) < 200 for text in readings.warnings)


def test_bytes_after_the_last_line_are_not_data(tmp_path: Path) -> None:
    path, _ = written(tmp_path)
    path.write_bytes(path.read_bytes() + bytes(4096))
    readings = read_files([path])
    assert (len(readings), readings.warnings) == (400, ())
