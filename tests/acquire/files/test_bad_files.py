"""Files that hold no recording are refused by name, and no bytes whatever lead to a traceback."""

from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import InputError, RecordingError
from imucal_wizard.core.readings import Readings
from tests.acquire.files.lines import HEADER, samples


@pytest.mark.parametrize(
    ("data", "says"),
    [
        (b"", "is empty"),
        (b"  \n\n", "is empty"),
        (b"# only a comment\n", "no line of data"),
        (HEADER.encode() + b"\n", "no line of data"),
        (bytes(range(32)) * 200, "this is not text"),
        (b'{\n "schema": "imucal-wizard/calibration/1"}', "give the recording it was made of"),
        (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + bytes(200), "it is a picture"),
        (b"\x1f\x8b" + bytes(200), "compressed by gzip and damaged"),
        (b"1.0," * 100_000, "no line of data"),
        (b"MATLAB 7.3 MAT-file, Platform".ljust(512) + b"\x89HDF" + bytes(99), "a MATLAB 7.3 file"),
        (b"version https://git-lfs.github.com/spec/v1\nsize 12\n", "a pointer of Git LFS"),
    ],
)
def test_what_holds_no_data_is_refused_by_name(tmp_path: Path, data: bytes, says: str) -> None:
    path = tmp_path / "a.csv"
    path.write_bytes(data)
    with pytest.raises(RecordingError, match=says) as caught:
        read_files([path])
    assert str(path) in str(caught.value)


def test_a_port_given_as_a_file_is_named_as_one() -> None:
    with pytest.raises(RecordingError, match="is a port") as caught:
        read_files([Path("/dev/null")])
    assert caught.value.settings == ("port /dev/null",)


def test_a_missing_file_and_a_folder_are_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="no such file"):
        read_files([tmp_path / "none.csv"])
    with pytest.raises(RecordingError, match="is a folder"):
        read_files([tmp_path])


@settings(deadline=None)
@given(st.binary(max_size=400))
def test_arbitrary_bytes_give_a_clear_error(data: bytes) -> None:
    with NamedTemporaryFile(suffix=".csv") as file:
        file.write(data)
        file.flush()
        with pytest.raises(InputError) as caught:
            read_files([Path(file.name)])
        assert "\n" not in str(caught.value)


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
        return read_files([path], options), ""
    except InputError as error:
        return None, str(error)
