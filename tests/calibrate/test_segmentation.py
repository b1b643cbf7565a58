"""Holds and rotations found in whole recordings, against the motion that truly was."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from scipy.ndimage import uniform_filter1d

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.notices import NoticeKind
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.fit_warnings import rotation_warnings
from imucal_wizard.estimate.hold_search import find_holds
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.measurement import segmentation
from imucal_wizard.measurement.blocks import Blocks
from imucal_wizard.measurement.gaps import error_across_gaps
from imucal_wizard.measurement.holds import Hold, hold_at_rest
from imucal_wizard.measurement.segmentation import (
    ReducedRecording,
    holds_under,
    reduce_recording,
    rest_numbers,
    rests_apart,
    rotations_between,
    usual_candidates,
)
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.recording import recording_script
from tests.calibrate.sessions import RATE, session, true, with_accelerometer, with_gyroscope


def _moving(seed: int = 0) -> FloatArray:
    """Times at which the device truly turned."""
    hand = VirtualHand(RATE, seed)
    chance = np.random.default_rng([seed, 5])
    hand.perform(recording_script("18", chance, hold=4.0, rotations=6))
    times = []
    while count := hand.remaining(4096):
        motion = hand.advance(count)
        times.append(motion.time[np.linalg.norm(motion.rate, axis=1) > np.radians(0.5)])
    return np.concatenate(times)


def holds_at(stream: ReducedRecording, variance_factor: float) -> list[Hold]:
    """The holds under limits at this multiple of the quietest variance."""
    return holds_under(stream, stream.noise.limits(float(np.sqrt(variance_factor))))


def _gyroscope(readings: Readings) -> Series:
    assert readings.gyroscope is not None
    return readings.gyroscope


@pytest.mark.parametrize("factor", [3.0, 16.0, 128.0])
def test_no_hold_contains_motion(factor: float) -> None:
    """Under strict limits and loose ones; guards keep clear of the ends of a turn."""
    stream = reduce_recording(session())
    assert stream is not None
    moving = _moving()
    for hold in holds_at(stream, factor):
        assert not ((moving >= hold.start) & (moving < hold.end)).any()


def test_every_rest_is_a_hold_and_nearly_all_of_it_is_kept(plain: FitReport) -> None:
    """One first rest, eighteen poses, three starts and eighteen turns: forty holds."""
    assert len(plain.holds) == 40
    kept = sum(hold.end - hold.start for hold in plain.holds)
    moving = np.unique(np.round(_moving() * RATE)) / RATE
    resting = session().accelerometer.time[-1] - len(moving) / RATE
    assert kept > 0.85 * resting


def test_every_motion_between_holds_is_a_rotation() -> None:
    """Each begins and ends in the holds beside it and holds all samples between."""
    readings = session()
    stream = reduce_recording(readings)
    assert stream is not None
    holds = holds_at(stream, 16.0)
    rotations = rotations_between(holds, _gyroscope(readings), readings.accelerometer)
    assert len(rotations) == len(holds) - 1
    for rotation in rotations:
        assert rotation.problem is None
        assert rotation.before.start < rotation.time[0] <= rotation.before.end
        assert rotation.after.start <= rotation.time[-1] < rotation.after.end
        assert np.diff(rotation.time).max() < 1.5 / RATE


def test_the_motions_between_poses_alone_calibrate_a_gyroscope() -> None:
    """Nobody has to turn it on purpose: from pose to pose it turns about all axes."""
    fit = fit_readings(session(rotations=0)).sensors["gyroscope"]
    assert all(parameter.carried for parameter in fit.parameters)
    assert fit.covariance is not None
    off = (fit.matrix - true().gyroscope_matrix).ravel()
    assert (np.abs(off) < 4.0 * np.sqrt(np.diag(fit.covariance)[:9])).all()


def test_slabs_change_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """Cut into pieces of any size for the sake of memory: the same holds to the last bit."""
    whole = reduce_recording(session())
    monkeypatch.setattr(segmentation, "SAMPLES_PER_SLAB", 777)
    pieces = reduce_recording(session())
    assert whole is not None
    assert pieces is not None
    for one, two in zip(holds_at(whole, 16.0), holds_at(pieces, 16.0), strict=True):
        assert (one.start, one.end) == (two.start, two.end)
        assert (one.accelerometer == two.accelerometer).all()
        assert (one.accelerometer_covariance == two.accelerometer_covariance).all()


@pytest.mark.parametrize("tremor", [0.005, 0.02, 0.08])
def test_the_limit_follows_what_the_hand_does(tremor: float) -> None:
    """Vibration from some time on, many times the quietest noise: the poses are found too."""
    rng = np.random.default_rng(0)

    def shake(values: FloatArray) -> FloatArray:
        half = len(values) // 4
        values[half:] += tremor * rng.standard_normal(values[half:].shape)
        return values

    report = fit_readings(with_accelerometer(session(), shake))
    assert len({hold.pose for hold in report.holds if hold.pose}) == 18
    assert len(report.holds) >= 36


def test_each_rest_is_summarised_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """For the holds under every limit, and for the rests in which the gyroscope reads otherwise."""
    seen: list[tuple[float, float]] = []

    def counted(blocks: Blocks, *rest: object) -> Hold | None:
        seen.append((float(blocks.start[0]), float(blocks.end[-1])))
        return hold_at_rest(blocks, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(segmentation, "hold_at_rest", counted)
    stream = reduce_recording(session())
    assert stream is not None
    holds = holds_at(stream, 16.0)
    assert rests_apart(stream, holds) == []
    assert len(seen) == len(set(seen)) >= len(holds)


def test_candidates_are_all_different_and_grow() -> None:
    """From the strictest limit to the loosest; a limit that changes nothing is not repeated."""
    stream = reduce_recording(session())
    assert stream is not None
    found = list(usual_candidates(stream))
    factors = [factor for factor, _ in found]
    assert factors == sorted(factors)
    keys = {tuple((hold.start, hold.end) for hold in holds) for _, holds in found}
    assert len(keys) == len(found)


def test_a_gap_spoils_the_rotation_it_lies_in_and_no_other(plain: FitReport) -> None:
    """Half a second of samples is missing in a turn: its angle is not known."""
    readings = session()
    gyroscope = _gyroscope(readings)
    turn = next(one for one in plain.rotations if len(one.time) > 200 and one.axis == "x")
    middle = 0.5 * (turn.time[0] + turn.time[-1])
    keep = np.abs(gyroscope.time - middle) > 0.25
    series = readings.accelerometer
    torn = Readings(
        replace(series, time=series.time[keep], values=series.values[keep]),
        replace(gyroscope, time=gyroscope.time[keep], values=gyroscope.values[keep]),
    )
    faulty = [one for one in fit_readings(torn).rotations if one.problem]
    assert len(faulty) == 1
    assert "gap of 0.5" in (faulty[0].problem or "")
    assert faulty[0].time[0] < middle < faulty[0].time[-1]


def _with_gaps(plain: FitReport, samples: int) -> Readings:
    """The session without so many samples in the middle of each rotation of its fit."""
    readings = session()
    gyroscope, kept = _gyroscope(readings), np.ones(len(readings), bool)
    for turn in plain.rotations:
        middle = int(np.searchsorted(gyroscope.time, 0.5 * (turn.time[0] + turn.time[-1])))
        kept[middle : middle + samples] = False
    series = readings.accelerometer
    return Readings(
        replace(series, time=series.time[kept], values=series.values[kept]),
        replace(gyroscope, time=gyroscope.time[kept], values=gyroscope.values[kept]),
    )


@pytest.mark.parametrize("lost", [0.12, 0.3])
def test_single_rows_that_are_missing_in_a_rest_do_not_break_it(
    plain: FitReport, lost: float
) -> None:
    """Often several of them follow one another, and their holds are as good as whole ones."""
    readings = session()
    kept = np.random.default_rng(3).random(len(readings)) >= lost
    both = readings.accelerometer, _gyroscope(readings)
    left, rates = (Series(one.time[kept], one.values[kept], one.unit) for one in both)
    report = fit_readings(Readings(left, rates))
    assert len(report.holds) == len(plain.holds)
    before, after = plain.sensors["accelerometer"], report.sensors["accelerometer"]
    for old, new in zip(before.parameters, after.parameters, strict=True):
        assert abs(new.value - old.value) < 3.0 * (new.standard_error or 0.0)


def test_a_gap_of_two_samples_costs_no_rotation(plain: FitReport) -> None:
    """The rate changes little in 30 ms; in a fifth of a second it may do anything."""
    torn = fit_readings(_with_gaps(plain, 2))
    assert len(torn.rotations) == len(plain.rotations)
    assert [one.problem for one in torn.rotations] == [None] * len(plain.rotations)
    before, after = plain.sensors["gyroscope"], torn.sensors["gyroscope"]
    assert after.floor is not None
    assert before.floor is not None
    assert before.floor < after.floor < 1.1 * before.floor
    for old, new in zip(before.parameters, after.parameters, strict=True):
        assert abs(new.value - old.value) < 0.5 * (old.standard_error or 0.0)
    spoilt = fit_readings(_with_gaps(plain, 20)).rotations
    assert all("gap of 0.2" in (one.problem or "") for one in spoilt)


def test_the_rates_around_a_gap_show_what_it_costs() -> None:
    """Of turns and noise that are drawn anew, the integral across a gap is as wrong as is said."""
    rng, errors, said = np.random.default_rng(5), [], []
    for _ in range(40):
        time = np.arange(120) / RATE
        turn = np.sin(np.pi * time / time[-1]) ** 2 * rng.uniform(1.0, 3.0)
        tremor = 0.05 * np.sin(2.0 * np.pi * rng.uniform(6.0, 10.0) * time + rng.uniform(0.0, 6.0))
        rate = (turn + tremor)[:, None] * np.ones(3) + 0.002 * rng.standard_normal((120, 3))
        kept = np.ones(120, bool)
        first = int(rng.integers(40, 75))
        kept[first : first + 4] = False
        whole, left = (
            CubicSpline(time[rows], rate[rows]).integrate(0.0, time[-1])
            for rows in (np.ones(120, bool), kept)
        )
        errors.append(left - whole)
        said.append(error_across_gaps(time[kept], rate[kept], 1.0 / RATE))
    assert np.mean(np.square(errors)) == pytest.approx(np.mean(said), rel=0.5)


def test_gaps_of_any_length_are_one_reason(plain: FitReport) -> None:
    """What was said of them is counted by what it is about, and other reasons by their words."""
    stream = session()
    time, cut = stream.accelerometer.time, np.zeros(len(stream), bool)
    for one, seconds in zip(plain.rotations, (0.3, 0.5), strict=False):
        middle = 0.5 * (one.time[0] + one.time[-1])
        cut |= (time > middle) & (time < middle + seconds)
    own = stream.accelerometer
    left = Series(time[~cut], own.values[~cut], own.unit)
    gyroscope = Series(time[~cut], _gyroscope(stream).values[~cut], "rad/s")
    holds = plain.holds
    first, second, *others = rotations_between(holds, gyroscope, left)
    assert first.problem != second.problem
    others[0] = replace(others[0], problem="it was 2 of 3")
    others[1] = replace(others[1], problem="it was 3 of 3")
    (said,) = rotation_warnings([first, second, *others])
    assert "4 of" in said
    longer = str(second.problem).partition(":")[0].replace("gap of", "gap of up to")
    assert f"{longer} (2 times)" in said
    assert "it was 2 of 3 (once), it was 3 of 3 (once)" in said


def test_sensors_may_have_their_own_rates(plain: FitReport) -> None:
    """A gyroscope at 200 samples per second with its own times beside an accelerometer at 100."""
    readings = session()
    gyroscope = _gyroscope(readings)
    time = np.arange(2 * len(gyroscope)) / (2.0 * RATE) + 0.0013
    values = np.column_stack([np.interp(time, gyroscope.time, y) for y in gyroscope.values.T])
    report = fit_readings(replace(readings, gyroscope=Series(time, values, "rad/s")))
    assert report.rates == pytest.approx({"accelerometer": 100.0, "gyroscope": 200.0})
    assert len(report.holds) == pytest.approx(len(plain.holds), abs=2)
    there, here = report.sensors["gyroscope"], plain.sensors["gyroscope"]
    assert np.abs(there.matrix - here.matrix).max() < 5e-4


def test_where_the_gyroscope_is_missing_it_says_nothing(plain: FitReport) -> None:
    """It stops after two thirds: its last reading is not one at rest of the holds after that."""
    readings = session()
    gyroscope = _gyroscope(readings)
    end = float(gyroscope.time[2 * len(gyroscope) // 3])
    report = fit_readings(replace(readings, gyroscope=gyroscope.between(-np.inf, end)))
    assert len(report.holds) == pytest.approx(len(plain.holds), abs=2)
    for hold in report.holds:
        assert (hold.gyroscope is None) == (0.5 * (hold.start + hold.end) > end)
    there, here = report.sensors["gyroscope"], plain.sensors["gyroscope"]
    for axis, moved in zip("xyz", there.bias - here.bias, strict=True):
        error = next(one.standard_error for one in there.parameters if one.name == f"bias_{axis}")
        assert error is not None
        assert abs(moved) < 4.0 * error


def test_a_disturbance_in_one_rest_is_no_rotation(plain: FitReport) -> None:
    """A knock of 0.2 s splits the hold; between its halves nothing turned."""
    hold = max(plain.holds[1:], key=lambda one: one.end - one.start)
    middle = 0.5 * (hold.start + hold.end)

    def knock(values: FloatArray) -> FloatArray:
        first = int(middle * RATE)
        values[first : first + 20] += 0.5 * np.sin(np.arange(20))[:, None]
        return values

    report = fit_readings(with_accelerometer(session(), knock))
    assert len(report.rotations) == len(plain.rotations)


def _turned_in_a_rest(plain: FitReport, seconds: float, rate: float) -> tuple[Readings, slice]:
    """The device turns about the vertical in the middle of the session's longest rest, and where.

    The accelerometer does not see it.
    """
    readings = session()
    rest = max(plain.holds, key=lambda one: one.end - one.start)
    first = np.searchsorted(readings.accelerometer.time, 0.5 * (rest.start + rest.end - seconds))
    rows = slice(int(first), int(first) + round(seconds * RATE))
    up = rest.accelerometer / np.linalg.norm(rest.accelerometer)

    def turn(values: FloatArray) -> FloatArray:
        values[rows] += np.radians(rate) * up
        return values

    return with_gyroscope(readings, turn), rows


def test_a_turn_about_the_vertical_is_no_rest_in_which_the_bias_jumped(plain: FitReport) -> None:
    """A circle for the magnetometer: afterwards, the gyroscope reads its usual mean again."""
    readings, _ = _turned_in_a_rest(plain, 4.0, 30.0)
    report = fit_readings(readings)
    assert len(report.holds) > len(plain.holds)
    assert not report.warned("gyroscope", NoticeKind.RESTS_LEFT_OUT)


@pytest.mark.parametrize("end", ["after another", "at rest again"])
def test_a_turn_about_the_vertical_may_be_the_last_motion(plain: FitReport, end: str) -> None:
    """No hold follows it, so that nothing but what is before shows that the bias has not jumped."""
    readings = session()
    if end == "after another":
        readings, _ = _turned_in_a_rest(plain, 4.0, 30.0)
    last = plain.holds[-1]
    up = last.accelerometer / np.linalg.norm(last.accelerometer)
    first, past = (round(RATE * one) for one in (last.start + 1.5, last.start + 4.0))

    def turn(values: FloatArray) -> FloatArray:
        values[first:past] += np.radians(30.0) * up
        return values

    seconds = (past + (0 if end == "after another" else 60)) / RATE
    both = with_gyroscope(readings, turn)
    cut = Readings(both.accelerometer.between(0.0, seconds), _gyroscope(both).between(0.0, seconds))
    stream = reduce_recording(cut)
    assert stream is not None
    holds = holds_at(stream, 16.0)
    assert holds[-1].end < first / RATE + 0.5
    assert rests_apart(stream, holds) == []
    # 2 °/s along x in the second half are no turns, and the circles are none of its rests
    half = 0.5 * seconds

    def jump(values: FloatArray) -> FloatArray:
        values[round(half * RATE) :, 0] += np.radians(2.0)
        return values

    jumped = reduce_recording(with_gyroscope(cut, jump))
    assert jumped is not None
    apart = rests_apart(jumped, [one for one in holds if one.end < half])
    assert len(apart) > 5
    assert min(one.start for one in apart) > half - 0.5


def test_a_turn_that_is_quieter_than_the_holds_is_not_the_rest_of_the_gyroscope(
    plain: FitReport,
) -> None:
    """Held in the hand, turned on a table: no hold has the rate of the turn, so none was found."""
    turned, rows = _turned_in_a_rest(plain, 4.0, 30.0)
    rng = np.random.default_rng(2)

    def tremble(values: FloatArray) -> FloatArray:
        tremor = 0.05 * rng.standard_normal(values.shape)
        tremor[rows] = 0.0
        return values + tremor

    report = fit_readings(with_gyroscope(with_accelerometer(turned, tremble), tremble))
    assert len({hold.pose for hold in report.holds if hold.pose}) == 18


def test_the_parts_of_a_rest_have_one_number() -> None:
    """Whether two holds are one rest: by what lies between them, in time and in direction."""
    stream = reduce_recording(session())
    assert stream is not None
    whole = holds_at(stream, 16.0)
    long = max(whole, key=lambda one: one.end - one.start)
    place = whole.index(long)
    middle = 0.5 * (long.start + long.end)
    parts = [replace(long, end=middle - 0.3), replace(long, start=middle + 0.3)]
    numbers = rest_numbers([*whole[:place], *parts, *whole[place + 1 :]])
    assert numbers[place] == numbers[place + 1]
    assert len(set(numbers)) == len(whole)
    assert rest_numbers([]).dtype == np.int64


def test_a_hold_of_one_block_has_nothing_between_blocks() -> None:
    """At two samples a second few of the rests are found, and the fit says so."""
    with pytest.raises(DataError, match="still positions"):
        fit_readings(session(1, rotations=2, hold=6.0, rate=2.0))


@pytest.mark.parametrize("count", [0, 3, 150])
def test_nothing_is_found_in_nothing(count: int) -> None:
    """No sample, less than a block, and less than two seconds: no noise to go by."""
    series = session().accelerometer
    few = Readings(replace(series, time=series.time[:count], values=series.values[:count]))
    assert reduce_recording(few) is None


def test_a_constant_reading_has_no_noise_and_no_division_by_it() -> None:
    """A dead device is still, and that is all."""
    dead = with_accelerometer(with_gyroscope(session(), np.zeros_like), np.zeros_like)
    stream = reduce_recording(dead)
    assert stream is not None
    assert len(holds_at(stream, 16.0)) == 1


@pytest.mark.parametrize(("unit", "size"), [("rad/s", 1.0), ("count", 4000.0)])
def test_a_gyroscope_that_feels_gravity_hides_no_rest(
    plain: FitReport, unit: str, size: float
) -> None:
    """0.2 °/s per g is far above the noise of a quiet gyroscope, and no rotation."""
    readings = session()
    gyroscope, force = readings.gyroscope, readings.accelerometer.values / STANDARD_GRAVITY
    assert gyroscope is not None
    quiet = uniform_filter1d(gyroscope.values, 9, axis=0)
    felt = size * (quiet + np.radians(0.2) * force[:, [1, 2, 0]])
    report = fit_readings(replace(readings, gyroscope=Series(gyroscope.time, felt, unit)))
    assert len(report.holds) == len(plain.holds)
    assert report.warnings == ()


def test_without_a_gyroscope_a_stretch_far_noisier_than_the_rests_is_no_hold() -> None:
    """A slow turn about the vertical pushes the device to and fro; its mean shows gravity hardly.

    Thirty times the noise of the others, it set the floor and the interval of the error held out.
    """
    readings = session()
    usual = find_holds(readings, STANDARD_GRAVITY)[0]
    pushed = usual[10]
    series = readings.accelerometer
    own = (series.time >= pushed.start) & (series.time < pushed.end)
    push = uniform_filter1d(np.random.default_rng(1).standard_normal((own.sum(), 3)), 20, axis=0)
    values = series.values.copy()
    values[own] += 0.2 * (push - push.mean(axis=0))
    alone = Readings(replace(series, values=values), None)
    holds = find_holds(alone, STANDARD_GRAVITY)[0]
    assert len(holds) == len(usual) - 1
    assert not any(one.start < pushed.end and pushed.start < one.end for one in holds)
