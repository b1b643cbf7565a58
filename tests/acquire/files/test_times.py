"""Clocks that wrap, jump, restart, stumble or are missing, in files as in streams."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire import column_guess
from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.acquire.intake import Intake
from imucal_wizard.core.errors import RecordingError
from imucal_wizard.core.limits.data_quality import RESTART_GAP_SECONDS
from imucal_wizard.core.readings import FloatArray, Readings, join_readings
from tests.acquire.files.lines import samples, write


def _ticks(count: int = 1000, step: float = 10_000.0) -> FloatArray:
    return np.arange(count, dtype=np.float64) * step


def _timed(tmp_path: Path, ticks: FloatArray, name: str, rate: float | None = None) -> Readings:
    """A recording at rest with these values in its column of time, or counter."""
    values = samples(len(ticks))[:, 1:4]
    rows = [
        ",".join([_printed(tick), *(f"{v:.6f}" for v in row)])
        for tick, row in zip(ticks.tolist(), values.tolist(), strict=True)
    ]
    path = tmp_path / "timed.csv"
    path.write_text("\n".join([f"{name},ax[m/s^2],ay[m/s^2],az[m/s^2]", *rows, ""]))
    return read_files([path], RecordingOptions(rate=rate))


def _printed(tick: float) -> str:
    return f"{tick:.0f}" if tick == int(tick) else f"{tick:.6f}"


def _told(readings: Readings, words: str) -> bool:
    return any(words in text for text in readings.warnings)


@pytest.mark.parametrize(("unit", "step"), [("us", 10_000.0), ("ms", 10.0)])
def test_a_clock_of_32_bits_that_wraps_is_put_together(
    tmp_path: Path, unit: str, step: float
) -> None:
    ticks = np.floor((_ticks(step=step) + 2.0**32 - 400 * step) % 2.0**32)
    readings = _timed(tmp_path, ticks, f"t[{unit}]")
    np.testing.assert_allclose(np.diff(readings.accelerometer.time), 0.01, rtol=1e-5, atol=1e-6)
    assert _told(readings, "counter was full")


@pytest.mark.parametrize("full", [2.0**32 / 1e6, 86_400.0])
def test_seconds_of_a_clock_that_was_full_or_passed_midnight_are_put_together(
    tmp_path: Path, full: float
) -> None:
    readings = _timed(tmp_path, (_ticks(step=0.01) + full - 4.0) % full, "t[s]")
    np.testing.assert_allclose(np.diff(readings.accelerometer.time), 0.01, atol=2e-6)
    assert _told(readings, "counter was full")


def test_milliseconds_without_leading_zeros_are_not_taken_for_decimals(tmp_path: Path) -> None:
    values = samples()[:, 1:4]
    stamps = [f"2025-6-28 7:50:{i // 100}.{i % 100 * 10}" for i in range(len(values))]
    rows = [f"0x50\t{s}\t" + "\t".join(map(str, v)) for s, v in zip(stamps, values, strict=True)]
    path = tmp_path / "wit.txt"
    path.write_text("\n".join(["address\ttime\tax(m/s²)\tay(m/s²)\taz(m/s²)", *rows, ""]))
    readings = read_files([path])
    np.testing.assert_allclose(np.diff(readings.accelerometer.time), 0.01, atol=1e-4)


def test_a_counter_of_16_bits_that_wraps_keeps_the_samples_that_are_missing(tmp_path: Path) -> None:
    numbers = np.delete((np.arange(1000.0) + 65_000) % 65_536, 200)
    readings = _timed(tmp_path, numbers, "counter", rate=100.0)
    assert readings.accelerometer.time[-1] == pytest.approx(9.99)
    assert _told(readings, "about 1 sample is missing in 1 gap,")


def test_single_wrong_times_are_left_out(tmp_path: Path) -> None:
    time = np.arange(100) / 100.0
    time[40], time[70] = 99.0, 0.0
    readings = _timed(tmp_path, time, "t[s]")
    assert len(readings) == 98
    assert np.all(np.diff(readings.accelerometer.time) > 0)
    assert 99.0 not in readings.accelerometer.time
    assert _told(readings, "2 of 100 lines do not fit")


def test_what_follows_a_restart_of_the_clock_is_set_after_a_gap(tmp_path: Path) -> None:
    time = np.concatenate([np.arange(500), np.arange(500)]) / 100.0
    readings = _timed(tmp_path, time, "t[s]")
    assert len(readings) == 1000
    steps = np.diff(readings.accelerometer.time)
    assert np.all(steps > 0)
    assert steps.max() == pytest.approx(RESTART_GAP_SECONDS)
    assert _told(readings, "has restarted")
    assert not _told(readings, "missing")


def _read_live(path: Path) -> tuple[Readings, tuple[str, ...]]:
    """The file as a stream, a line at a time."""
    intake = Intake()
    lines = path.read_bytes().splitlines(keepends=True)
    parts = [intake.feed(line, i / 100.0) for i, line in enumerate(lines)]
    return join_readings([one for one in (*parts, intake.flush()) if one]), intake.warnings


@pytest.mark.parametrize("first", [(1,), (0, 1), (0, 1, 2)])
@pytest.mark.parametrize("earlier", [0, 400])
def test_a_restart_after_few_rows_loses_none_in_a_file_and_in_a_stream(
    tmp_path: Path, first: tuple[int, ...], earlier: int
) -> None:
    """At the beginning, or after an earlier restart."""
    ticks = np.concatenate([np.arange(earlier), first, np.arange(600)])
    readings = _timed(tmp_path, ticks / 100.0, "t[s]")
    live, said = _read_live(tmp_path / "timed.csv")
    for one in (readings, live):
        assert len(one) == len(ticks)
    assert _told(readings, "has restarted")
    assert any("has restarted" in text for text in said)
    assert not _told(readings, "do not fit")


def test_rows_that_two_threads_wrote_are_sorted_in_a_file_and_in_a_stream(tmp_path: Path) -> None:
    """Neighbours in exchanged order are no missing samples."""
    time = np.arange(1000) / 100.0
    time[100::60], time[101::60] = time[101::60].copy(), time[100::60].copy()
    readings = _timed(tmp_path, time, "t[s]")
    live, said = _read_live(tmp_path / "timed.csv")
    for one in (readings, live):
        np.testing.assert_allclose(np.diff(one.accelerometer.time), 0.01, rtol=1e-6)
        assert len(one) == 1000
    np.testing.assert_array_equal(readings.accelerometer.values, live.accelerometer.values)
    assert _told(readings, "not in the order of their times: 15 rows came late; sorted")
    assert any("not in the order of their times; sorted" in text for text in said)
    assert not _told(readings, "missing")
    assert not _told(readings, "do not fit")


@pytest.mark.parametrize("later", [0, 2, 50, 200])
def test_rows_that_come_again_are_left_out_in_a_file_and_in_a_stream(
    tmp_path: Path, later: int
) -> None:
    """A copy, at once or up to seconds later, is neither a restart nor a wrong time."""
    whole = _timed(tmp_path, np.arange(1000) / 100.0, "t[s]")
    path = tmp_path / "timed.csv"
    lines = path.read_text().splitlines(keepends=True)
    for i in (700, 400):
        lines[i + later : i + later] = lines[i : i + 3]
    path.write_text("".join(lines))
    readings, (live, said) = read_files([path]), _read_live(path)
    for one in (readings, live):
        np.testing.assert_array_equal(one.accelerometer.values, whole.accelerometer.values)
        np.testing.assert_allclose(np.diff(one.accelerometer.time), 0.01, rtol=1e-6)
    assert _told(readings, "6 rows came twice")
    assert any("rows came twice" in text for text in said)
    assert not _told(readings, "restart")


def test_missing_samples_are_counted(tmp_path: Path) -> None:
    time = np.delete(np.arange(1000) / 100.0, slice(300, 350))
    assert _told(_timed(tmp_path, time, "t[s]"), "about 50 samples are missing in 1 gap,")


def test_times_of_a_coarse_clock_are_made_fine(tmp_path: Path) -> None:
    readings = _timed(tmp_path, np.floor(np.arange(1666) / 1.666), "t[ms]")
    steps = np.diff(readings.accelerometer.time)
    assert np.all(steps > 0)
    assert steps.mean() == pytest.approx(1 / 1666, rel=2e-3)


def test_times_of_arrival_are_told_from_loss(tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    time = np.cumsum(rng.choice([0.002, 0.03], 1000, p=[0.7, 0.3]))
    readings = _timed(tmp_path, time, "t[s]")
    assert _told(readings, "jitter")
    assert not _told(readings, "samples are missing")


def _in_bursts(rng: np.random.Generator, apart: float = 0.002) -> FloatArray:
    """Times at which samples of 100 Hz were read, some at a time, from a buffer of the link.

    Args:
        rng: for how many they are and how late.
        apart: time between two of them, s; 0 where all that come together have one time.
    """
    sizes = rng.integers(3, 9, 800)
    ends = np.cumsum(sizes)
    late = ends / 100.0 + rng.uniform(0.0, 0.008, len(ends))
    return np.concatenate(
        [end + apart * np.arange(1 - size, 1) for end, size in zip(late, sizes, strict=True)]
    )


@pytest.mark.parametrize("apart", [0.002, 0.0])
@pytest.mark.parametrize("header", ["t[s]", "t"])
def test_samples_that_arrived_in_bursts_are_spread_evenly(
    tmp_path: Path, header: str, apart: float
) -> None:
    time = _in_bursts(np.random.default_rng(4), apart)
    readings = _timed(tmp_path, time, header)
    assert len(readings) == len(time)
    own = readings.accelerometer.time
    assert np.diff(own).min() > 0.009
    assert readings.accelerometer.rate == pytest.approx(100.0, rel=2e-3)
    np.testing.assert_allclose(own - time, np.mean(own - time), atol=0.05)
    assert _told(readings, "spread evenly")
    assert not _told(readings, "missing")
    assert not _told(readings, "Hz")


def _shared(per_burst: int, rate: float, jitter: float) -> tuple[FloatArray, FloatArray]:
    """Host times of bursts that a host reads so late, s, and the true times of the samples."""
    count = max(6000, 40 * per_burst)
    true = 5.0 + np.arange(count // per_burst * per_burst) / rate
    ends = true[per_burst - 1 :: per_burst]
    late = np.abs(np.random.default_rng(7).normal(0.0, jitter, len(ends)))
    return np.repeat(np.maximum.accumulate(ends + late), per_burst), true


@pytest.mark.parametrize("rate", [25.0, 100.0, 1000.0])
@pytest.mark.parametrize("per_burst", [3, 8, 16, 25, 40, 64, 128])
@pytest.mark.parametrize("name", ["t[s]", "t[ms]"])
def test_samples_that_share_the_time_of_their_burst_are_spread_evenly(
    tmp_path: Path, rate: float, per_burst: int, name: str
) -> None:
    """The jitter of the reading is far below the time between two bursts, which may be seconds."""
    time, true = _shared(per_burst, rate, jitter=0.003)
    readings = _timed(tmp_path, np.floor(1e3 * time) if name == "t[ms]" else time, name)
    own = readings.accelerometer.time
    np.testing.assert_allclose(np.diff(own), 1.0 / rate, rtol=3e-3)
    np.testing.assert_allclose(own - true, np.mean(own - true), atol=0.01)
    assert np.mean(own - true) == pytest.approx(0.0, abs=0.01)
    assert _told(readings, "in bursts: the samples are spread evenly")
    assert not _told(readings, "missing")


@pytest.mark.parametrize("per_burst", [5, 16, 64])
@pytest.mark.parametrize("lost", [7, 40, 300])
def test_samples_that_are_missing_between_bursts_are_told(
    tmp_path: Path, per_burst: int, lost: int
) -> None:
    """The bursts that follow are all late; those that the host read too late are caught up."""
    time, true = _shared(per_burst, 100.0, jitter=0.002)
    kept = np.ones(len(time), bool)
    kept[40 * per_burst : 40 * per_burst + lost] = False
    late = time[30 * per_burst] + 0.08
    time[30 * per_burst :] = np.maximum(time[30 * per_burst :], late)
    readings = _timed(tmp_path, time[kept], "t[s]")
    own = readings.accelerometer.time
    assert _told(readings, f"about {lost} samples are missing in 1 gap")
    after = true[kept] > true[50 * per_burst]
    assert np.ptp((own - true[kept])[after]) < 0.01
    assert np.median(own - true[kept]) == pytest.approx(0.0, abs=0.01)


def test_rows_with_empty_fields_are_counted_in_bursts(tmp_path: Path) -> None:
    """The burst they came in shows their time like that of the others."""
    time, true = _shared(16, 100.0, jitter=0.002)
    values = samples(len(time))[:, 1:4]
    gone = np.random.default_rng(1).random(len(time)) < 0.1
    values[gone, 1] = np.nan
    write(tmp_path / "a.csv", np.column_stack([time, values]), "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]")
    readings = read_files([tmp_path / "a.csv"])
    np.testing.assert_allclose(readings.accelerometer.time, true[~gone], atol=0.01)
    assert _told(readings, "in bursts")


@pytest.mark.parametrize("jitter", [0.0, 0.002])
def test_bursts_go_on_where_the_time_of_day_passes_midnight(tmp_path: Path, jitter: float) -> None:
    time, _ = _shared(16, 100.0, jitter)
    readings = _timed(tmp_path, (time + 86_400.0 - 30.0) % 86_400.0, "t[s]")
    np.testing.assert_allclose(np.diff(readings.accelerometer.time), 0.01, rtol=1e-2)
    assert _told(readings, "counter was full")


@pytest.mark.parametrize("per_burst", [3, 16, 64])
def test_bursts_that_are_read_on_time_are_spread_evenly_and_not_said_to_jitter(
    tmp_path: Path, per_burst: int
) -> None:
    readings = _timed(tmp_path, _shared(per_burst, 100.0, jitter=0.0)[0], "t[s]")
    np.testing.assert_allclose(np.diff(readings.accelerometer.time), 0.01, rtol=1e-3)
    assert _told(readings, "Several samples share each time")
    assert not _told(readings, "jitter")
    assert not _told(readings, "missing")


@pytest.mark.parametrize("tick", [0.001, 1 / 64, 0.0156001])
@pytest.mark.parametrize("name", ["t[s]", "t[ms]"])
def test_times_of_a_coarse_clock_are_not_taken_for_those_of_bursts(
    tmp_path: Path, tick: float, name: str
) -> None:
    """Printed in milliseconds, the ticks of a computer's clock are 15 and 16."""
    ticks = np.floor(np.arange(6000) / 1666.0 / tick) * tick
    readings = _timed(tmp_path, np.floor(1e3 * ticks + 1e-6) if name == "t[ms]" else ticks, name)
    assert readings.accelerometer.rate == pytest.approx(1666.0, rel=5e-3)
    assert not readings.warnings


