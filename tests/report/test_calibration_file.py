"""The calibration on disk: it reads back bit for bit, and what is damaged is refused in words."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from imucal_wizard.api import load
from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.output import encode_json
from imucal_wizard.report import proof
from imucal_wizard.report.calibration_file import (
    CALIBRATION_SCHEMA,
    Calibration,
    Sensor,
    Value,
    says_the_same,
)
from tests.report.test_certificate import full

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


def test_a_session_that_goes_on_after_its_result_says_nothing_new(tmp_path: Path) -> None:
    path, replace = full().save(tmp_path / "my.json"), msgspec.structs.replace
    sensors = {name: replace(one, as_found=None) for name, one in full().sensors.items()}
    later = replace(
        full(),
        created="2026-11-29T10:00:00+00:00",
        fingerprint="sha256:0 of the first 9 bytes",
        warnings=(*full().warnings, "The device's time went back: it has restarted."),
        sensors=sensors,
    )
    assert says_the_same(path, later)
    assert not says_the_same(path, replace(later, gravity=9.9))


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
        (b"[1, 2]", "is not a calibration"),
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


def test_what_is_saved_without_an_unusable_accelerometer_reads_back(tmp_path: Path) -> None:
    made = full()
    first = made.sensors["accelerometer"]
    worse = msgspec.structs.replace(first, rms_before=1e-3 * first.rms_fitted)
    made = msgspec.structs.replace(made, sensors={**made.sensors, "accelerometer": worse})
    assert list(made.unusable) == ["accelerometer"]
    assert list(load(made.save(tmp_path / "my.json"))) == ["gyroscope", "magnetometer"]


def test_a_place_that_cannot_be_written_says_what_to_do(tmp_path: Path) -> None:
    blocked = tmp_path / "file"
    blocked.write_text("in the way")
    with pytest.raises(UsageError, match="Choose another place"):
        calibration(EYE, [0.0, 0.0, 0.0]).save(blocked / "x.json")


@pytest.mark.parametrize(
    ("edit", "says"),
    [
        (lambda one: one["parameters"]["bias_x"].update(value=0.3001), "bias_x is 0.300100 in the"),
        (lambda one: one["bias"].__setitem__(0, 0.3001), "0.300100 by its matrix"),
        (
            lambda one: one["parameters"]["bias_x"].update(unit="mg"),
            "bias_x is in 'mg' in the list",
        ),
        (lambda one: one["parameters"]["bias_x"].update(standard_error=2e-4), "standard error"),
        (lambda one: one.update(rms_held_out=5e-5), "below its own 90 % interval"),
        (lambda one: one.update(rms_held_out=2e-4), "rms_held_out is .* among the models compared"),
        (lambda one: one.update(rms_before=5e-5), "good, but it is worse than no calibration"),
        (lambda one: one.update(limit=5e-3), "good, but these data cannot exclude errors above"),
        (lambda one: one.update(limit=5e-5), "grade is good, but the error is above the limit"),
        (lambda one: one.update(grade="not-usable"), "grade is not-usable, which its errors"),
        (lambda one: one.update(verdict="missing"), "good, but the verdict is missing"),
        (lambda one: one.update(usable=False), "contradict that it is not usable"),
        (lambda one: one.update(rms_fitted=2e-3), "instead of 0.204 mg|rms_fitted"),
    ],
)
def test_figures_that_contradict_one_another_are_refused_with_both(
    edit: Callable[[dict[str, Any]], None], says: str, tmp_path: Path
) -> None:
    path = full().save(tmp_path / "my.json")
    document = json.loads(path.read_text())
    sensor = document["sensors"]["accelerometer"]
    rung = {name: sensor[name] for name in ("model", "rms_fitted", "rms_held_out", "floor")}
    document["ladders"]["accelerometer"] = [rung | {"added": None}]
    edit(sensor)
    path.write_text(json.dumps(document))
    with pytest.raises(RecordingError, match=says) as refused:
        load(path)
    assert str(refused.value).endswith("take the file as it was saved")


def test_a_note_another_limit_and_another_layout_are_no_contradiction(tmp_path: Path) -> None:
    path = full().save(tmp_path / "my.json")
    document = json.loads(path.read_text())
    document["note"] = "dropped once"
    document["sensors"]["accelerometer"]["limit"] = 0.03
    path.write_text(json.dumps(document, indent=4, sort_keys=True))
    assert load(path).note == "dropped once"


def test_the_error_on_the_measurements_in_the_file_is_the_one_stated() -> None:
    made = full()
    moved = msgspec.structs.replace(made.hold_means[0], accelerometer=[0.0, 0.0, 9.0])
    other = msgspec.structs.replace(made, hold_means=[moved, *made.hold_means[1:]])
    assert proof.contradiction(made) == ""
    assert "error on the measurements in the file" in proof.contradiction(other)
