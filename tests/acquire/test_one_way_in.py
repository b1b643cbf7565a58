"""One way in: the same text as a stream, cut anywhere, and as a file says the same."""

from dataclasses import dataclass, field
from functools import cache
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import AUTO, StreamSetup, named_columns
from imucal_wizard.core.readings import FloatArray, Readings, Series, join_readings
from imucal_wizard.measurement.segmentation import holds_under, reduce_recording
from tests.acquire.firmware import STREAMS

RATE = 100.0


def _moving(count: int = 1400) -> FloatArray:
    """Times, specific force and rate of a device in four poses, 3 s each, and between them."""
    rng = np.random.default_rng(7)
    poses = np.array([[0.0, 0.0, 9.8], [9.8, 0.0, 0.0], [0.0, -9.8, 0.0], [0.0, 0.0, -9.8]])
    place = np.minimum(np.arange(count) / count * 4.0, 3.999)
    first, share = place.astype(int), np.clip((place % 1.0 - 0.85) / 0.15, 0.0, 1.0)[:, None]
    force = (1 - share) * poses[first] + share * poses[np.minimum(first + 1, 3)]
    rate = np.where(share > 0, rng.normal(0.0, 1.0, (count, 3)), 0.01)
    noise = rng.normal(0.0, 1.0, (count, 6)) * ([0.02] * 3 + [0.002] * 3)
    return np.column_stack([np.arange(count) / RATE, np.column_stack([force, rate]) + noise])


ROWS = _moving()


@dataclass(frozen=True)
class Style:
    """A way to write samples as text.

    Attributes:
        text: the lines.
        options: what the user says of a file.
        setup: the same, said of a stream.
    """

    text: str
    options: RecordingOptions = field(default_factory=RecordingOptions)
    setup: StreamSetup = field(default_factory=StreamSetup)


def _told(**said: str | float | tuple[str, ...]) -> tuple[RecordingOptions, StreamSetup]:
    """The same said of a file and of a stream."""
    columns = said.get("columns", ())
    rate = said.get("rate")
    unit = str(said.get("gyroscope_unit", ""))
    assert isinstance(columns, tuple)
    assert rate is None or isinstance(rate, float)
    return (
        RecordingOptions(columns, rate, gyroscope_unit=unit or None),
        StreamSetup(
            AUTO, named_columns(",".join(columns)) if columns else (), rate, gyroscope_unit=unit
        ),
    )


UNITS = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s]"
NAMES = ("ax", "ay", "az", "gx", "gy", "gz")
EUROC = (
    "#timestamp [ns],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],a_RS_S_z [m s^-2],"
    "w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1]"
)


def _lines(header: str, separator: str = ",", scale: float = 1.0, form: str = "%.6f") -> str:
    rows = ROWS.copy()
    rows[:, 0] *= scale
    time = "%.0f" if scale > 1 else "%.4f"
    lines = [separator.join([time % row[0], *(form % v for v in row[1:])]) for row in rows]
    return "\n".join([*([header] if header else []), *lines, ""])


def _formed(form: str, columns: slice = slice(1, 7)) -> str:
    return "".join(form % tuple(row) + "\n" for row in ROWS[:, columns])