def test_a_stated_rate_holds_for_samples_that_arrived_in_bursts(tmp_path: Path) -> None:
    readings = _timed(tmp_path, _in_bursts(np.random.default_rng(4)), "t[s]", rate=100.0)
    np.testing.assert_allclose(np.diff(readings.accelerometer.time), 0.01)
    assert not _told(readings, "not used")


def test_three_gaps_are_no_pauses_between_bursts(tmp_path: Path) -> None:
    time = np.arange(3000) / 100.0
    for gap in (5, 20, 40):
        time[gap:] += 0.1
    readings = _timed(tmp_path, time, "t[s]")
    np.testing.assert_allclose(readings.accelerometer.time, time)


@pytest.mark.parametrize(
    ("step", "unit"),
    [(0.01, "s"), (10.0, "ms"), (1.0, "ms"), (0.6, "ms"), (10_000.0, "us"), (1e6, "ns")],
)
def test_the_unit_of_a_time_column_is_the_one_with_a_plausible_rate(step: float, unit: str) -> None:
    found = column_guess.guess_time_unit_by_rate(_ticks(step=step), None)
    assert found.unit == unit
    assert f"taken as {unit}" in found.why


def test_a_time_column_without_a_plausible_unit_is_asked_for(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"t\[ms\]"):
        _timed(tmp_path, _ticks(step=1e12), "t")


