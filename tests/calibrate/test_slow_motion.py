"""A device that is waved slowly is not at rest, and a hold that settles is trimmed."""

import numpy as np
import pytest

from benchmarks.hand_motion import Device as Virtual
from benchmarks.hand_motion import G, placed, recorded, waved
from benchmarks.holds import accepted, honest, scatter, slow_motion
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.guide.plan import Procedure, standard
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.blocks import BlockCutter, Blocks
from imucal_wizard.measurement.holds import hold_at_rest
from imucal_wizard.measurement.rests import HoldBuilder
from imucal_wizard.measurement.stillness import WindowMaker

RATE = 100.0
SECONDS = 4.0


def blocks_of(values: FloatArray) -> Blocks:
    """The blocks of accelerometer readings at 100 Hz."""
    time = np.arange(len(values)) / RATE
    return BlockCutter(RATE).feed(Readings(Series(time, values, "m/s^2"), None))


def resting(noise: float, seed: int = 0) -> tuple[FloatArray, FloatArray]:
    """Times, and readings of a level device with this noise in mg."""
    time = np.arange(round(SECONDS * RATE)) / RATE
    rng = np.random.default_rng(seed)
    return time, np.array([0.0, 0.0, G]) + 1e-3 * G * noise * rng.standard_normal((len(time), 3))


@pytest.mark.parametrize("noise", [0.1, 1.0, 10.0])
@pytest.mark.parametrize("speed", [5.0, 20.0])
def test_a_hold_whose_direction_drifts_is_no_hold(noise: float, speed: float) -> None:
    """Whatever the noise; offline and live by the same function."""
    time, values = resting(noise)
    angle = np.radians(speed) * time
    drifting = values + G * np.column_stack([np.sin(angle), 0.0 * time, np.cos(angle) - 1.0])
    assert hold_at_rest(blocks_of(values), G) is not None
    assert hold_at_rest(blocks_of(drifting), G) is None
    builder, blocks = HoldBuilder(), blocks_of(drifting)
    windows = WindowMaker().feed(blocks)
    for index in range(len(blocks)):
        row = slice(index, index + 1)
        builder.add(blocks.select(row), windows.select(row), still=bool(windows.full[index]))
    assert builder.hold(G) is None


@pytest.mark.parametrize("tremor", [5.0, 20.0])
def test_a_hand_that_trembles_or_a_sensor_that_warms_up_keeps_its_hold(tremor: float) -> None:
    time, values = resting(0.1)
    shaken = values + 1e-3 * G * tremor * np.sin(2.0 * np.pi * 9.3 * time)[:, None]
    warming = values + 1e-3 * G * 2.0 * (time / SECONDS)[:, None]
    for one in (shaken, warming):
        assert hold_at_rest(blocks_of(one), G) is not None


def test_a_device_that_is_waved_slowly_is_refused_with_what_to_do() -> None:
    """Smooth turning at 8 °/s, which a file without gyroscope showed as 27 holds."""
    rng = np.random.default_rng(3)
    motion = waved(200.0, 8.0, 50.0, rng)
    readings = recorded(motion, Virtual(rate=50.0, gyroscope=False), rng)
    with pytest.raises(DataError, match=r"never at rest|still") as refused:
        fit_readings(readings)
    assert str(refused.value).count(". ") <= 2


def test_an_honest_session_without_a_gyroscope_is_accepted() -> None:
    rng = np.random.default_rng(4)
    device = Virtual(rate=50.0, gyroscope=False)
    motion = placed(device, rng, hold=2.0, tremor=5.0, sway=0.1)
    assert len(fit_readings(recorded(motion, device, rng)).holds) >= 20


def test_the_wizard_takes_no_hold_of_a_slow_motion() -> None:
    """Even with its limits of rest widened as far as they go."""
    rng = np.random.default_rng(5)
    device = Virtual(rate=50.0, gyroscope=False)
    still = placed(device, rng, hold=2.0).force[:300]
    slow = recorded(waved(60.0, 12.0, 50.0, rng), device, rng).accelerometer.values
    values = np.concatenate([still + 1e-2 * rng.standard_normal(still.shape), slow])
    time = np.arange(len(values)) / 50.0
    machine = StateMachine(Procedure(standard(6, settle_seconds=4.0).steps, led=False), rate=50.0)
    machine.command("start")
    for first in range(0, len(values), 50):
        part = slice(first, first + 50)
        machine.feed(Readings(Series(time[part], values[part], "m/s^2"), None))
        machine.command("loosen")
    assert all(hold.end < 7.0 for hold in machine.collected().holds)


def test_settling_is_left_out() -> None:
    """5 mg that die out in half a second: seven times the scatter before, twice now."""
    device = Virtual()
    clean = scatter(12, 0.0, trimmed=False, device=device)
    assert scatter(12, 0.0, trimmed=True, device=device) == pytest.approx(clean, rel=0.02)
    assert (scatter(12, 5.0, trimmed=True, device=device) < 3.0 * clean).all()


@pytest.mark.study
def test_no_slow_motion_is_accepted_and_honest_sessions_are() -> None:
    """Twelve fresh devices; the benchmark has a hundred of each."""
    seeds = range(20_000, 20_006)
    assert not any(accepted(slow_motion(seed, gyroscope=False)) for seed in seeds)
    for seed in seeds:
        readings, rests = honest(seed)
        assert accepted(readings) >= 0.7 * rests
