"""Raw counts: neither scale nor offset is known, and the poses are recognised all the same."""

import numpy as np
import pytest

from imucal_wizard.core.poses import EDGES, FACES, angle_between
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.estimate.recording import fit_collected
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.guide.up_direction import UpEstimate, guessed_offset
from tests.guide.device import QUICK, RATE, Device, holds_of, rotations_of

XSENS = (134.0, 3200.0), 32768.0
SIGNED = (16384.0 / 9.80665, 131.0 * 180.0 / np.pi), 0.0
ADC = (10.0, 200.0), 512.0


def counting(
    device: Device, scale: tuple[float, float], offset: float
) -> tuple[StateMachine, Readings]:
    """A machine for raw counts and the device's readings, with an own bias on each axis."""
    machine = StateMachine(QUICK, rate=RATE, accelerometer_unit="count", gyroscope_unit="count")
    machine.command("start")
    readings = device.readings(counts=scale, offset=offset)
    own = np.round(scale[0] * np.array([0.4, -0.3, 0.5]))
    force = Series(readings.accelerometer.time, readings.accelerometer.values + own, "count")
    return machine, Readings(force, readings.gyroscope)


@pytest.mark.parametrize(("scale", "offset"), [XSENS, SIGNED, ADC])
def test_poses_and_rotations_in_counts(scale: tuple[float, float], offset: float) -> None:
    device = Device(up="-y").rest(4.0).poses(["+y", "-x", "+z", "+x", "-z"])
    device.poses([*FACES, *EDGES])
    for axis, start in (("x", "+z"), ("y", "+z"), ("z", "+x")):
        device.hold(start).rotate(axis, 90.0).rest(2.0).rotate(axis, -140.0).rest(2.0)
    machine, readings = counting(device, scale, offset)
    machine.feed(readings)
    assert machine.status().step is StepKind.RESULT
    assert {hold.pose for hold in holds_of(machine, StepKind.POSES)} == {*FACES, *EDGES}
    assert len(rotations_of(machine)) >= 6


def test_a_gyroscope_in_counts_is_calibrated_from_what_the_wizard_collects() -> None:
    device = Device().rest(4.0).poses([*FACES, *EDGES])
    for axis, start in (("x", "+z"), ("y", "+z"), ("z", "+x")):
        device.hold(start).rotate(axis, 90.0).rest(2.0).rotate(axis, -140.0).rest(2.0)
    machine, readings = counting(device, *XSENS)
    machine.feed(readings)
    units = {"accelerometer": "count", "gyroscope": "count"}
    report = fit_collected(machine.collected(), units, RATE)
    scale = np.diag(report.sensors["gyroscope"].matrix)
    assert scale == pytest.approx(np.full(3, 1.0 / XSENS[0][1]), rel=0.02)


def test_start_values_in_counts_are_sensitivities_around_the_offset() -> None:
    device = Device(noise=(0.0, 0.0)).rest(4.0).poses(["-z", "+x", "-x", "+y"])
    machine, readings = counting(device, *XSENS)
    machine.feed(readings)
    x, _, z = machine.status().start_values
    assert z.unit == "count"
    assert z.sensitivity == pytest.approx(134.0 * 9.80665, abs=1.0)
    assert x.bias == pytest.approx(32768.0 + 0.4 * 134.0, abs=2.0)


def test_motion_is_told_in_counts() -> None:
    machine, readings = counting(Device().rest(4.0).rotate("x", 40.0, 2.0), *SIGNED)
    machine.feed(readings)
    assert {motion.unit for motion in machine.status().still.motions} == {"count"}


def test_rates_are_told_in_counts_until_a_rotation_has_shown_the_scale() -> None:
    """From then on in °/s, with the number of rotations that the scale comes from."""
    device = Device().rest(4.0).hold("+z").rotate("x", 120.0, 2.0)
    begun = device.time - 1.0
    device.rest(2.0).rotate("x", -100.0, 2.0)
    ended = device.time
    machine, readings = counting(device, *SIGNED)
    machine.feed(part_until(readings, 4.0))
    machine.command("goto", "rotations")
    rest = part_from(readings, 4.0)
    machine.feed(part_until(rest, begun))
    first = machine.status().rotation
    assert first is not None
    assert (first.unit, first.scaled_by, first.range_limit) == ("count", 0, None)
    assert first.fastest > 1000.0
    machine.feed(part_until(part_from(rest, begun), ended))
    second = machine.status().rotation
    assert second is not None
    assert (second.unit, second.scaled_by, second.range_limit) == ("°/s", 1, None)
    true = Device().rest(4.0).hold("+z").rest(1.0).rotate("x", -100.0, 2.0).readings().gyroscope
    assert true is not None
    fastest = float(np.degrees(np.abs(true.values[-200:, 0]).max()))
    assert second.fastest == pytest.approx(fastest, rel=0.05)


