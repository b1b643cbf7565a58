"""Files that are garbled, cut, or not what they claim: what can be read is, the rest is named."""

from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.errors import InputError, RecordingError
from imucal_wizard.readings import FloatArray, Readings
from imucal_wizard.recordings import RecordingOptions, read
from imucal_wizard.recordings.layout import Layout
from imucal_wizard.recordings.table import read_table
from tests.recordings.lines import HEADER, samples, write


def _lines(tmp_path: Path, count: int = 400) -> tuple[Path, list[str]]:
    path = write(tmp_path / "a.csv", samples(count))
    return path, path.read_text().splitlines()


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
    path, lines = _lines(tmp_path)
    lines[place - 1] = line
    path.write_text("\n".join(lines) + "\n")
    readings = read([path])
    assert len(readings) == 399
    assert any("1 line does not fit the columns, first line 7" in t for t in readings.warnings)
    assert not any("\x1b" in text for text in readings.warnings)


@pytest.mark.filterwarnings("error")
def test_long_stretches_of_comments_are_read_in_silence(tmp_path: Path) -> None:
    path, lines = _lines(tmp_path)
    pause = ["# a pause of the logger, which it wrote down again and again"] * 2000
    path.write_text("\n".join([*lines[:200], *pause, "garb@ge", *pause, *lines[200:], ""]))
    assert len(read([path])) == 400


def test_the_fast_and_the_careful_way_read_the_same_numbers(tmp_path: Path) -> None:
    path, lines = _lines(tmp_path, 5000)
    clean = read([path])
    lines[3000] = "garbage"
    path.write_text("\n".join(lines) + "\n")
    mended = read([path])
    kept = np.delete(clean.accelerometer.values, 2999, axis=0)
    np.testing.assert_array_equal(mended.accelerometer.values, kept)
    assert any("first line 3001" in text for text in mended.warnings)


def test_without_times_a_bad_line_still_takes_its_place_in_time(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples()[:, 1:4], "ax[m/s^2],ay[m/s^2],az[m/s^2]")
    lines = path.read_text().splitlines()
    lines[201] = "1.0,?"
    path.write_text("\n".join(lines) + "\n")
    readings = read([path], RecordingOptions(rate=100.0))
    assert len(readings) == 399
    assert readings.accelerometer.time[200] == pytest.approx(2.01)


def test_too_many_lines_that_do_not_fit_are_an_error(tmp_path: Path) -> None:
    path, lines = _lines(tmp_path)
    lines[10:160] = ["0.1,0.2"] * 150
    path.write_text("\n".join(lines) + "\n")
    with pytest.raises(RecordingError, match=r"150 of 400 lines do not fit .* first line 11"):
        read([path])


def test_a_bad_cable_costs_the_lines_that_it_spoilt_and_no_others(tmp_path: Path) -> None:
    path, lines = _lines(tmp_path)
    lines[10:300:5] = [line[:20] for line in lines[10:300:5]]
    path.write_text("\n".join(lines) + "\n")
    readings = read([path])
    assert len(readings) == 342
    assert any("58 of 400 lines" in t and "Check the cable" in t for t in readings.warnings)


@pytest.mark.parametrize("word", ["nan", "", "inf", "ovf", "1e308"])
def test_rows_without_a_number_are_left_out_and_counted(tmp_path: Path, word: str) -> None:
    path, lines = _lines(tmp_path)
    for place in (5, 50, 51):
        fields = lines[place].split(",")
        fields[2] = word
        lines[place] = ",".join(fields)
    path.write_text("\n".join(lines) + "\n")
    readings = read([path])
    assert readings.gyroscope is not None
    assert (len(readings), len(readings.gyroscope)) == (397, 400)
    assert any("3 of 400 rows have no number for the accelerometer" in t for t in readings.warnings)


def test_a_last_line_cut_short_is_left_out(tmp_path: Path) -> None:
    path, _ = _lines(tmp_path)
    path.write_bytes(path.read_bytes()[:-4])
    readings = read([path])
    assert len(readings) == 399
    assert any("cut short" in text for text in readings.warnings)


