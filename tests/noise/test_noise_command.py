"""``imucal-wizard noise`` on files and on a port."""

import contextlib
import gzip
import json
import re
import threading
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy import signal

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.long_recording import LongRecording
from imucal_wizard.cli.main import main
from imucal_wizard.core.errors import DataError, RecordingError
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.estimate.noise_survey import NoiseSurvey
from imucal_wizard.report.noise_report import (
    live_noise_text,
    noise_document,
    noise_for_export,
    progress_line,
    read_noise,
)
from tests.acquire.ports import Pty
from tests.noise.at_rest import csv_of, three_axes
from tests.report.devices import calibration

RATE, COUNT = 50.0, 7_000
TRUE_WHITE = 1e-3
TIME = np.arange(COUNT) / RATE


def force(seed: int, count: int = COUNT, walk: float = 0.0) -> FloatArray:
    """An accelerometer at rest."""
    noise = three_axes(seed, count, RATE, white=TRUE_WHITE, walk=walk)
    return np.asarray(noise + np.array([0.1, -0.2, 9.8]))


def document(capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 0) -> Any:
    """The JSON of a command."""
    assert main(["noise", *arguments, "--json", "-"]) == status
    return json.loads(capsys.readouterr().out)


def test_a_recording_at_rest_gives_its_noise_with_units(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "rest.csv.gz"
    rates = three_axes(8102, COUNT, RATE, white=2e-4)
    path.write_bytes(gzip.compress(csv_of(TIME, force(8101), rates)))
    said = document(capsys, str(path))
    assert said["schema"] == "imucal-wizard/noise/1"
    for sensor, true in (("accelerometer", TRUE_WHITE), ("gyroscope", 2e-4)):
        found = said["sensors"][sensor]
        for axis in "xyz":
            one = found["axes"][axis]
            assert abs(one["white"] - true) < 4.0 * one["white_standard_error"] < 0.05 * true
            assert "random_walk" in one["not_determined"]
            assert len(found["deviation"][axis]) == len(found["tau"])
        step = 0.01**-0.5
        assert found["kalibr"]["noise_density"] == pytest.approx(true, rel=0.02)
        assert next(iter(found["px4"].values())) == pytest.approx(true * step, rel=0.02)
    assert said["sensors"]["gyroscope"]["units"]["white"] == "rad/s/sqrt(Hz)"


def test_silent_samples_are_left_out_as_of_a_fit(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The sensor does not answer at first and now and then; zeros are no noise and no motion."""
    values = force(8109)
    silent = np.random.default_rng(8109).random(COUNT) < 0.02
    silent[:30] = True
    values[silent] = 0.0
    path = tmp_path / "silent.csv"
    path.write_bytes(csv_of(TIME, values))
    recording = LongRecording(path, RecordingOptions())
    assert sum(len(one) for one in recording) == COUNT - silent.sum()
    assert any(f"{silent.sum()} samples of the accelerometer" in one for one in recording.warnings)
    found = document(capsys, str(path))["sensors"]["accelerometer"]
    assert found["disturbances"] == []
    # a straight line across a lost sample lessens the noise
    assert found["axes"]["x"]["white"] == pytest.approx(TRUE_WHITE, rel=0.03)


def test_zeros_of_a_sensor_that_never_answers_are_kept(tmp_path: Path) -> None:
    """Its rows are those of a gyroscope that does."""
    path = tmp_path / "dead.csv"
    rates = three_axes(8102, COUNT, RATE, white=2e-4)
    path.write_bytes(csv_of(TIME, np.zeros((COUNT, 3)), rates))
    (readings,) = LongRecording(path, RecordingOptions())
    assert readings.gyroscope is not None
    assert len(readings.gyroscope) == COUNT


def test_motion_is_named_and_left_out(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    values = force(8103)
    values[2_500:2_560] += 0.3 * np.sin(np.arange(60))[:, None]  # a bump at 50 s
    values[4_500:] += [0.02, 0.0, 0.0]  # the table tilts by a tenth of a degree at 90 s
    path = tmp_path / "bumped.csv"
    path.write_bytes(csv_of(TIME, values))
    found = document(capsys, str(path))["sensors"]["accelerometer"]
    bump, tilt = found["disturbances"]
    assert bump["start"] <= 50.0 <= bump["end"] < 53.0
    assert tilt["start"] <= 90.0 <= tilt["end"] < 93.0
    assert tilt["axis"] == "x"
    one = found["axes"]["x"]
    assert abs(one["white"] - TRUE_WHITE) < 4.0 * one["white_standard_error"]
    assert "random_walk" in one["not_determined"]
    assert main(["noise", str(path)]) == 0
    text = capsys.readouterr().out
    assert "motion at 50 s" in text
    assert max(map(len, text.splitlines())) <= 80


@pytest.mark.parametrize("pieces", [1, 40])
def test_gaps_and_jitter_do_not_change_how_long_the_device_rested(pieces: int) -> None:
    """Four gaps of 3 s, all just where 30 blocks have been judged; and one sample per second."""
    time, count = TIME + 3.0 * (np.arange(COUNT) // (30 * int(RATE))), COUNT
    jitter = np.random.default_rng(8116).uniform(-1e-3, 1e-3, count)
    for when, rate, gaps in ((time, RATE, 4), (np.arange(count) + jitter, 1.0, 0)):
        survey = NoiseSurvey()
        for rows in np.array_split(np.arange(count), pieces):
            survey.feed(Readings(Series(when[rows], force(8117)[rows], "m/s^2")))
        found = survey.result()
        assert found.sensors["accelerometer"].seconds == pytest.approx(count / rate, rel=2e-3)
        assert [one for one in found.warnings if "gaps of more than 1 s" in one] == [
            f"the accelerometer has {gaps} gaps of more than 1 s; nothing is joined across a gap"
        ] * (gaps > 0)


def test_a_live_screen_of_80_columns_and_24_rows_holds_the_plots_of_two_sensors() -> None:
    survey, rates = NoiseSurvey(), three_axes(8113, COUNT, RATE, white=2e-4)
    survey.feed(Readings(Series(TIME, force(8114), "m/s^2"), Series(TIME, rates, "rad/s")))
    sensors = survey.result(ended=False).sensors
    progress = progress_line(sensors, survey.seconds, (0.1, 1.0, 10.0, 100.0, 1000.0))
    lines = live_noise_text(sensors, progress, 80, 24).splitlines()
    assert max(map(len, lines[1:])) <= 80
    assert len(lines) + len(lines[0]) // 80 <= 24
    for word in ("ACCELEROMETER", "GYROSCOPE"):
        plot = lines[lines.index(word) + 2 :][:6]
        assert sum(row.count("⊗") + row.count("∘") for row in plot) > 10


def test_a_device_in_the_hand_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    values = force(8104, 6000)
    swing = np.random.default_rng(8105).uniform(0.0, 0.5, 120).repeat(50)
    values += (swing * np.sin(np.arange(6000) / 9.0))[:, None]
    path = tmp_path / "hand.csv"
    path.write_bytes(csv_of(TIME[:6000], values))
    assert "did not rest" in document(capsys, str(path), status=1)["error"]


@pytest.mark.parametrize("sensors", ["accelerometer", "both"])
def test_a_device_that_never_rests_is_refused_for_its_motion(sensors: str) -> None:
    """No sample of the accelerometer is at rest; a gyroscope that turns evenly seems to be."""
    time = np.arange(30_000) / RATE
    tilt = 0.3 * np.sin(2.0 * np.pi * time / 3.0) + 0.2 * np.sin(2.0 * np.pi * time / 1.7)
    noise = three_axes(8114, 2 * len(time), RATE, white=TRUE_WHITE).reshape(2, -1, 3)
    swung = 9.8 * np.column_stack([np.sin(tilt), np.zeros(len(time)), np.cos(tilt)])
    turning = np.column_stack([np.zeros(len(time)), np.gradient(tilt, time), np.zeros(len(time))])
    gyroscope = Series(time, turning + noise[1], "rad/s") if sensors == "both" else None
    survey = NoiseSurvey()
    survey.feed(Readings(Series(time, swung + noise[0], "m/s^2"), gyroscope))
    with pytest.raises(DataError, match="accelerometer shows motion in 100 %"):
        survey.result()


@pytest.mark.parametrize(("period", "share"), [(5, None), (2, 50)])
def test_short_bumps_leave_the_seconds_between_them(period: int, share: int | None) -> None:
    """30 ms every five seconds; every two seconds they leave none without a disturbed neighbour."""
    values = force(8118)
    bump = np.arange(COUNT) % (period * int(RATE)) < 2
    values[bump] += 0.5 * np.random.default_rng(8119).standard_normal((bump.sum(), 3))
    survey = NoiseSurvey()
    survey.feed(Readings(Series(TIME, values, "m/s^2")))
    if share is not None:
        with pytest.raises(DataError, match=f"the accelerometer shows motion in {share} %"):
            survey.result()
        return
    found = survey.result().sensors["accelerometer"]
    assert found.rest == pytest.approx(0.4, abs=0.05)
    white = found.fits[0].coefficients["white"]
    assert abs(white.value - TRUE_WHITE) < 4.0 * white.standard_error


@pytest.mark.parametrize("kind", ["filtered", "coarse"])
def test_neither_a_filter_nor_coarse_steps_count_as_motion(kind: str) -> None:
    rate, count = 100.0, 90_000
    values = three_axes(8111, count, rate, white=TRUE_WHITE)
    if kind == "filtered":  # first order, 50 ms
        keep = np.exp(-1.0 / (0.05 * rate))
        values = signal.lfilter([1.0 - keep], [1.0, -keep], values, axis=0)
    else:  # five times the standard deviation of a sample
        values = 0.05 * np.round(values / 0.05 + [0.3, -0.2, 0.4])
    survey, time = NoiseSurvey(), np.arange(count) / rate
    for rows in np.array_split(np.arange(count), 30):
        survey.feed(Readings(Series(time[rows], values[rows] + [0.0, 0.0, 9.8], "m/s^2")))
    found = survey.result().sensors["accelerometer"]
    assert found.disturbances == ()
    if kind == "filtered":
        for fit in found.fits:
            one = fit.coefficients["white"]
            assert abs(one.value - TRUE_WHITE) < 4.0 * one.standard_error
            assert fit.first_tau > 0.5


def test_two_files_with_one_sensor_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "rest.csv"
    path.write_bytes(csv_of(TIME[:2000], force(8112, 2000)))
    assert main(["noise", str(path), str(path)]) == 2
    assert "two files hold the accelerometer" in capsys.readouterr().err


def test_memory_does_not_grow_with_the_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("imucal_wizard.acquire.files.long_recording.FED_BYTES", 1 << 14)
    peaks = []
    for count in (COUNT, 2 * COUNT):
        path = tmp_path / f"{count}.csv"
        path.write_bytes(csv_of(np.arange(count) / RATE, force(8106, count)))
        tracemalloc.start()
        survey = NoiseSurvey()
        for readings in LongRecording(path, RecordingOptions()):
            survey.feed(readings)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 1.1 * peaks[0]


def test_a_port_is_measured_live(
    pty: Pty, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("imucal_wizard.cli.noise.REPORT_SECONDS", 0.05)
    place = tmp_path / "noise.json"
    lines = csv_of(TIME, force(8107)).splitlines(keepends=True)

    def send() -> None:
        with contextlib.suppress(OSError):  # unplugged
            for first in range(0, len(lines), 50):
                pty.send(b"".join(lines[first : first + 50]))

    threading.Thread(target=send, daemon=True).start()
    assert main(["noise", "--port", pty.path, "--seconds", "80", "--json", str(place)]) == 0
    axes = json.loads(place.read_bytes())["sensors"]["accelerometer"]["axes"]
    assert axes["y"]["white"] == pytest.approx(TRUE_WHITE, rel=0.05)
    printed = capsys.readouterr().err
    assert "τ 100 s in" in printed
    assert "τ 1 s known" in printed


def test_before_the_first_plot_a_port_says_what_it_waits_for(
    pty: Pty, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("imucal_wizard.cli.noise.REPORT_SECONDS", 0.0)
    lines = csv_of(TIME, force(8107)).splitlines(keepends=True)

    def send() -> None:
        with contextlib.suppress(OSError):  # unplugged
            for first in range(0, 1000, 50):
                pty.send(b"".join(lines[first : first + 50]))

    threading.Thread(target=send, daemon=True).start()
    assert main(["noise", "--port", pty.path, "--seconds", "5"]) == 0
    words = "s: the noise at rest is measured for half a minute, then the plot follows"
    assert words in capsys.readouterr().err


def test_kalibr_takes_the_measured_noise(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording, noise, saved = (tmp_path / n for n in ("rest.csv", "noise.json", "my.json"))
    recording.write_bytes(csv_of(TIME, force(8108, walk=2e-3)))
    assert main(["noise", str(recording), "--json", str(noise)]) == 0
    calibration(turns=6).save(saved)
    out = tmp_path / "imu.yaml"
    command = ["export", str(saved), "--to", "kalibr", "-o", str(out), "--noise", str(noise)]
    assert main(command) == 0
    lines = dict(line.split(": ", 1) for line in out.read_text().splitlines()[:6])
    assert float(lines["accelerometer_noise_density"].split()[0]) == pytest.approx(
        TRUE_WHITE, rel=0.04
    )
    assert "Allan deviation" in lines["accelerometer_random_walk"]
    assert "typical" in lines["gyroscope_random_walk"]
    capsys.readouterr()
    assert main([*command[:-1], str(saved)]) == 2
    assert "is not the result of a noise measurement" in capsys.readouterr().err


def test_the_least_deviation_is_one_that_is_known_and_no_tau_is_below_the_period(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The least of τ near the length of the recording is too small: few differences show it."""
    path = tmp_path / "rest.csv"
    path.write_bytes(csv_of(TIME, force(8117)))
    sensor = document(capsys, str(path))["sensors"]["accelerometer"]
    for axis in sensor["axes"].values():
        assert axis["least_deviation_tau"] <= 0.1 * sensor["seconds_at_rest"]
    assert main(["noise", str(path)]) == 0
    assert re.search(r"least Allan deviation \d+\.?\d* ± \d+", capsys.readouterr().out)
    slow = NoiseSurvey()
    slow.feed(Readings(Series(50.0 * TIME, force(8118), "m/s^2")))
    line = progress_line(slow.result(ended=False).sensors, slow.seconds, (0.1, 1.0, 10.0))
    assert "τ 0.1" not in line
    assert "τ 1 s known" in line
    still = NoiseSurvey()
    still.feed(Readings(Series(TIME, np.tile([0.0, 0.0, 9.8], (COUNT, 1)), "m/s^2")))
    known = noise_document(still.result())["sensors"]["accelerometer"]["axes"].values()
    assert [one["least_deviation"] for one in known] == [None] * len(known)


def test_an_axis_that_does_not_determine_a_noise_is_not_in_that_of_a_sensor() -> None:
    """Not as nothing: the noise given to another program would be too small."""
    axis = {"white": 3e-4, "random_walk": 2e-5}
    unknown = {"white": 3e-4, "random_walk": 0.0, "not_determined": ["random_walk"]}
    axes = {"x": axis, "y": unknown, "z": unknown}
    one = {"units": {"deviation": "m/s^2"}, "axes": axes}
    found = noise_for_export({"sensors": {"accelerometer": one}})["accelerometer"]
    assert found == pytest.approx(axis)


def test_brackets_without_end_are_refused_as_noise(tmp_path: Path) -> None:
    path = tmp_path / "deep.json"
    path.write_bytes(b"[" * 100_000)
    with pytest.raises(
        RecordingError, match="is not the result of a noise measurement: it is not JSON"
    ):
        read_noise(path)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (lambda one: one.pop("tau"), '"tau" is missing'),
        (lambda one: one["tau"].pop(), "a deviation is missing or negative"),
        (lambda one: one["tau"].__setitem__(0, "?"), "a value is of another kind"),
        (lambda one: one.__setitem__("axes", []), "a value is of another kind"),
    ],
)
def test_a_damaged_document_of_noise_is_refused_in_words(
    spoil: Callable[[dict[str, Any]], object], says: str, tmp_path: Path
) -> None:
    recording, path = tmp_path / "rest.csv", tmp_path / "noise.json"
    recording.write_bytes(csv_of(TIME[:4000], force(8110, 4000)))
    assert main(["noise", str(recording), "--json", str(path)]) == 0
    document = json.loads(path.read_bytes())
    spoil(document["sensors"]["accelerometer"])
    path.write_text(json.dumps(document))
    with pytest.raises(RecordingError, match="is damaged or was edited by hand: ") as refused:
        read_noise(path)
    assert says in str(refused.value)
    assert "Error(" not in str(refused.value)


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        ([], "give a recording or --port"),
        (["missing.csv"], "there is no such file"),
        (["short.csv"], "too short"),
        (["text.csv"], "text.csv"),
    ],
)
def test_what_cannot_be_measured_is_refused_in_one_line(
    arguments: list[str],
    says: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("short.csv").write_bytes(csv_of(TIME[:100], force(8109, 100)))
    Path("text.csv").write_text("nothing of use\n" * 5)
    assert main(["noise", *arguments]) in (1, 2)
    said = capsys.readouterr().err
    assert says in said
    assert len(said.strip().splitlines()) == 1
