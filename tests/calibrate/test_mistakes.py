"""Spoilt recordings: each mistake is named, and what is not spoilt is still right."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.limits.data_quality import RESTART_GAP_SECONDS
from imucal_wizard.core.notices import NoticeKind
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.survey import diagnose_benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.fit_warnings import exchanged_axes, unit_notes
from imucal_wizard.estimate.gyroscope_report import silent_axes
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.estimate.rotation_set import examined
from imucal_wizard.measurement.data_quality import check_recording, missing_samples
from imucal_wizard.measurement.holds import Rotation
from imucal_wizard.measurement.rounding import in_steps, resolution_of
from tests.calibrate.sessions import at_rate, session, true, with_accelerometer, with_gyroscope

pytestmark = pytest.mark.usefixtures("no_sizes_throughout")


def _during(readings: Readings, start: float, end: float) -> slice:
    first, last = np.searchsorted(readings.accelerometer.time, (start, end))
    return slice(int(first), int(last))


def _warned(report: FitReport, *words: str) -> bool:
    notes = report.notes(judged=False)
    return any(all(word in warning for word in words) for warning in notes)


def test_a_good_recording_is_fitted_to_its_noise(plain: FitReport) -> None:
    """Every parameter within 4.5 standard errors of the truth, and nothing to warn of."""
    assert plain.warnings == ()
    truth = true()
    for name, matrix, bias in (
        ("accelerometer", truth.accelerometer_matrix, truth.accelerometer_bias),
        ("gyroscope", truth.gyroscope_matrix, truth.gyroscope_bias),
    ):
        fit = plain.sensors[name]
        errors = {p.name: p.standard_error or 0.0 for p in fit.parameters}
        for axis in range(3):
            letter = "xyz"[axis]
            assert abs(fit.bias[axis] - bias[axis]) < 4.5 * errors[f"bias_{letter}"]
            off = 1.0 / fit.matrix[axis, axis] - 1.0 / matrix[axis, axis]
            assert abs(off) < 4.5 * errors[f"sensitivity_{letter}"]
        assert np.abs(fit.matrix - matrix).max() < 6e-4


def test_raw_counts_are_fitted_as_well() -> None:
    """The same sensor through a 16-bit converter around 32768."""
    report = fit_readings(session(counts=True))
    truth = true(counts=True)
    gains = {"accelerometer": 415.0, "gyroscope": 4778.0}
    known = {
        "accelerometer": truth.accelerometer_matrix,
        "gyroscope": truth.gyroscope_matrix,
    }
    for name, gain in gains.items():
        assert np.abs(report.sensors[name].matrix - known[name]).max() * gain < 6e-4
    assert report.warnings == ()


def test_one_disturbed_hold_is_named_and_kept(plain: FitReport) -> None:
    """Something pushed it by 6 mg: measure it again; nothing is thrown away unasked."""
    hold = next(one for one in plain.holds if one.pose == "+x+y")

    def push(values: FloatArray) -> FloatArray:
        values[_during(session(), hold.start - 0.3, hold.end + 0.3)] += 0.06 * np.array([1, 1, 0])
        return values

    report = fit_readings(with_accelerometer(session(), push))
    assert _warned(report, "hold", "does not agree", f"{hold.start:.1f}", "+x+y", "again")
    (suspect,) = report.sensors["accelerometer"].suspects
    assert report.holds[suspect].pose == "+x+y"
    assert len(report.holds) == len(plain.holds)


def test_one_bad_rotation_is_named(plain: FitReport) -> None:
    """A tenth of a second of rates went missing as zeros in the middle of a turn."""
    turn = next(one for one in plain.rotations if one.axis == "y" and len(one.time) > 150)
    middle = float(turn.time[len(turn.time) // 2])

    def lose(values: FloatArray) -> FloatArray:
        values[_during(session(), middle, middle + 0.1)] = 0.0
        return values

    report = fit_readings(with_gyroscope(session(), lose))
    (bad,) = [one for one in report.rotations if one.problem]
    assert bad.time[0] == turn.time[0]
    assert _warned(report, "rotation", "the rate jumps", f"at {middle:.1f} s", "missing")


def test_swapped_gyroscope_axes_are_told() -> None:
    """The matrix puts them right, and the user hears which is which."""
    report = fit_readings(with_gyroscope(session(), lambda y: y[:, [1, 0, 2]]))
    assert _warned(report, "axes", "+y, +x, +z")
    expected = true().gyroscope_matrix[:, [1, 0, 2]]
    fit = report.sensors["gyroscope"]
    assert np.abs(fit.matrix - expected).max() < 6e-4
    values = {p.name: p.value for p in fit.parameters}
    assert values["sensitivity_x"] == pytest.approx(1.0 / fit.matrix[0, 1], rel=1e-9)
    assert [row.vector_scale for row in report.comparison] == pytest.approx(
        [expected[0, 1], expected[1, 0], expected[2, 2]], abs=6e-4
    )
    assert report.comparison[0].static_scale == pytest.approx(expected[0, 1], rel=0.01)


def test_a_negated_gyroscope_axis_is_told() -> None:
    """Sign and all."""
    report = fit_readings(with_gyroscope(session(), lambda y: y * [1.0, 1.0, -1.0]))
    assert _warned(report, "axes", "+x, +y, -z", "No mounting does this: one axis is mirrored")


def test_a_mirrored_accelerometer_axis_shows_in_the_gyroscope() -> None:
    """Its magnitude cannot show it; gravity then turns the other way than the rates say."""
    report = fit_readings(with_accelerometer(session(), lambda y: y * [1.0, 1.0, -1.0]))
    assert _warned(report, "-x, -y, +z, or the accelerometer's from +x, +y, -z")
    assert (report.sensors["accelerometer"].rms_held_out or 1.0) < 0.01


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_axes_of_the_accelerometer_that_are_exchanged_are_not_put_on_the_gyroscope(
    sign: float,
) -> None:
    """With and without a sign: the two sensors alone do not tell which of them it is."""
    report = fit_readings(
        with_accelerometer(session(), lambda y: y[:, [1, 0, 2]] * [1.0, sign, 1.0])
    )
    own = "+y, +x, +z" if sign > 0.0 else "-y, +x, +z"
    assert _warned(report, f"or the accelerometer's from {own}", "do not tell which of the two")


def test_a_third_sensor_tells_whose_axes_are_exchanged() -> None:
    """Where it lies as one of the two does; a magnetometer with axes of its own tells nothing."""
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    (both,) = exchanged_axes(quarter)
    assert "do not tell which of the two" in both
    assert exchanged_axes(quarter, np.diag([1.0, -1.0, -1.0])) == [both]
    (gyroscope,) = exchanged_axes(quarter, np.eye(3))
    assert "take its x, y, z from -y, +x, +z. Check the wiring" in gyroscope
    assert gyroscope.startswith("the gyroscope's axes")
    (accelerometer,) = exchanged_axes(quarter, quarter)
    assert accelerometer.startswith("the accelerometer's axes do not match those of the gyroscope")
    assert "from +y, -x, +z or from -y, +x, -z" in accelerometer
    (mirrored,) = exchanged_axes(quarter[:, [1, 0, 2]], np.eye(3))
    assert mirrored.startswith("the gyroscope's axes")


def test_a_device_with_one_axis_mirrored_in_both_sensors_is_told() -> None:
    """A rate is an axial vector: all three rates then seem to have the wrong sign."""

    def mirrored(y: FloatArray) -> FloatArray:
        return y * [1.0, -1.0, 1.0]

    report = fit_readings(with_gyroscope(with_accelerometer(session(), mirrored), mirrored))
    assert _warned(report, "-x, -y, -z", "one axis of both sensors is mirrored")


@pytest.mark.parametrize(
    ("factor", "word"),
    [
        (180.0 / np.pi, "in deg/s and were taken for rad/s"),
        (np.pi / 180.0, "in rad/s and were taken for deg/s"),
        (1e3, "thousandths"),
        (1.0 / 3.0, "the sampling rate is about 33 Hz instead of 100 Hz"),
        (1.0 / 12.0, "the sampling rate is about 8."),
        (1.7, "the sampling rate is about 170 Hz"),
        (0.25, "the range set in the device is 4 times wider"),
        (2.0, "the range set in the device is 2 times narrower"),
    ],
)
def test_a_wrong_unit_of_rate_is_told(factor: float, word: str) -> None:
    """Readings in degrees that were taken for radians, and the like."""
    report = fit_readings(with_gyroscope(session(), lambda y: y * factor))
    assert _warned(report, word)
    scale = np.diag(report.sensors["gyroscope"].matrix) * factor
    assert scale == pytest.approx(np.diag(true().gyroscope_matrix), rel=2e-3)


@pytest.mark.parametrize(
    ("unit", "factor"),
    [
        ("g", 1.0 / STANDARD_GRAVITY),
        ("mg", 1000.0 / STANDARD_GRAVITY),
        ("m/s^2", STANDARD_GRAVITY),
    ],
)
def test_a_wrong_unit_of_acceleration_is_told(unit: str, factor: float) -> None:
    """Gravity of 1, of 1000 or of 96: the readings are in g, in mg, or in m/s² after all."""
    report = fit_readings(with_accelerometer(session(), lambda y: y * factor))
    assert _warned(report, f"in {unit};", f"give {unit} as their unit")
    assert (
        np.abs(report.sensors["accelerometer"].matrix * factor - true().accelerometer_matrix).max()
        < 6e-4
    )


@pytest.mark.parametrize(
    ("factor", "word"), [(2.0, "Hz instead of 200 Hz"), (0.5, "Hz instead of 50 Hz")]
)
def test_a_wrong_sampling_rate_is_told(factor: float, word: str) -> None:
    """Time half as long or twice: every angle is wrong by that."""
    report = fit_readings(at_rate(session(), factor))
    assert _warned(report, word)


def test_a_dead_accelerometer_axis_is_refused() -> None:
    """Named, with what to check."""
    with pytest.raises(DataError, match="axis y"):
        fit_readings(with_accelerometer(session(), lambda y: y * [1.0, 0.0, 1.0]))


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_rates_of_another_recording_are_refused(seed: int) -> None:
    """Twelve parameters always explain a little; no axis, unit or rate is to blame for it."""
    other = session(seed).gyroscope
    assert other is not None

    def exchange(values: FloatArray) -> FloatArray:
        count = min(len(values), len(other.values))
        values[:count] = other.values[:count]
        return values

    report = fit_readings(with_gyroscope(session(), exchange))
    assert set(report.sensors) == {"accelerometer"}
    assert not _warned(report, "match the accelerometer's")
    assert not _warned(report, "which no sensor")


def test_rates_that_are_wrong_now_and_then_are_not_blamed_on_the_hand_alone() -> None:
    """One sample in two thousand is off by degrees per second, at rest and in motion."""
    rng = np.random.default_rng(5)

    def spoil(values: FloatArray) -> FloatArray:
        wrong = rng.random(values.shape) < 5e-4
        return values + wrong * rng.normal(0.0, np.radians(8.0), values.shape)

    assert _warned(fit_readings(with_gyroscope(session(), spoil)), "single readings are wrong")


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_a_dead_gyroscope_axis_is_named_and_nothing_is_fitted(noise: float) -> None:
    """It reads the same in motion as at rest, noisy or not; every closure lacks it."""
    rng = np.random.default_rng(0)

    def kill(values: FloatArray) -> FloatArray:
        values[:, 1] = 0.004 + noise * rng.standard_normal(len(values))
        return values

    report = fit_readings(with_gyroscope(session(), kill))
    assert _warned(report, "gyroscope axis y", "dead")
    assert set(report.sensors) == {"accelerometer"}


@pytest.mark.parametrize("reading", [-999.0, 8.7])
@pytest.mark.parametrize("times", [1, 2])
def test_a_wild_reading_costs_its_rotation_only(reading: float, times: int) -> None:
    """A line that was damaged, or a transfer that failed: three samples of ten thousand.

    A gyroscope that is slower than the lines repeats them.
    """
    rng = np.random.default_rng(4)

    def spoil(values: FloatArray) -> FloatArray:
        measured = values[::times].copy()
        measured[rng.choice(len(measured), 3, replace=False), 0] = reading
        return np.asarray(np.repeat(measured, times, axis=0)[: len(values)])

    report = fit_readings(with_gyroscope(session(), spoil))
    told = [one for one in report.rotations if "single readings of x" in (one.problem or "")]
    assert 1 <= len(told) <= 3
    scale = np.diag(report.sensors["gyroscope"].matrix)
    assert scale == pytest.approx(np.diag(true().gyroscope_matrix), rel=2e-3)
    fit = report.sensors["gyroscope"]
    assert fit.floor is not None
    assert np.degrees(fit.floor) < 0.1


@pytest.mark.parametrize("shape", [(0.3, 1.0, 0.6, -0.2), (1.0,)])
def test_a_bump_costs_no_rotation(shape: tuple[float, ...]) -> None:
    """The device turns with it, and the angle contains that."""
    bump = np.radians(200.0) * np.array(shape)

    def push(values: FloatArray) -> FloatArray:
        place = int(np.abs(values[:, 0]).argmax())
        values[place : place + len(bump), 0] += np.sign(values[place, 0]) * bump
        return values

    report = fit_readings(with_gyroscope(session(), push))
    assert not any("single readings" in (one.problem or "") for one in report.rotations)


@pytest.mark.parametrize(("seconds", "rate"), [(2.0, 25.0), (1.0, 100.0)])
def test_two_wild_readings_of_one_short_rotation_are_seen(seconds: float, rate: float) -> None:
    hold = fit_readings(session()).holds[0]
    time = np.arange(int(seconds * rate)) / rate
    turned = 2.0 * np.sin(np.pi * time / seconds)[:, None] ** 2 * np.array([0.1, 1.0, 0.0])
    turned += np.random.default_rng(0).normal(0.0, 0.002, turned.shape)
    plain = Rotation(hold, hold, time, turned)
    wild = turned.copy()
    wild[[len(time) // 3, len(time) // 2], 0] = 8.7
    (good, bad) = examined([plain, replace(plain, rate=wild)])
    assert good.problem is None
    assert "single readings of x" in (bad.problem or "")


def test_a_clipped_axis_costs_its_rotations_only() -> None:
    """Turns beyond the range are set aside with the reason; the scale is right all the same."""
    report = fit_readings(with_gyroscope(session(), lambda y: np.clip(y, -3.0, 3.0)))
    clipped = [one for one in report.rotations if one.problem and "clipped" in one.problem]
    assert 3 <= len(clipped) <= 20
    for rotation in clipped:
        assert np.abs(rotation.rate).max() == 3.0
    for rotation in report.rotations:
        if rotation.problem is None:
            assert (np.abs(rotation.rate) == 3.0).sum() < 4
    scale = np.diag(report.sensors["gyroscope"].matrix)
    assert scale == pytest.approx(np.diag(true().gyroscope_matrix), rel=2e-3)


@pytest.mark.parametrize("limit", [60.0, 100.0])
def test_clipping_is_seen_without_knowing_the_range(limit: float) -> None:
    """Flat at ±100 °/s, below every usual range: turn more slowly, in these rotations."""
    end = np.radians(limit)
    report = fit_readings(with_gyroscope(session(), lambda y: np.clip(y, -end, end)))
    assert sum("clipped" in (one.problem or "") for one in report.rotations) > 10
    assert _warned(report, "end of its range", "turn more slowly", " s in all")
    fit = report.sensors.get("gyroscope")
    assert fit is None or np.degrees(fit.rms_fitted) < 1.0


def test_two_printed_decimals_are_not_clipping() -> None:
    """0.01 rad/s and 0.01 m/s²: the tops of slow turns are flat, and that is all."""
    coarse = with_gyroscope(session(), lambda y: np.round(y, 2))
    report = fit_readings(with_accelerometer(coarse, lambda y: np.round(y, 2)))
    assert not [one.problem for one in report.rotations if one.problem]
    scale = np.diag(report.sensors["gyroscope"].matrix)
    assert scale == pytest.approx(np.diag(true().gyroscope_matrix), rel=5e-3)


def test_a_quiet_axis_is_not_clipped_by_its_own_noise() -> None:
    """Turns about x only: the other axes read a few steps of their converter, top step and all."""
    stepped = with_gyroscope(session(), lambda y: np.round(y * [1.0, 1e-3, 1e-3], 3))
    report = fit_readings(stepped)
    assert not [one.problem for one in report.rotations if one.problem]


def test_lost_numbers_cost_only_their_samples() -> None:
    """NaN inside one rotation and inside one hold: the rest is fitted, and finite."""
    readings = session()

    def spoil(values: FloatArray) -> FloatArray:
        values[5000] = np.nan
        values[20000, 1] = np.nan
        return values

    report = fit_readings(with_gyroscope(with_accelerometer(readings, spoil), spoil))
    for fit in report.sensors.values():
        assert np.isfinite(fit.matrix).all()
        assert np.isfinite(fit.bias).all()
        assert np.isfinite(fit.rms_fitted)


def test_a_device_that_is_already_calibrated_stays_so() -> None:
    """Corrected readings give a matrix of one and no bias, within their standard errors."""
    truth = true()
    corrected = with_gyroscope(
        with_accelerometer(
            session(),
            lambda y: (y - truth.accelerometer_bias) @ truth.accelerometer_matrix.T,
        ),
        lambda y: (y - truth.gyroscope_bias) @ truth.gyroscope_matrix.T,
    )
    report = fit_readings(corrected)
    for fit in report.sensors.values():
        for parameter in fit.parameters:
            nominal = 1.0 if parameter.name.startswith("sensitivity") else 0.0
            assert abs(parameter.value - nominal) < 4.5 * (parameter.standard_error or 0.0)
    for name in report.sensors:
        assert _warned(report, f"the {name}'s bias", "already compensated", "Use the readings")


def test_nothing_but_rest_is_refused() -> None:
    """One position is no calibration."""
    readings = session()
    rest = _during(readings, 0.0, 15.0)
    gyroscope = readings.gyroscope
    assert gyroscope is not None
    series = readings.accelerometer
    short = Readings(
        replace(series, time=series.time[rest], values=series.values[rest]),
        replace(gyroscope, time=gyroscope.time[rest], values=gyroscope.values[rest]),
    )
    with pytest.raises(DataError, match="six faces"):
        fit_readings(short)


def _wandering(count: int, rng: np.random.Generator) -> FloatArray:
    """A rate that changes within a second and never stands still, rad/s."""
    knots = rng.standard_normal((count // 50 + 2, 3)) + 1.0
    grid = np.arange(len(knots)) * 50
    return np.column_stack([np.interp(np.arange(count), grid, knot) for knot in knots.T])


def test_nothing_but_motion_is_refused() -> None:
    """No rest, no calibration; a second of recording neither."""
    rng = np.random.default_rng(1)
    readings = session()
    turned = Attitude.from_rotvec(np.cumsum(0.02 * _wandering(len(readings), rng), axis=0))
    tumbling = STANDARD_GRAVITY * turned.inv().apply([0.0, 0.0, 1.0])
    with pytest.raises(DataError):
        fit_readings(Readings(replace(readings.accelerometer, values=tumbling)))
    series = readings.accelerometer
    with pytest.raises(DataError, match="too short"):
        fit_readings(Readings(replace(series, time=series.time[:90], values=series.values[:90])))


def test_an_accelerometer_alone_is_calibrated_alone() -> None:
    """Without a gyroscope there is one sensor and no complaint."""
    report = fit_readings(Readings(session().accelerometer))
    assert set(report.sensors) == {"accelerometer"}
    assert report.rotations == ()


def test_an_end_that_one_axis_alone_shows_is_the_end_of_its_range(plain: FitReport) -> None:
    """One sense of one axis ends at 60 °/s, far below the smallest common range."""
    end = np.radians(60.0)

    def clip(rate: FloatArray) -> FloatArray:
        rate[:, 1] = np.minimum(rate[:, 1], end)
        return rate

    readings = with_gyroscope(session(), clip)
    report = fit_readings(readings)
    reached = [bool((one.rate[:, 1] == end).sum() >= 4) for one in report.rotations]
    clipped = [one.problem is not None and "clipped" in one.problem for one in report.rotations]
    assert sum(reached) >= 2
    assert clipped == reached
    whole = plain.sensors["gyroscope"].rms_held_out
    left = report.sensors["gyroscope"].rms_held_out
    assert whole is not None
    assert left is not None
    assert left < 1.5 * whole


@pytest.mark.parametrize(
    ("low", "high", "words", "gyroscope"),
    [
        (9.3, 99.0, "the end of its range", Verdict.COMPLETE),
        (-0.3, 0.3, "skips codes", Verdict.DISTURBED),
    ],
)
def test_holds_in_which_an_axis_is_stuck_are_not_used(
    low: float, high: float, words: str, gyroscope: Verdict
) -> None:
    """Above 9.3 m/s² or around zero, the converter gives one code.

    In one hold the axis lies at the edge of the codes that are skipped, so that its noise shows
    half of them: it tilts the reference of the rotations before and after it, and is accused.
    """

    def stuck(force: FloatArray) -> FloatArray:
        force[(force[:, 2] > low) & (force[:, 2] < high), 2] = low
        return force

    readings = with_accelerometer(session(), stuck)
    report = fit_readings(readings)
    assert _warned(report, "z axis", words, "these readings are wrong and not used")
    found = diagnose_benches(Benches(report, readings), {}, automatic=False)
    assert [one.verdict for one in found] == [Verdict.COMPLETE, gyroscope]
    at_the_edge = (23,) if gyroscope is Verdict.DISTURBED else ()
    assert found[1].disturbed_holds == at_the_edge
    assert found[1].disturbed_rotations == ()


def test_a_hold_that_touches_the_end_of_the_range_in_some_samples_is_not_used(
    plain: FitReport,
) -> None:
    """A converter that ends 1.5 standard deviations above +z: 7 % of its samples are at the end."""
    one = next(
        hold for hold in plain.holds if hold.pose == "+z" and hold.accelerometer_scatter is not None
    )
    assert one.accelerometer_scatter is not None
    spread = np.sqrt(one.accelerometer_scatter[2] * one.samples)
    end = one.accelerometer[2] + 1.5 * spread
    readings = with_accelerometer(session(), lambda force: np.minimum(force, [np.inf, np.inf, end]))
    clipped = fit_readings(readings)
    assert any(
        "some samples of the accelerometer are at the end" in text for text in clipped.warnings
    )
    left = [
        hold
        for hold in clipped.holds
        if (hold.readings(readings.accelerometer).values[:, 2] == end).mean() > 0.01
    ]
    assert not left


def test_all_axes_that_rest_at_the_ends_of_their_ranges_are_one_warning() -> None:
    readings = with_accelerometer(session(), lambda force: np.clip(force, -9.3, 9.3))
    notes = fit_readings(readings).notes(judged=False)
    (text,) = [note for note in notes if "without any noise: the end of its range" in note]
    assert all(f"{axis} axis reads 9.3 in" in text for axis in "xyz")


@pytest.mark.parametrize("seconds", [0.12, 0.5, 1.0, 5.0])
def test_a_time_in_another_unit_is_told_by_the_gyroscope(seconds: float) -> None:
    """A counter of samples taken for seconds makes any sampling rate."""
    readings = session()
    assert readings.gyroscope is not None
    slow: FloatArray = seconds * np.arange(len(readings), dtype=np.float64)
    report = fit_readings(
        replace(
            readings,
            accelerometer=replace(readings.accelerometer, time=slow),
            gyroscope=replace(readings.gyroscope, time=slow),
        )
    )
    assert _warned(report, "the sampling rate is about 98 Hz instead of")


@pytest.mark.parametrize("factor", [3.0, -0.5])
def test_an_axis_in_another_unit_than_the_others_is_named(factor: float) -> None:
    def change(values: FloatArray) -> FloatArray:
        values[:, 1] *= factor
        return values

    words = "y axis reads", "times what the other axes read"
    assert _warned(fit_readings(with_gyroscope(session(), change)), "gyroscope's", *words)
    assert _warned(fit_readings(with_accelerometer(session(), change)), "accelerometer's", *words)


def test_rests_that_the_gyroscope_does_not_use_are_told_and_the_accelerometer_does(
    plain: FitReport,
) -> None:
    """A gyroscope whose bias jumps by 3 °/s half way, as one that is exchanged."""

    def jump(rate: FloatArray) -> FloatArray:
        rate[len(rate) // 2 :] += np.radians(3.0)
        return rate

    report = fit_readings(with_gyroscope(session(), jump))
    assert len(report.holds) >= len(plain.holds)  # it jumps in one of them
    assert sum(hold.gyroscope is not None for hold in report.holds) < len(plain.holds)
    assert _warned(
        report, "rests of the accelerometer", "not used for the gyroscope", "its bias jumped"
    )
    assert report.warned("gyroscope", NoticeKind.RESTS_LEFT_OUT)


def test_a_step_of_the_accelerometer_is_not_hidden_by_one_of_the_gyroscope() -> None:
    """Both are switched off and on half way: 6 mg on x, and 3 °/s."""

    def jump(rate: FloatArray) -> FloatArray:
        rate[len(rate) // 2 :] += np.radians(3.0)
        return rate

    def step(force: FloatArray) -> FloatArray:
        force[len(force) // 2 :, 0] += 6e-3 * STANDARD_GRAVITY
        return force

    readings = with_gyroscope(with_accelerometer(session(), step), jump)
    benches = Benches(fit_readings(readings), readings)
    found = {one.sensor: one for one in diagnose_benches(benches, {}, automatic=False)}
    assert found["accelerometer"].verdict is not Verdict.COMPLETE
    assert "bias-step" in found["accelerometer"].says


def test_noise_that_is_missing_is_no_coarse_step_and_no_repeated_sample() -> None:
    """Rests of three seconds and smooth turns of one second between them, without noise."""
    phase = np.clip(np.arange(4000) % 400 - 300, 0.0, 100.0) / 100.0 + np.arange(4000) // 400
    angle = 0.7 * (phase - np.sin(2.0 * np.pi * phase) / (2.0 * np.pi))
    force = 9.8 * np.column_stack([np.cos(angle), np.sin(angle) * 0.8, np.sin(angle) * 0.6])
    rate = 0.01 + np.gradient(angle, 0.01)[:, None] * np.array([0.3, -0.6, 0.8])
    time = np.arange(4000) / 100.0
    readings = Readings(Series(time, force, "m/s^2"), Series(time, rate, "rad/s"))
    assert check_recording(readings) == ()
    rounded = np.round(force / 0.02) * 0.02
    assert not in_steps(force, resolution_of(force))
    assert in_steps(rounded, resolution_of(rounded))
    assert in_steps(1e300 * rounded, np.full(3, 1e-30))  # no change of a few steps at all


def test_samples_that_are_printed_three_times_are_told() -> None:
    readings = session()
    assert readings.gyroscope is not None
    rows = np.arange(len(readings)) // 3 * 3
    slow = replace(
        readings,
        accelerometer=replace(readings.accelerometer, values=readings.accelerometer.values[rows]),
        gyroscope=replace(readings.gyroscope, values=readings.gyroscope.values[rows]),
    )
    assert any("67% of the samples repeat" in text for text in check_recording(slow))


def test_numbers_that_fit_no_unit_are_to_be_corrected_or_read_as_counts() -> None:
    """Under m/s² gravity reads 9807; the advice for another unit says for which it was taken."""
    (said,) = unit_notes(1e-3, as_counts=True)
    assert said.startswith("gravity reads 9807 m/s² in the unit of the accelerations: correct this")
    assert said.endswith("the numbers or the range, or give count as the unit")
    (said,) = unit_notes(0.1)
    assert "if they were taken for g, the accelerations are in m/s^2" in said
    (said,) = unit_notes(1e-3)
    assert "count" not in said


def test_a_wrong_unit_is_told_once() -> None:
    readings = with_accelerometer(session(), lambda force: force / STANDARD_GRAVITY)
    checked = replace(readings, warnings=check_recording(readings))
    notes = fit_readings(checked).notes(judged=False)
    assert len([one for one in notes if "gravity reads" in one.lower()]) == 1


def test_a_bias_that_no_sensor_has_is_not_taken_for_a_wrong_unit() -> None:
    """The z axis reads 4.6 m/s² too much, so that gravity reads 14.4 m/s² at first."""
    readings = with_accelerometer(session(), lambda force: force + np.array([0.0, 0.0, 4.6]))
    checked = replace(readings, warnings=check_recording(readings))
    report = fit_readings(checked)
    notes = report.notes(judged=False)
    assert not any("gravity reads" in note.lower() for note in notes)
    assert _warned(report, "bias is 4", "mg on the z axis")


def test_means_of_positions_are_not_taken_for_samples() -> None:
    """Six lines with what each axis reads up and down, as other programs take them."""
    ends = np.vstack([np.eye(3), -np.eye(3)]) * 16384.0 + (300.0, -200.0, 120.0)
    means = Readings(Series(np.arange(6) / 20.0, ends, "count"))
    with pytest.raises(DataError, match="mean of one position") as told:
        fit_readings(means)
    assert "sampling rate" not in str(told.value)


def test_a_long_recording_full_of_gaps_is_not_called_too_short() -> None:
    readings = session()
    step = np.where(np.arange(len(readings)) % 50 == 0, 1.0, 0.01)
    uneven = replace(
        readings,
        accelerometer=replace(readings.accelerometer, time=np.cumsum(step)),
        gyroscope=None,
    )
    with pytest.raises(DataError, match="no 2 s of the recording are without a gap") as told:
        fit_readings(uneven)
    assert "e+" not in str(told.value)


@pytest.mark.parametrize(("every", "count", "seconds"), [(20, 1600, 5), (50, 5400, 12)])
def test_at_low_rates_the_rest_that_is_asked_for_is_long_enough(
    every: int, count: int, seconds: int
) -> None:
    """Two seconds were asked for at 5 and 2 samples/s, where no hold is found in them."""
    series = session().accelerometer
    rows = slice(0, count, every)
    few = Readings(Series(series.time[rows], series.values[rows], series.unit))
    with pytest.raises(DataError, match=rf"{seconds} s \(at {100 / every:.0f} samples/s"):
        fit_readings(few)


@pytest.mark.parametrize("samples", [2, 185])
def test_a_gyroscope_without_whole_rests_is_left_out_and_said_to_be(samples: int) -> None:
    """Two samples, or a gap every two seconds: a good accelerometer was refused for them."""
    readings = session()
    gyroscope = readings.gyroscope
    assert gyroscope is not None
    row = np.arange(len(gyroscope))
    kept = row % 200 < samples if samples > 2 else row < samples
    some = Series(gyroscope.time[kept], gyroscope.values[kept], gyroscope.unit)
    report = fit_readings(replace(readings, gyroscope=some))
    assert list(report.sensors) == ["accelerometer"]
    assert len(report.holds) == 40
    (said,) = report.warnings
    assert "the gyroscope is not calibrated" in said
    assert "its samples are missing" in said


def test_a_gyroscope_that_scatters_in_bursts_is_not_said_to_have_jumped() -> None:
    readings = session()
    gyroscope, rng = readings.gyroscope, np.random.default_rng(1)
    assert gyroscope is not None
    values, burst = gyroscope.values.copy(), np.arange(len(gyroscope)) % 100 < 10
    values[burst] += 0.02 * rng.standard_normal((burst.sum(), 3))
    readings = replace(readings, gyroscope=replace(gyroscope, values=values))
    with pytest.raises(DataError, match="readings scatter so much in the 40 holds") as told:
        fit_readings(readings)
    assert "jumped" not in str(told.value)


def test_a_time_that_is_given_twice_is_no_missing_sample() -> None:
    time = session().accelerometer.time.copy()
    time[700] = time[699]
    said = missing_samples(time)
    assert "1 sample came with a time too early" in said
    assert "rotations whose angle" not in said


@pytest.mark.parametrize("begin", [0.0, 20.0, 1.7e9])
@pytest.mark.parametrize(("rate", "lost"), [(2.0, 1), (100.0, 98), (100.0, 99), (100.0, 100)])
def test_a_gap_of_a_second_is_told_as_others_are_by_the_times_of_the_recording(
    begin: float, rate: float, lost: int
) -> None:
    """A restart of the device, whose loss nobody knows, is no gap; dates count from the start."""
    time = begin + np.delete(np.arange(600) / rate, slice(300, 300 + lost))
    said = missing_samples(time)
    assert f"about {lost} sample" in said
    assert f"at {begin % 1e8 + 299 / rate:.6g} s" in said
    time[450:] += RESTART_GAP_SECONDS - 1.0 / rate
    assert missing_samples(time) == said


def test_a_gyroscope_in_holds_that_sway_is_not_called_dead(plain: FitReport) -> None:
    """What a hand does in a hold is not the noise of the sensor."""
    turned = np.array([[0.05, 0.0, 0.0]]) ** 2
    holds = [
        replace(one, gyroscope_covariance=one.gyroscope_covariance + turned.T * np.eye(3))
        for one in plain.holds
        if one.gyroscope_covariance is not None
    ]
    assert silent_axes(holds, plain.rotations) == ()


def test_a_sample_that_comes_late_is_not_missing() -> None:
    """The step after it is as much too short; of one that is missing both neighbours are usual."""
    readings = session()
    series = readings.accelerometer
    rng = np.random.default_rng(0)
    late = series.time + np.abs(rng.normal(0.0, 0.003, len(series))) * (
        rng.random(len(series)) < 0.3
    )
    said = missing_samples(np.maximum.accumulate(late))
    assert "too early or too late" in said
    assert "missing in" not in said
    fewer = np.delete(np.arange(len(series)), [500, 900])
    assert "missing in 2 gaps" in missing_samples(series.time[fewer])
