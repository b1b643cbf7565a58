"""Hidden effects: each moves only what its equation says."""

from collections.abc import Callable

import numpy as np
import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Rotate, Shake
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.hidden import parse_hidden
from imucal_wizard.simulate.motion import Motion
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.sensor import DEGREE, MILLI_G
from tests.simulate.sensors import ideal

SCRIPT: list[Action] = [
    LieStill(2.0),
    PlacePose("+x-y"),
    LieStill(60.0),
    Shake(0.1),
    PlacePose("-z+x"),
    LieStill(40.0),
    Rotate("y", -120.0, 200.0),
    LieStill(5.0),
]
COUNT = 11_500


def _hand() -> VirtualHand:
    hand = VirtualHand()
    hand.perform(SCRIPT)
    return hand


def _difference(*hidden: str) -> tuple[FloatArray, FloatArray, Motion]:
    """What the effects add to the readings of a perfect sensor: mg, °/s; and the motion."""
    perfect = ideal()
    with_it = VirtualStream(_hand(), perfect, hidden).take(COUNT)
    motion = _hand().advance(COUNT)
    force = (with_it.accelerometer - motion.specific_force) / MILLI_G
    rate = (with_it.gyroscope - motion.rate) / DEGREE
    return force, rate, motion


def _force(motion: Motion, axis: int) -> FloatArray:
    return motion.specific_force[:, axis] / STANDARD_GRAVITY


def _temperature(motion: Motion) -> FloatArray:
    return ideal().thermal.at(motion.time) - 25.0


EQUATIONS: dict[str, Callable[[Motion], FloatArray]] = {
    "second-order": lambda m: _force(m, 0) * _force(m, 0),
    "asymmetry": lambda m: np.sqrt(_force(m, 0) * _force(m, 0)),
    "odd-quadratic": lambda m: np.sign(_force(m, 0)) * _force(m, 0) * _force(m, 0),
    "third-order": lambda m: _force(m, 0) * _force(m, 0) * _force(m, 0),
    "cross-product": lambda m: _force(m, 0) * _force(m, 1),
    "bias-temperature": _temperature,
    "scale-temperature": lambda m: 1e-3 * _temperature(m) * _force(m, 0),
    "scale-drift": lambda m: 1e-3 * m.time / 60.0 * _force(m, 0),
    "warm-up": lambda m: np.exp(-m.time / 180.0),
    "bias-drift": lambda m: m.time / 60.0,
    "bias-step": lambda m: np.where(m.time < 90.0, 0.0, 1.0),
    "hysteresis": lambda m: m.previous[:, 0],
    "vibration-rectification": lambda m: ((m.acceleration / STANDARD_GRAVITY) ** 2).sum(1),
}
"""Closed forms for size 1 on the x axis, mg, from CONTRACT and catalogue."""


@pytest.mark.parametrize("term", EQUATIONS)
def test_an_accelerometer_effect_moves_its_axis_by_its_equation_and_nothing_else(term: str) -> None:
    """Size 3 on x changes x by the closed form; y, z and the gyroscope not at all."""
    force, rate, motion = _difference(f"{term}:3:x")
    expected = 3.0 * EQUATIONS[term](motion)
    assert np.abs(expected).max() > 1e-4
    np.testing.assert_allclose(force[:, 0], expected, atol=1e-9)
    assert np.abs(force[:, 1:]).max() < 1e-9
    assert np.abs(rate).max() < 1e-12