def test_a_rate_that_contradicts_the_times_is_not_used(tmp_path: Path) -> None:
    path = write(tmp_path / "a.csv", samples())
    readings = read_files([path], RecordingOptions(rate=50.0))
    assert readings.accelerometer.rate == pytest.approx(100.0)
    assert any("rate of 50 Hz was not used" in text for text in readings.warnings)


def test_a_time_of_day_is_the_time_where_there_is_no_better_one(tmp_path: Path) -> None:
    """As OpenLog Artemis prints it: date, time of day in hundredths, mg, deg/s, a last comma."""
    rows = [
        f"01/07/2000,16:{18 + n // 6000:02d}:{n % 6000 / 100:05.2f},{x:.2f},{y:.2f},{z + 1000:.2f},"
        for n, (x, y, z) in enumerate(np.random.default_rng(3).normal(0, 2, (400, 3)))
    ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["rtcDate,rtcTime,aX,aY,aZ,", *rows, ""]))
    readings = read_files([path])
    assert readings.accelerometer.rate == pytest.approx(100.0)
    assert readings.accelerometer.time[0] == pytest.approx(16 * 3600 + 18 * 60)
    assert np.median(readings.accelerometer.values[:, 2]) == pytest.approx(9.81, abs=0.01)


def test_samples_without_a_time_are_left_out(tmp_path: Path) -> None:
    values = samples()
    values[10, 0] = np.nan
    assert len(read_files([write(tmp_path / "a.csv", values)])) == 399


