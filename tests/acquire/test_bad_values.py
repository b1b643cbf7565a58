"""Values that show that a device is set up wrongly, is broken or leaves its range."""

import numpy as np
import pytest

from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import StreamSetup, named_columns
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.measurement.data_quality import check_recording, coarse_steps
from tests.acquire.streams import HEADER, at_rest, feed, printed, spoilt, warned


def test_a_healthy_stream_gets_no_warning() -> None:
    assert warned(at_rest(3000)) == ""


def test_two_printed_decimals_are_named_with_their_step() -> None:
    """Only where the noise does not dither them away, as it does in the accelerometer here."""
    text = warned(at_rest(300), form="%.2f")
    assert "readings of the gyroscope come in steps of 0.57 °/s" in text
    assert "Serial.print(x, 5)" in text
    assert "of the accelerometer come in steps" not in text


@pytest.mark.parametrize(
    ("sensor", "unit", "step", "coarse"),
    [
        ("accelerometer", "m/s^2", 1e-2, True),
        ("accelerometer", "m/s^2", 1e-3, False),
        ("accelerometer", "m/s^2", 9.8e-3, True),
        ("accelerometer", "m/s^2", 9.8e-4, False),
        ("accelerometer", "count", 1.0, False),
        ("gyroscope", "rad/s", 1e-2, True),
        ("gyroscope", "rad/s", 1.7e-2, True),
        ("gyroscope", "rad/s", 1.7e-4, False),
    ],
)
def test_digits_are_judged_by_the_step_they_make(
    sensor: str, unit: str, step: float, coarse: bool
) -> None:
    values = np.random.default_rng(0).normal(0.0, 1e-4, (200, 3))
    series = Series(np.arange(200) / 100, values, unit)
    assert bool(coarse_steps(sensor, series, step)) is coarse


def test_repeated_samples_are_noticed() -> None:
    def repeat(values: FloatArray) -> None:
        values[1::2, 1:7] = values[0::2, 1:7]

    said = warned(spoilt(repeat))
    assert "accelerometer and the gyroscope is repeated 2 times" in said
    assert "of the samples repeat" not in said


def _turned(step: float, repeated: bool) -> Readings:
    """A minute at 100 samples/s with a slow turn every ten seconds and noise of 2.5 mg."""
    rng, time = np.random.default_rng(3), np.arange(6000) / 100
    angle = np.floor(time / 10.0) + np.clip(time % 10.0 - 7.0, 0.0, 1.0)
    force = STANDARD_GRAVITY * np.column_stack([np.cos(angle), np.sin(angle), 0.3 * np.cos(angle)])
    values = step * np.round((force + rng.normal(0.0, 0.025, force.shape)) / step)
    if repeated:  # from one to three times each
        values = np.repeat(values, rng.integers(1, 4, len(values)), axis=0)[: len(time)]
    return Readings(Series(time, values, "m/s^2"))


def test_a_sensor_that_repeats_itself_by_coarse_steps_at_rest_prints_not_too_fast() -> None:
    """Its noise is below its step: the step is the cause, and is named."""
    said = " ".join(check_recording(_turned(0.1, repeated=False)))
    assert "come in steps of 10 mg" in said
    assert "repeat the one before" not in said


@pytest.mark.parametrize("step", [0.001, 0.1])
def test_a_device_that_prints_too_fast_is_told_so(step: float) -> None:
    assert "repeat the one before" in " ".join(check_recording(_turned(step, repeated=True)))


def _resting(noise: float, copied: int, seconds: int = 100) -> Readings:
    """Samples of both sensors with even times, some of which came twice before times were added."""
    rng, count = np.random.default_rng(4), 100 * seconds
    rows = np.sort(np.append(np.arange(count), rng.choice(count, copied, replace=False)))
    moving = (
        20.0 * np.sin(0.1 * np.arange(count))[:, None] * (np.arange(count) % 500 > 300)[:, None]
    )
    values = np.round(moving + rng.normal(0.0, noise, (count, 6)))[rows]
    time = np.arange(len(rows)) / 100
    force, rate = values[:, :3] + np.array([0.0, 0.0, 16384.0]), values[:, 3:]
    return Readings(Series(time, force, "count"), Series(time, rate, "count"))


def test_samples_that_came_twice_are_counted_where_noise_would_change_them() -> None:
    """The times show nothing of it; a sensor without noise repeats itself without a copy."""
    assert "20 samples of 10020 repeat the one before" in " ".join(
        check_recording(_resting(3.0, 20))
    )
    for noise, copied in ((3.0, 0), (1.0, 0), (0.5, 20), (0.2, 0), (0.0, 20)):
        assert "repeat the one before" not in " ".join(check_recording(_resting(noise, copied)))


def test_counts_with_decimals_are_told() -> None:
    """They may be averages, and are calibrated all the same."""
    counts = HEADER.replace(b"m/s^2", b"count")
    said = warned(at_rest(3000), counts)
    assert "readings of the accelerometer have decimals, and counts are whole numbers" in said
    assert "have decimals" not in warned(np.round(at_rest(3000) * 1000.0), counts)
    assert "have decimals" in " ".join(check_recording(_averages()))


def _averages() -> Readings:
    """Of four counts each."""
    values = np.random.default_rng(0).integers(0, 9, (400, 4, 3)).mean(axis=1)
    return Readings(Series(np.arange(400) / 100, values + np.array([0.0, 0.0, 16384.0]), "count"))