RATE_EQUATIONS: dict[str, Callable[[Motion], FloatArray]] = {
    "g-sensitivity": lambda m: _force(m, 1),
    "g2-sensitivity": lambda m: _force(m, 1) ** 2,
    "second-order": lambda m: 1e-6 * (m.rate[:, 1] / DEGREE) ** 2,
    "asymmetry": lambda m: 1e-3 * np.abs(m.rate[:, 1] / DEGREE),
    "third-order": lambda m: 1e-7 * (m.rate[:, 1] / DEGREE) ** 3,
    "cross-product": lambda m: 1e-5 * m.rate[:, 1] * m.rate[:, 2] / DEGREE**2,
    "bias-temperature": _temperature,
    "scale-temperature": lambda m: 1e-6 * _temperature(m) * m.rate[:, 1] / DEGREE,
    "scale-drift": lambda m: 1e-6 * m.time / 60.0 * m.rate[:, 1] / DEGREE,
    "warm-up": lambda m: np.exp(-m.time / 180.0),
    "bias-drift": lambda m: m.time / 60.0,
    "bias-step": lambda m: np.where(m.time < 90.0, 0.0, 1.0),
}
"""Closed forms for size 1 on the y axis, °/s."""


@pytest.mark.parametrize("term", RATE_EQUATIONS)
def test_a_gyroscope_effect_moves_its_axis_by_its_equation_and_nothing_else(term: str) -> None:
    """Size 3 on y changes y by the closed form; x, z and the accelerometer not at all."""
    force, rate, motion = _difference(f"gyroscope/{term}:3:y")
    expected = 3.0 * RATE_EQUATIONS[term](motion)
    assert np.abs(expected).max() > 1e-6
    np.testing.assert_allclose(rate[:, 1], expected, atol=1e-12)
    assert np.abs(rate[:, [0, 2]]).max() < 1e-12
    assert np.abs(force).max() < 1e-9


def test_earth_rate_about_the_vertical_is_felt_along_up() -> None:
    """15 °/h about the world's vertical reads 15 °/h times the up direction at rest."""
    _, rate, motion = _difference("gyroscope/earth-rate:15:z")
    up = motion.specific_force[-1] / np.linalg.norm(motion.specific_force[-1])
    still = motion.attitude[0]
    np.testing.assert_allclose(rate[0] * 3600.0, [0.0, 0.0, 15.0], atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(rate, axis=1) * 3600.0, 15.0)
    assert rate[-1] @ up * 3600.0 == pytest.approx(15.0, rel=0.03)
    assert still[0] == 1.0


def test_effects_add_up() -> None:
    """Two effects together are the sum of both."""
    one, _, _ = _difference("second-order:3:x")
    two, _, _ = _difference("third-order:-2:z")
    both, _, _ = _difference("second-order:3:x", "third-order:-2:z")
    np.testing.assert_allclose(both, one + two, atol=1e-9)


def test_letters_of_the_axis_name_output_and_inputs() -> None:
    """One letter stands for the plainest choice; more are output, then inputs."""
    assert parse_hidden("gyroscope/g-sensitivity:0.05:xy").axes == (0, 1)
    assert parse_hidden("gyroscope/g-sensitivity:0.05:z").axes == (2, 2)
    assert parse_hidden("cross-product:1:xyz").axes == (0, 1, 2)
    assert parse_hidden("cross-product:1:z").axes == (2, 2, 0)
    hidden = parse_hidden(" accelerometer/second-order:-2.5:y ")
    assert (hidden.sensor, hidden.size, hidden.axes, hidden.unit) == (
        "accelerometer",
        -2.5,
        (1,),
        "mg/g²",
    )


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("second-order:3", "TERM:SIZE:AXIS"),
        ("", "TERM:SIZE:AXIS"),
        ("wobble:3:x", "no effect 'wobble'"),
        ("g-sensitivity:3:x", "write gyroscope/g-sensitivity"),
        ("gyroscope/hysteresis:3:x", "no effect 'hysteresis'"),
        ("thermometer/second-order:3:x", "not a sensor"),
        ("second-order:big:x", "not a number"),
        ("second-order:nan:x", "not a number"),
        ("second-order:3:w", "axis is x, y or z"),
        ("second-order:3:xy", "axis is x, y or z"),
        ("second-order:3:", "axis is x, y or z"),
        ("cross-product:3:xy", "output and factors"),
    ],
)
def test_what_cannot_be_read_is_refused_with_what_to_write(text: str, says: str) -> None:
    """A clear usage error names the part that is wrong."""
    with pytest.raises(UsageError, match=says):
        parse_hidden(text)