@pytest.mark.parametrize(
    ("time", "says"),
    [
        (np.zeros(200), "stands still at 0"),
        (np.arange(200)[::-1] / 100.0, "goes back in 100% of its steps"),
        (np.random.default_rng(1).permutation(200) / 100.0, "goes back in"),
    ],
)
def test_an_unusable_time_column_is_refused_or_replaced_by_the_rate(
    tmp_path: Path, time: FloatArray, says: str
) -> None:
    with pytest.raises(RecordingError, match=says):
        _timed(tmp_path, time, "t[s]")
    readings = _timed(tmp_path, time, "t[s]", rate=100.0)
    np.testing.assert_allclose(np.diff(readings.accelerometer.time), 0.01)
    assert _told(readings, says)


def test_a_time_column_that_goes_back_asks_which_column_it_is_and_shows_the_present_order(
    tmp_path: Path,
) -> None:
    """Also if a line is cut off, which alone would ask for the columns."""
    place, values = tmp_path / "a.csv", samples()
    write(place, values[:, [1, 0, *range(2, values.shape[1])]])
    lines = place.read_text().splitlines()
    place.write_text("\n".join([*lines[:3], "0.1,9.7", *lines[3:]]))
    with pytest.raises(RecordingError, match="Check which column is the time, or give") as raised:
        read_files([place])
    columns, rate = raised.value.settings
    assert columns.startswith("columns t,ax,ay")
    assert rate == "rate 100"