def test_a_whole_last_line_without_its_end_is_kept(tmp_path: Path) -> None:
    path, _ = _lines(tmp_path)
    path.write_bytes(path.read_bytes()[:-1])
    assert len(read([path])) == 400


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
def test_two_bytes_per_character_and_marks_of_their_order_do_not_matter(
    tmp_path: Path, encoding: str
) -> None:
    path, lines = _lines(tmp_path)
    path.write_text("\r\n".join(lines) + "\r\n", encoding=encoding, newline="")
    readings = read([path])
    assert (len(readings), readings.warnings) == (400, ())


def test_units_written_in_latin_1_are_understood(tmp_path: Path) -> None:
    path, lines = _lines(tmp_path)
    lines[0] = lines[0].replace("rad/s", "°/s")
    path.write_bytes(("\n".join(lines) + "\n").encode("latin-1"))
    readings = read([path])
    assert readings.gyroscope is not None
    assert readings.gyroscope.unit == "rad/s"


@pytest.mark.parametrize("separator", [";", " ", "\t"])
def test_a_decimal_comma_is_understood(tmp_path: Path, separator: str) -> None:
    path, lines = _lines(tmp_path)
    body = [line.replace(",", separator).replace(".", ",") for line in lines[1:]]
    path.write_text("\n".join([lines[0].replace(",", separator), *body, ""]))
    np.testing.assert_allclose(read([path]).accelerometer.values, samples()[:, 1:4], atol=1e-6)


def test_a_decimal_comma_is_seen_though_the_first_row_has_whole_numbers(tmp_path: Path) -> None:
    path, lines = _lines(tmp_path)
    lines[1] = "0;0;0;10;0;0;0;25"
    body = [line.replace(",", ";").replace(".", ",") for line in lines[2:]]
    path.write_text("\n".join([lines[0].replace(",", ";"), lines[1], *body, ""]))
    np.testing.assert_allclose(read([path]).accelerometer.values[1:], samples()[1:, 1:4], atol=1e-6)


def test_decimal_commas_in_quotes_are_understood_and_bare_ones_are_explained(
    tmp_path: Path,
) -> None:
    path, lines = _lines(tmp_path)
    rows = [[field.replace(".", ",") for field in line.split(",")] for line in lines[1:]]
    quoted = [",".join(f'"{field}"' for field in row) for row in rows]
    path.write_text("\n".join([lines[0], *quoted, ""]))
    np.testing.assert_allclose(read([path]).accelerometer.values, samples()[:, 1:4], atol=1e-6)
    path.write_text("\n".join([lines[0], *(",".join(row) for row in rows), ""]))
    with pytest.raises(RecordingError, match="decimal comma between commas"):
        read([path])


def test_columns_of_words_and_a_comma_at_the_end_do_no_harm(tmp_path: Path) -> None:
    path, lines = _lines(tmp_path)
    body = [f"01/07/2000,16:18:45.54,{line}," for line in lines[1:]]
    path.write_text("\n".join(["rtcDate,rtcTime," + lines[0] + ",", *body, ""]))
    readings = read([path])
    assert (len(readings), readings.warnings) == (400, ())


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "is empty"),
        (b"  \n\n", "is empty"),
        (b"# only a comment\n", "no line of data"),
        (HEADER.encode() + b"\n", "no line of data"),
        (bytes(range(32)) * 200, "this is not text"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(200), "it is a picture"),
        (b"\x1f\x8b" + bytes(200), "compressed by gzip and damaged"),
        (b"1.0," * 100_000, "no line of data"),
    ],
)
def test_what_holds_no_data_is_refused_by_name(tmp_path: Path, data: bytes, says: str) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(data)
    with pytest.raises(RecordingError, match=says) as caught:
        read([path])
    assert str(path) in str(caught.value)


def test_a_port_given_as_a_file_is_named_as_one() -> None:
    with pytest.raises(RecordingError, match="--port /dev/null"):
        read([Path("/dev/null")])


