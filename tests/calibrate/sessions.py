"""Recordings of the virtual IMU in memory, to be spoilt and fitted."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np

from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.recording import recording_script
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.sensor import SensorModel
from tests.simulate.sensors import Truth, offset_binary, truth

RATE = 100.0


@cache
def session(
    seed: int = 0,
    poses: str = "18",
    rotations: int = 6,
    counts: bool = False,
    hold: float = 4.0,
    rate: float = RATE,
) -> Readings:
    """A rest, the poses, turns about each axis; a consumer sensor drawn from the seed."""
    hand = VirtualHand(rate, seed)
    chance = np.random.default_rng([seed, 5])
    hand.perform(recording_script(poses, chance, hold=hold, rotations=rotations))
    return recorded(hand, _model(seed, counts), rate, seed)


def recorded(hand: VirtualHand, model: SensorModel, rate: float, seed: int = 0) -> Readings:
    """All that a hand does, as this sensor puts it out."""
    stream = VirtualStream(hand, model, rate=rate, seed=seed)
    parts = []
    while count := hand.remaining(8192):
        parts.append(stream.take(count))
    time = np.concatenate([part.time for part in parts])
    return Readings(
        Series(
            time, np.concatenate([part.accelerometer for part in parts]), model.accelerometer.unit
        ),
        Series(time, np.concatenate([part.gyroscope for part in parts]), model.gyroscope.unit),
    )


def _model(seed: int, counts: bool) -> SensorModel:
    model = SensorModel.drawn(seed)
    return offset_binary(model) if counts else model


def true(seed: int = 0, counts: bool = False) -> Truth:
    """What a perfect calibration finds."""
    return truth(model=_model(seed, counts))


def with_accelerometer(readings: Readings, change: Callable[[FloatArray], FloatArray]) -> Readings:
    """The recording with its accelerations changed."""
    series = readings.accelerometer
    return replace(readings, accelerometer=replace(series, values=change(series.values.copy())))


def with_gyroscope(readings: Readings, change: Callable[[FloatArray], FloatArray]) -> Readings:
    """The recording with its rates changed."""
    series = readings.gyroscope
    assert series is not None
    return replace(readings, gyroscope=replace(series, values=change(series.values.copy())))


def at_rate(readings: Readings, factor: float) -> Readings:
    """The recording with its times as if the rate were this much higher."""
    gyroscope = readings.gyroscope
    assert gyroscope is not None
    return replace(
        readings,
        accelerometer=replace(readings.accelerometer, time=readings.accelerometer.time / factor),
        gyroscope=replace(gyroscope, time=gyroscope.time / factor),
    )