def test_a_clock_that_was_set_has_not_lost_a_thousand_million_samples(tmp_path: Path) -> None:
    time = np.arange(200) / 100.0
    time[100:] += 1e7
    readings = _timed(tmp_path, time, "t[s]")
    assert _told(readings, "jumped by more than an hour")
    assert not _told(readings, "missing")


@pytest.mark.parametrize(("unit", "step"), [("us", 0.01), ("s", 100.0)])
def test_a_unit_of_time_that_cannot_be_is_refused(tmp_path: Path, unit: str, step: float) -> None:
    with pytest.raises(RecordingError, match=f"column in {unit} would mean"):
        _timed(tmp_path, _ticks(step=step), f"t[{unit}]")


def test_many_samples_that_are_missing_are_no_jitter(tmp_path: Path) -> None:
    time = np.delete(np.arange(2000) / 100.0, np.random.default_rng(0).integers(0, 2000, 300))
    readings = _timed(tmp_path, time, "t[s]")
    assert _told(readings, "samples are missing in")
    assert not _told(readings, "jitter")


def test_the_times_of_a_clock_that_counts_from_1970_begin_with_the_first_sample(
    tmp_path: Path,
) -> None:
    """A message names a moment of the recording, not one of the century."""
    values = samples(1000)
    values[:, 0] += 1.7e9
    readings = read_files([write(tmp_path / "a.csv", values)])
    assert readings.accelerometer.time[0] == 0.0
    np.testing.assert_allclose(np.diff(readings.accelerometer.time), 0.01, atol=1e-6)
