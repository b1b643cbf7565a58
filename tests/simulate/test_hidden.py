"""Hidden effects: each moves only what its equation says."""

import numpy as np
import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Rotate, Shake
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.hidden import ACCELEROMETER_TERMS, GYROSCOPE_TERMS, parse_hidden
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


def _expected(term: str, m: Motion) -> FloatArray:
    """Closed forms for size 3 on the x axis, mg, from CONTRACT and catalogue."""
    x, y = _force(m, 0), _force(m, 1)
    minutes = m.time / 60.0
    vibration = (m.acceleration / STANDARD_GRAVITY) ** 2
    forms: dict[str, FloatArray] = {
        "second-order": 3.0 * x * x,
        "asymmetry": 3.0 * np.sqrt(x * x),
        "odd-quadratic": 3.0 * np.sign(x) * x * x,
        "third-order": 3.0 * x * x * x,
        "cross-product": 3.0 * x * y,
        "bias-temperature": 3.0 * _temperature(m),
        "scale-temperature": 3.0e-3 * _temperature(m) * x,
        "warm-up": 3.0 * np.exp(-m.time / 180.0),
        "bias-drift": 3.0 * minutes,
        "bias-step": np.where(minutes < 1.5, 0.0, 3.0),
        "hysteresis": 3.0 * m.previous[:, 0],
        "vibration-rectification": 3.0 * vibration.sum(1),
    }
    return forms[term]


@pytest.mark.parametrize("term", ACCELEROMETER_TERMS)
def test_an_accelerometer_effect_moves_its_axis_by_its_equation_and_nothing_else(term: str) -> None:
    """Size 3 on x changes x by the closed form; y, z and the gyroscope not at all."""
    force, rate, motion = _difference(f"{term}:3:x")
    expected = _expected(term, motion)
    assert np.abs(expected).max() > 1e-4
    np.testing.assert_allclose(force[:, 0], expected, atol=1e-9)
    assert np.abs(force[:, 1:]).max() < 1e-9
    assert np.abs(rate).max() < 1e-12


def _expected_rate(term: str, m: Motion) -> FloatArray:
    """Closed forms for size 3 on the y axis, °/s."""
    w = m.rate / DEGREE
    fy, minutes = _force(m, 1), m.time / 60.0
    forms: dict[str, FloatArray] = {
        "g-sensitivity": 3.0 * fy,
        "g2-sensitivity": 3.0 * fy**2,
        "second-order": 3.0e-5 * w[:, 1] ** 2,
        "asymmetry": 3.0e-3 * np.abs(w[:, 1]),
        "third-order": 3.0e-7 * w[:, 1] ** 3,
        "cross-product": 3.0e-5 * w[:, 1] * w[:, 2],
        "bias-temperature": 3.0 * _temperature(m),
        "scale-temperature": 3.0e-6 * _temperature(m) * w[:, 1],
        "warm-up": 3.0 * np.exp(-m.time / 180.0),
        "bias-drift": 3.0 * minutes,
        "bias-step": np.where(minutes < 1.5, 0.0, 3.0),
    }
    return forms[term]


@pytest.mark.parametrize("term", [name for name in GYROSCOPE_TERMS if name != "earth-rate"])
def test_a_gyroscope_effect_moves_its_axis_by_its_equation_and_nothing_else(term: str) -> None:
    """Size 3 on y changes y by the closed form; x, z and the accelerometer not at all."""
    force, rate, motion = _difference(f"gyroscope/{term}:3:y")
    expected = _expected_rate(term, motion)
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