PLAIN = _told(rate=RATE, gyroscope_unit="rad/s")
STYLES: dict[str, Style] = {
    "commas": Style(_lines(UNITS)),
    "semicolons": Style(_lines(UNITS.replace(",", ";"), ";")),
    "tabs": Style(_lines(UNITS.replace(",", "\t"), "\t")),
    "blanks": Style(_lines(UNITS.replace(",", " "), "  ")),
    "bars": Style(_lines(UNITS.replace(",", "|"), "|")),
    "comma and blank": Style(_lines(UNITS.replace(",", ", "), ", ")),
    "quotes": Style(_lines(UNITS, form='"%.6f"')),
    "decimal commas": Style(_lines(UNITS.replace(",", ";"), ";").replace(".", ",")),
    "decimal commas and tabs": Style(_lines(UNITS.replace(",", "\t"), "\t").replace(".", ",")),
    "decimal commas and blanks": Style(_lines(UNITS.replace(",", " "), " ").replace(".", ",")),
    "carriage returns": Style(_lines(UNITS).replace("\n", "\r\n")),
    "milliseconds": Style(_lines(UNITS.replace("t[s]", "timestamp_ms"), scale=1e3)),
    "microseconds": Style(_lines(UNITS.replace("t[s]", "micros"), scale=1e6)),
    "EuRoC": Style(_lines(EUROC, scale=1e9)),
    "header in a comment": Style(_lines("# " + UNITS)),
    "units below the names": Style(
        _lines("t,ax,ay,az,gx,gy,gz\ns,m/s^2,m/s^2,m/s^2,rad/s,rad/s,rad/s")
    ),
    "names without units": Style(_lines("time,acc_x,acc_y,acc_z,gyr_x,gyr_y,gyr_z"), *PLAIN),
    "comments": Style(_lines(UNITS).replace("\n1", "\n# a remark\n1")),
    "a leading text column": Style(
        _lines("label," + UNITS).replace("\n", "\nrest,").removesuffix("rest,")
    ),
    "a leading text column without header": Style(
        _formed("IMU,%.6f,%.6f,%.6f,%.6f,%.6f,%.6f"),
        *_told(columns=("-", *NAMES), rate=RATE, gyroscope_unit="rad/s"),
    ),
    "no header": Style(_formed("%.6f,%.6f,%.6f,%.6f,%.6f,%.6f"), *PLAIN),
    "columns told": Style(
        _formed("%.6f %.6f %.6f %.6f %.6f %.6f"),
        *_told(columns=NAMES, rate=RATE, gyroscope_unit="rad/s"),
    ),
    "brackets": Style(_formed("(%.6f, %.6f, %.6f, %.6f, %.6f, %.6f)"), *PLAIN),
    "labels": Style(_formed("ax:%.6f,ay:%.6f,az:%.6f,gx:%.6f,gy:%.6f,gz:%.6f"), *PLAIN),
    "labels with units": Style(
        _formed("acc=[%.6f,%.6f,%.6f] m/s^2 gyro=[%.6f,%.6f,%.6f] rad/s"), *_told(rate=RATE)
    ),
    "two kinds of line": Style(
        _formed("Accel: %.6f %.6f %.6f\nGyro: %.6f %.6f %.6f"), *PLAIN
    ),
    "JSON": Style(
        _formed('{"ax":%.6f,"ay":%.6f,"az":%.6f,"gx":%.6f,"gy":%.6f,"gz":%.6f}'), *PLAIN
    ),
    "JSON with time": Style(
        _formed('{"t":%.4f,"acc":[%.6f,%.6f,%.6f],"gyro":[%.6f,%.6f,%.6f]}', slice(0, 7)), *PLAIN
    ),
}  # fmt: skip
STYLES |= {
    f"firmware: {name}": Style(line.decode() * 120, *_told(rate=RATE, gyroscope_unit="deg/s"))
    for name, line in STREAMS.items()
}


def _as_stream(style: Style, cuts: list[float]) -> tuple[Intake, Readings]:
    """The text as a device sends it: the stream begins in the middle of a line."""
    data = b"e of a line before\n" + style.text.encode()
    places = sorted({0, len(data), *(int(cut * len(data)) for cut in cuts)})
    intake = Intake(style.setup)
    parts = [intake.feed(data[a:b], b / len(data) * len(ROWS) / RATE) for a, b in pairwise(places)]
    found = [part for part in (*parts, intake.flush()) if part is not None]
    assert found, (intake.format, intake.needs, intake.problem)
    return intake, join_readings(found)


@cache
def _as_file(name: str) -> Readings:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "recording.txt"
        path.write_bytes(STYLES[name].text.encode())
        return read_files([path], STYLES[name].options)


def _same(stream: Series | None, file: Series | None) -> None:
    if stream is None or file is None:
        assert stream is None or not len(stream)
        assert file is None
        return
    assert stream.unit == file.unit
    np.testing.assert_array_equal(stream.values, file.values)
    np.testing.assert_allclose(stream.time - stream.time[0], file.time - file.time[0], atol=1e-9)


@pytest.mark.parametrize("name", STYLES)
@settings(max_examples=2, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(cuts=st.lists(st.floats(0, 1), max_size=40))
def test_a_stream_and_a_file_of_the_same_text_are_the_same(name: str, cuts: list[float]) -> None:
    style = STYLES[name]
    intake, stream = _as_stream(style, [i / 60 for i in range(60)] + cuts)
    file = _as_file(name)
    assert intake.malformed == 0
    for sensor in ("accelerometer", "gyroscope", "magnetometer", "temperature", "current"):
        _same(getattr(stream, sensor), getattr(file, sensor))


@pytest.mark.parametrize("name", [name for name in STYLES if not name.startswith("firmware")])
def test_a_stream_and_a_file_of_the_same_text_have_the_same_holds(name: str) -> None:
    style = STYLES[name]
    found = []
    for readings in (_as_stream(style, [i / 100 for i in range(100)])[1], _as_file(name)):
        reduced = reduce_recording(readings)
        assert reduced is not None
        found.append(holds_under(reduced, reduced.noise.limits(4.0)))
    stream, file = found
    assert len(stream) == len(file) >= 3
    for one, other in zip(stream, file, strict=True):
        assert (one.start, one.end) == pytest.approx((other.start, other.end), abs=1e-9)
        np.testing.assert_array_equal(one.accelerometer, other.accelerometer)
        np.testing.assert_array_equal(one.accelerometer_covariance, other.accelerometer_covariance)