def test_a_line_of_megabytes_costs_itself_and_no_other(tmp_path: Path) -> None:
    path, lines = _lines(tmp_path)
    path.write_text("\n".join([*lines[:200], "9" * 2_000_000, *lines[200:], ""]))
    readings = read([path])
    assert len(readings) == 400
    assert any("1 line does not fit" in text and len(text) < 200 for text in readings.warnings)


def test_what_a_logger_left_behind_the_last_line_is_no_data(tmp_path: Path) -> None:
    path, _ = _lines(tmp_path)
    path.write_bytes(path.read_bytes() + bytes(4096))
    readings = read([path])
    assert (len(readings), readings.warnings) == (400, ())


def test_a_missing_file_and_a_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no such file"):
        read([tmp_path / "none.csv"])
    with pytest.raises(RecordingError, match="is a folder"):
        read([tmp_path])


def test_too_few_digits_are_named(tmp_path: Path) -> None:
    values = samples()
    values[:, 1] += np.linspace(-1.0, 1.0, 400)
    values[:, 1:4] = np.round(values[:, 1:4] / 9.80665, 2) * 9.80665
    readings = read([write(tmp_path / "a.csv", values)])
    assert any("steps of 10 mg" in text and "Serial.print" in text for text in readings.warnings)


def test_repeated_samples_are_named(tmp_path: Path) -> None:
    values = samples()
    values[1::2, 1:] = values[::2, 1:]
    readings = read([write(tmp_path / "a.csv", values)])
    assert any("50% of the samples repeat" in text for text in readings.warnings)


def test_an_axis_that_is_dead_or_given_twice_is_named(tmp_path: Path) -> None:
    values = samples()
    values[:, 5] = 0.0
    values[:, 2] = values[:, 1]
    warnings = read([write(tmp_path / "a.csv", values)]).warnings
    assert any(text.startswith("gy never changes") for text in warnings)
    assert any(text.startswith("ax and ay are the same") for text in warnings)


@given(st.binary(max_size=400))
def test_no_bytes_whatever_lead_to_anything_but_a_clear_error(data: bytes) -> None:
    with NamedTemporaryFile(suffix=".csv") as file:
        file.write(data)
        file.flush()
        with pytest.raises(InputError) as caught:
            read([Path(file.name)])
        assert "\n" not in str(caught.value)


@given(
    st.lists(st.lists(st.floats(-1e6, 1e6), min_size=3, max_size=3), min_size=1, max_size=30),
    st.sampled_from([",", ";", "\t", None]),
)
def test_printed_numbers_are_read_back_exactly(
    rows: list[list[float]], separator: str | None
) -> None:
    text = "".join((separator or " ").join(map(repr, row)) + "\n" for row in rows)
    table = read_table(text, Layout(separator, 3, (0, 1, 2)), 1)
    np.testing.assert_array_equal(table.values, np.array(rows))


def test_coarse_digits_that_the_noise_dithers_are_not_complained_of(tmp_path: Path) -> None:
    """Steps of 0.01 m/s² under noise of 0.02 m/s² average away."""
    rng = np.random.default_rng(4)
    time = np.arange(0.0, 3.0, 0.01)
    values = np.round(rng.normal((0.0, 0.0, 9.8), 0.02, (len(time), 3)), 2)
    path = tmp_path / "dithered.csv"
    header = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]"
    np.savetxt(path, np.column_stack([time, values]), delimiter=",", header=header, comments="")
    assert not any("digits" in warning for warning in read([path], RecordingOptions()).warnings)


def _moving(seed: int = 2) -> FloatArray:
    """Rows of a device that rests in several positions, with noise."""
    values = samples(3000)
    rng = np.random.default_rng(seed)
    turned = np.repeat(rng.permutation(np.linspace(-9.8, 9.8, 10)), 300)
    values[:, 1] += turned
    values[:, 4] += np.where(np.arange(3000) % 300 < 60, rng.normal(0.0, 1.0, 3000), 0.0)
    return values