def test_values_that_never_change_are_noticed() -> None:
    def stop(values: FloatArray) -> None:
        values[:, 1:7] = values[0, 1:7]

    assert "No value changes at all" in warned(spoilt(stop))


def test_a_dead_axis_is_named() -> None:
    def kill(values: FloatArray) -> None:
        values[:, 2] = 0.0

    assert "accelerometer's y axis never changes" in warned(spoilt(kill))


def test_gravity_of_1000_in_the_wrong_unit_says_which_unit_it_is() -> None:
    def wrong(values: FloatArray) -> None:
        values[:, 1:4] *= 1000 / 9.80665

    text = warned(spoilt(wrong))
    assert "Gravity reads 99" in text
    assert "mg taken for m/s^2" in text


def test_linear_acceleration_is_recognised_as_useless() -> None:
    def float_away(values: FloatArray) -> None:
        values[:, 1:4] -= (0.1, -0.2, 9.8)

    assert "removed gravity" in warned(spoilt(float_away))


def test_a_gyroscope_that_compensates_itself_is_recognised() -> None:
    def zero(values: FloatArray) -> None:
        values[:, 4:7] = 0.0

    text = warned(spoilt(zero))
    assert "reads exactly zero" in text
    assert "AMG" in text


def test_a_clipped_axis_is_named_with_its_limit() -> None:
    def clip(values: FloatArray) -> None:
        swing = 6 * np.sin(values[:, 0] * 3)
        values[:, 6] = np.clip(swing + values[:, 6], -4.36, 4.36)

    text = warned(spoilt(clip))
    assert "gyroscope's z axis is at the end of its range" in text
    assert "4.36 rad/s" in text


def test_all_axes_that_clip_are_named() -> None:
    def clip(values: FloatArray) -> None:
        swing = 8 * np.sin(values[:, 0] * 2)
        values[:, 4:7] = np.clip(swing[:, None] + values[:, 4:7], -4.36, 4.36)

    text = warned(spoilt(clip))
    assert "gyroscope's x, y and z axes are at the ends of their ranges" in text
    assert "4.36 rad/s" in text


def test_the_top_of_a_smooth_turn_in_coarse_steps_is_not_clipped() -> None:
    """Two printed decimals: the peak stands on one value, but comes there step by step."""

    def turn(values: FloatArray) -> None:
        values[:, 6] = np.round(2.2 * np.sin(values[:, 0] * 1.5), 2)

    text = warned(spoilt(turn))
    assert "is at the end of its range" not in text


def test_counts_at_the_end_of_int16_are_clipped() -> None:
    columns = named_columns("ax[count],ay[count],az[count],gx[count],gy[count],gz[count]")
    rng = np.random.default_rng(0)
    values = np.round(rng.normal((0, 0, 16384, 0, 0, 0), 30, (600, 6)))
    values[300, 3] = 32767
    intake = Intake(StreamSetup(columns=columns, rate=100.0))
    feed(intake, printed(values, "%d"))
    assert any("gyroscope's x axis" in text for text in intake.warnings)


def test_nan_is_left_out_and_named() -> None:
    def gap(values: FloatArray) -> None:
        values[::20, 1] = np.nan

    text = warned(spoilt(gap))
    assert "NaN" in text
    assert "wiring" in text


def test_exchanged_columns_are_named_as_such() -> None:
    def exchange(values: FloatArray) -> None:
        values[:, 1:7] = values[:, [4, 5, 6, 1, 2, 3]]

    assert "they are exchanged" in warned(spoilt(exchange))


def test_counts_whose_signs_were_lost_are_named() -> None:
    """The x and y axes and the rates are near zero, and half of their readings below."""
    values = at_rest(1000)
    values[:, 1:4] = np.round(values[:, 1:4] * 1670.0) - np.round([167.0, -334.0, 0.0])
    values[:, 4:7] = np.round(values[:, 4:7] * 900.0) - 9.0
    header = b"t[s],ax[count],ay[count],az[count],gx[count],gy[count],gz[count],temp[degC]\r\n"
    words = "negative readings of the accelerometer were written as unsigned numbers"
    assert words not in warned(values, header)
    values[:, 1:7] = np.mod(values[:, 1:7], 2**16)
    assert words in warned(values, header)


@pytest.mark.parametrize(("slow", "times"), [("gyroscope", 3), ("accelerometer", 2)])
def test_a_sensor_that_is_slower_than_the_lines_is_named(slow: str, times: int) -> None:
    """The other one keeps up with them; at rest a coarse sensor repeats itself, too."""
    rng = np.random.default_rng(2)
    time = np.arange(3000) / 100.0
    turning = np.sin(time)[:, None] * np.array([1.0, 0.6, -0.4])
    force = 9.8 * turning + rng.normal(0.0, 0.02, (3000, 3))
    rate = turning + rng.normal(0.0, 0.002, (3000, 3))
    measured = np.arange(3000) // times * times
    if slow == "gyroscope":
        rate = rate[measured]
    else:
        force = force[measured]
    told = check_recording(Readings(Series(time, force, "m/s^2"), Series(time, rate, "rad/s")))
    (note,) = (one for one in told if "is repeated" in one)
    assert f"Each reading of the {slow} is repeated {times} times" in note
    still = Series(time, 9.8 + rng.normal(0.0, 0.02, (3000, 3)), "m/s^2")
    coarse = Series(time, 0.01 * np.round(rng.normal(0.0, 0.3, (3000, 3))), "rad/s")
    assert not any("is repeated" in one for one in check_recording(Readings(still, coarse)))
