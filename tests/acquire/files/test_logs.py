"""A log of what a device printed is read as the device itself would be."""

import json
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.errors import RecordingError
from tests.acquire.files.lines import samples

S = samples()
ROWS = [tuple(map(float, row)) for row in S[:, 1:7]]
NAMES = ("ax", "ay", "az", "gx", "gy", "gz")
WITH_RATE = RecordingOptions(rate=100.0, gyroscope_unit="rad/s")


def _each(form: str) -> str:
    return "".join(form % row + "\n" for row in ROWS)


def _objects() -> list[dict[str, float]]:
    return [dict(zip(NAMES, row, strict=True)) for row in ROWS]


LOGS = {
    "serial plotter": _each("AccX:%.9f,AccY:%.9f,AccZ:%.9f,GyrX:%.9f,GyrY:%.9f,GyrZ:%.9f"),
    "labels": _each("ax: %.9f ay: %.9f az: %.9f gx: %.9f gy: %.9f gz: %.9f"),
    "equal signs": _each("ax=%.9f, ay=%.9f, az=%.9f, gx=%.9f, gy=%.9f, gz=%.9f"),
    "JSON lines": "".join(json.dumps(one) + "\n" for one in _objects()),
    "a JSON document": json.dumps(_objects(), indent=1),
    "nested JSON": "".join(
        json.dumps({"acc": dict(zip("xyz", row[:3], strict=True)), "gyro": row[3:]}) + "\n"
        for row in ROWS
    ),
    "Arduino IDE with times": "".join(
        f"10:00:{i // 100:02d}.{i % 100:02d}0 -> {line}\n"
        for i, line in enumerate(
            _each("ax:%.9f ay:%.9f az:%.9f gx:%.9f gy:%.9f gz:%.9f").splitlines()
        )
    ),
}  # fmt: skip


@pytest.mark.parametrize("kind", LOGS)
def test_lines_with_words_are_read(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "log.txt"
    path.write_text(LOGS[kind])
    readings = read_files([path], WITH_RATE)
    assert readings.gyroscope is not None
    np.testing.assert_allclose(readings.accelerometer.values, S[:, 1:4], atol=1e-8)
    np.testing.assert_allclose(readings.gyroscope.values, S[:, 4:7], atol=1e-8)
    np.testing.assert_allclose(readings.accelerometer.time, S[:, 0], atol=1e-9)


@pytest.mark.parametrize("brackets", ["(%s)", "[%s]", "{%s}"])
def test_brackets_around_the_numbers_do_not_matter(tmp_path: Path, brackets: str) -> None:
    path = tmp_path / "log.txt"
    path.write_text(_each(brackets % ", ".join(["%.9f"] * 6)))
    options = RecordingOptions(NAMES, rate=100.0, gyroscope_unit="rad/s")
    np.testing.assert_allclose(
        read_files([path], options).accelerometer.values, S[:, 1:4], atol=1e-8
    )


def test_the_format_of_a_log_may_be_said(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text("".join(f"I,{10_000 * i},0.1,0.2,0.3,0.0,0.0,1.0\n" for i in range(300)))
    readings = read_files([path], RecordingOptions(as_format="ximu3"))
    assert len(readings) == 300
    assert readings.gyroscope is not None
    assert readings.gyroscope.values[0, 0] == pytest.approx(np.radians(0.1))


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (RecordingOptions(gyroscope_unit="rad/s"), "rate 100"),
        (RecordingOptions(rate=100.0), "gyroscope_unit rad/s"),
    ],
)
def test_what_a_log_does_not_say_is_asked_for(
    tmp_path: Path, options: RecordingOptions, says: str
) -> None:
    path = tmp_path / "log.txt"
    path.write_text(LOGS["labels"])
    with pytest.raises(RecordingError) as caught:
        read_files([path], options)
    assert caught.value.settings == (says,)


def test_numbers_between_words_that_mean_nothing_are_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text(_each("ypr\t%.3f\t%.3f\t%.3f\tareal\t%.3f\t%.3f\t%.3f"))
    with pytest.raises(RecordingError, match="which column is which"):
        read_files([path], WITH_RATE)


def test_the_example_for_a_nameless_file_has_the_accelerometer_where_gravity_is(
    tmp_path: Path,
) -> None:
    path = tmp_path / "a.txt"
    np.savetxt(path, S[:, [4, 5, 6, 1, 2, 3]])
    with pytest.raises(RecordingError) as caught:
        read_files([path])
    assert caught.value.settings[:2] == ("columns gx,gy,gz,ax,ay,az", "rate 100")