@pytest.mark.parametrize(("place", "name", "end"), [(1, "ax", 9.0), (4, "gx", 1.2)])
def test_an_axis_at_the_end_of_its_range_is_named(
    tmp_path: Path, place: int, name: str, end: float
) -> None:
    values = _moving()
    if place == 4:  # a slow turn beyond the range
        values[600:640, 4] = 2.0 * np.sin(np.linspace(0.0, np.pi, 40))
    values[:, place] = np.clip(values[:, place], -end, end)
    warnings = read([write(tmp_path / "a.csv", values)]).warnings
    assert any(text.startswith(f"{name} stands still at") for text in warnings)


def test_coarse_readings_and_readings_in_range_are_not_called_clipped(tmp_path: Path) -> None:
    for decimals in (6, 1):
        values = np.round(_moving(), decimals)
        values[:, 0] = np.arange(len(values)) / 100.0
        warnings = read([write(tmp_path / "a.csv", values)]).warnings
        assert not any("stands still at" in text for text in warnings)


def test_a_gyroscope_that_takes_its_own_bias_out_is_pointed_out(tmp_path: Path) -> None:
    values = _moving()
    values[np.arange(3000) % 300 >= 60, 4:7] = 0.0
    warnings = read([write(tmp_path / "a.csv", values)]).warnings
    assert any("reads exactly zero at rest" in text for text in warnings)


def test_a_gyroscope_without_a_number_is_left_out_and_an_accelerometer_refused(
    tmp_path: Path,
) -> None:
    values = samples()
    values[:, 5] = np.nan
    readings = read([write(tmp_path / "a.csv", values)])
    assert readings.gyroscope is None
    assert any("gy[rad/s] hold no number: the gyroscope" in text for text in readings.warnings)
    values[:, 2] = np.nan
    with pytest.raises(RecordingError, match=r"ay\[m/s\^2\] hold no number"):
        read([write(tmp_path / "b.csv", values)])


_SPOILERS = [
    "nan",
    "inf",
    "1e400",
    "1,5",
    "--",
    "0x1F",
    "12:00:00",
    "2024-13-45T99:99:99Z",
    ";",
    "|",
    "[",
    "]",
    "{",
    "}",
    "(",
    '"',
    "#",
    ":",
    "=",
    "\t",
    "\r",
    "\n",
    "\x00",
    "\x1b[2J",
]


@settings(max_examples=60, deadline=None)
@given(
    separator=st.sampled_from([",", ";", "\t", " ", "|"]),
    spoil=st.lists(
        st.tuples(st.floats(0, 1), st.sampled_from(_SPOILERS), st.integers(1, 300)), max_size=8
    ),
    options=st.sampled_from(
        [
            RecordingOptions(),
            RecordingOptions(rate=100.0, gyroscope_unit="deg/s"),
            RecordingOptions(("t", "ax", "ay", "az", "gx", "gy", "gz", "-")),
            RecordingOptions(as_format="labels"),
        ]
    ),
)
def test_a_mutilated_recording_is_read_or_refused_in_one_line(
    separator: str, spoil: list[tuple[float, str, int]], options: RecordingOptions
) -> None:
    text = "\n".join([HEADER, *(",".join(f"{v:.4f}" for v in row) for row in samples(60)), ""])
    text = text.replace(",", separator)
    for where, what, times in spoil:
        place = int(where * len(text))
        text = text[:place] + what * times + text[place:]
    with NamedTemporaryFile(suffix=".csv") as file:
        file.write(text.encode())
        file.flush()
        readings, says = _read_or_told(Path(file.name), options)
    assert "\n" not in says
    assert len(says) < 1000
    if readings is not None:
        assert np.isfinite(readings.accelerometer.values).all()
        assert np.all(np.diff(readings.accelerometer.time) >= 0.0)


def _read_or_told(path: Path, options: RecordingOptions) -> tuple[Readings | None, str]:
    try:
        return read([path], options), ""
    except InputError as error:
        return None, str(error)
