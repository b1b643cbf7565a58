"""The calibration on disk: it reads back bit for bit, and what is damaged is refused in words."""

from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imucal_wizard.api import load
from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.output import encode_json
from imucal_wizard.report.calibration_file import (
    CALIBRATION_SCHEMA,
    Calibration,
    Sensor,
    Value,
)

finite = st.floats(allow_nan=False, allow_infinity=False)
row = st.lists(finite, min_size=3, max_size=3)


def calibration(matrix: list[list[float]], bias: list[float]) -> Calibration:
    """A calibration of one sensor."""
    sensor = Sensor(
        model=["bias", "scale"],
        method="least_squares",
        frame="own",
        matrix=matrix,
        bias=bias,
        bias_unit="count",
        parameters={"bias_x": Value(bias[0], "count", None, carried=False)},
        unit="m/s^2",
        rms_before=None,
        rms_fitted=0.001,
        rms_held_out=None,
    )
    return Calibration(
        schema=CALIBRATION_SCHEMA,
        program="0",
        created="2026-01-01T00:00:00+00:00",
        source="a test",
        gravity=Value(9.80665, "m/s^2"),
        temperature=(20.0, 25.5),
        holds=18,
        rotations=0,
        sensors={"accelerometer": sensor},
    )


EYE = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


@given(st.lists(row, min_size=3, max_size=3), row)
def test_every_finite_number_reads_back_to_the_same_bits(
    matrix: list[list[float]], bias: list[float]
) -> None:
    written = calibration(matrix, bias)
    assert msgspec.json.decode(encode_json(written), type=Calibration) == written


def test_saving_replaces_the_file_whole(tmp_path: Path) -> None:
    place = tmp_path / "one.json"
    calibration(EYE, [0.0, 0.0, 0.0]).save(place)
    calibration(EYE, [1.0, 2.0, 3.0]).save(place)
    assert load(place).sensors["accelerometer"].bias == [1.0, 2.0, 3.0]
    assert [path.name for path in place.parent.iterdir()] == ["one.json"]


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "not JSON"),
        (b"{]", "not JSON"),
        (b"[1, 2]", "no calibration"),
        (b'{"schema": "imucal-wizard/calibration/99"}', "calibration/99"),
        (b'{"schema": "imucal-wizard/calibration/1", "program": 3}', "damaged"),
    ],
)
def test_a_file_that_is_no_calibration_is_refused_with_the_reason(
    content: bytes, says: str, tmp_path: Path
) -> None:
    path = tmp_path / "x.json"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=says):
        load(path)


def test_a_place_that_cannot_be_written_says_what_to_do(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    with pytest.raises(UsageError, match="Choose another place"):
        calibration(EYE, [0.0, 0.0, 0.0]).save(blocked / "x.json")