def test_angles_beyond_half_a_circle_are_told_by_the_gyroscopes_sense() -> None:
    device = Device().rest(4.0)
    for axis, start in (("x", "+z"),):
        device.hold(start).rotate(axis, 120.0).rest(2.0).rotate(axis, -200.0).rest(2.0)
    machine, readings = counting(device, *SIGNED)
    machine.feed(part_until(readings, 4.0))
    machine.command("goto", "rotations")
    machine.feed(part_from(readings, 4.0))
    assert machine.status().rotation is not None
    turns = rotations_of(machine)
    assert [one.axis for one in turns] == ["x", "x"]
    assert turns[1].problem is None


def part_until(readings: Readings, time: float) -> Readings:
    """The samples before a time."""
    assert readings.gyroscope is not None
    return Readings(
        readings.accelerometer.between(0.0, time), readings.gyroscope.between(0.0, time)
    )


def part_from(readings: Readings, time: float) -> Readings:
    """The samples from a time on."""
    assert readings.gyroscope is not None
    return Readings(
        readings.accelerometer.between(time, np.inf), readings.gyroscope.between(time, np.inf)
    )


@pytest.mark.parametrize(
    ("reading", "offset"),
    [
        ((32720.0, 32733.0, 34070.0), 32768.0),
        ((512.0, 508.0, 610.0), 512.0),
        ((2048.0, 2040.0, 2460.0), 2048.0),
        ((200.0, -100.0, 16384.0), 0.0),
        ((9000.0, 20.0, 9300.0), 0.0),
        ((0.3, 0.3, 0.32), 0.0),
    ],
)
def test_an_offset_is_guessed_from_readings_that_are_alike(
    reading: tuple[float, float, float], offset: float
) -> None:
    assert guessed_offset(np.array(reading)) == offset


def test_the_running_estimate_finds_bias_and_scale_from_a_few_holds() -> None:
    bias, scale = np.array([560.0, 480.0, 530.0]), 98.0
    ups = np.array([[0, 0, 1.0], [1, 0, 0], [0, -1, 0], [0, 0, -1], [-1, 0, 0]])
    holds = list(bias + scale * ups)
    upright = UpEstimate(counts=True)
    upright.begin(holds[0])
    upright.learn(holds)
    assert upright.bias == pytest.approx(bias, abs=2.0)
    assert upright.radius == pytest.approx(scale, abs=1.0)
    up = upright.up(bias + scale * np.array([0.0, 1.0, 0.0]))
    assert up is not None
    assert np.degrees(angle_between(up, np.array([0.0, 1.0, 0.0]))) < 2.0


def test_a_corner_that_looks_like_an_offset_is_known_as_one_from_the_first_negative_reading() -> (
    None
):
    """Counts with a sign, whose first hold has the corner between three faces up."""
    ups = np.array([[1.0, 1.0, 1.0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [-1, 0, 0], [0, -1, 0]])
    ups /= np.linalg.norm(ups, axis=1)[:, None]
    bias, scale = np.array([120.0, -80.0, 60.0]), 16384.0
    holds = list(bias + scale * ups)
    upright = UpEstimate(counts=True)
    upright.begin(holds[0])
    for count in range(1, len(holds) + 1):
        upright.learn(holds[:count])
    up = upright.up(bias - scale * np.array([0.0, 0.0, 1.0]))
    assert up is not None
    assert np.degrees(angle_between(up, np.array([0.0, 0.0, -1.0]))) < 2.0


def test_free_fall_has_no_up() -> None:
    upright = UpEstimate(counts=False)
    assert upright.up(np.zeros(3)) is None
    upright.begin(np.array([0.0, 0.0, 9.8]))
    assert upright.up(np.zeros(3)) is None
