"""The simulator, written apart from the effects, agrees with them on names, units and axes."""

from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.effect import Circumstances, Effect
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Rotate, Shake
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.hidden import ACCELEROMETER_TERMS, GYROSCOPE_TERMS, parse_hidden
from imucal_wizard.simulate.motion import Motion
from imucal_wizard.simulate.samples import VirtualSamples, VirtualStream
from tests.simulate.sensors import ideal

POSES = ["+x-y", "-z+x", "+x+y+z", "-x-y", "+y-z", "-z"]
SCRIPT: list[Action] = [
    LieStill(4.0),
    *(
        action
        for n, pose in enumerate(POSES)
        for action in (Shake(0.05 if n % 2 else 0.0), PlacePose(pose), LieStill(4.0))
    ),
    Shake(0.0),
    *(Rotate(axis, 60.0 * sense, 150.0) for axis in "xyz" for sense in (1.0, -1.0)),
    LieStill(1.0),
]
COUNT = 5000
STEP_MINUTES = 0.34
REFERENCE_TEMPERATURE = 25.0
ROUGHLY = {"thermal-lag": 0.2}
"""Share of the largest value by which means over half a minute differ from the slope itself."""
VARIANTS = {
    "warm-up": 180.0,
    "bias-step": 60.0 * STEP_MINUTES,
    "scale-step": 60.0 * STEP_MINUTES,
}


def _take(*hidden: str) -> VirtualSamples:
    hand = VirtualHand()
    hand.perform(SCRIPT)
    return VirtualStream(hand, ideal(), hidden, step=STEP_MINUTES).take(COUNT)


@cache
def _without() -> VirtualSamples:
    return _take()


@cache
def _motion() -> Motion:
    hand = VirtualHand()
    hand.perform(SCRIPT)
    return hand.advance(COUNT)


def _holds() -> list[slice]:
    """Where the device rests for two seconds or more, a fifth of a second off at either end."""
    still = np.abs(_motion().rate).max(axis=1) < 1e-9
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    return [slice(a + 20, b - 20) for a, b in edges.reshape(-1, 2).tolist() if b - a > 200]


def _rows(parts: list[slice]) -> Circumstances:
    """Circumstances of these parts, of their mean force and so on; one row for each."""
    m, samples = _motion(), _without()

    def mean(values: FloatArray) -> FloatArray:
        return np.array([values[part].mean(axis=0) for part in parts])

    return Circumstances(
        force=mean(m.specific_force),
        rate=mean(m.rate),
        temperature=mean(samples.temperature),
        time=mean(m.time),
        previous=mean(m.previous) * 9.80665,
        vibration=mean((m.acceleration**2).sum(axis=1)),
        reference_temperature=REFERENCE_TEMPERATURE,
        reference_time=0.0,
    )


def _size_on(known: Effect, sensor: str, axes: tuple[int, ...], size: float) -> FloatArray:
    """Sizes (p,) with ``size`` on the parameter that ``--hidden`` names by these axes."""
    letters = ["xyz"[axis] for axis in axes]
    alone = {"earth-rate": "up", "clock": "all"}
    name = alone.get(known.name, letters[0] + "".join(sorted(letters[1:])))
    names = [parameter.name for parameter in known.parameters(sensor)]
    return np.asarray(size * (np.array(names) == name), np.float64)


def _typical(sensor: str, term: str) -> float:
    return effect(term).parameters(sensor)[0].typical


@pytest.mark.parametrize(
    ("term", "axis"),
    [
        *((term, axis) for term in ACCELEROMETER_TERMS for axis in ("x", "z")),
        *(("cubic-cross", axis) for axis in ("xxy", "yzy", "zxy")),
    ],
)
def test_readings_at_rest_move_by_columns_times_size(term: str, axis: str) -> None:
    """With the hidden effect minus without, sample by sample, to first order."""
    known, size = effect(term), -1.5 * _typical("accelerometer", term)
    hidden = parse_hidden(f"{term}:{size}:{axis}")
    holds = _holds()
    assert len(holds) >= 7
    every = np.concatenate([np.arange(hold.start, hold.stop, 7) for hold in holds])
    if term == "dead-zone":  # within the zone it is not linear in its size
        every = every[np.abs(_motion().specific_force[every, hidden.axes[0]]) > 0.05]
    moved = _take(f"{term}:{size}:{axis}").accelerometer - _without().accelerometer
    rows = _rows([slice(k, k + 1) for k in every.tolist()])
    sizes = _size_on(known, "accelerometer", hidden.axes, size)
    expected = known.error("accelerometer", rows, sizes, VARIANTS.get(term))
    scale = np.abs(expected).max()
    assert scale > 0.0
    np.testing.assert_allclose(moved[every], expected, atol=ROUGHLY.get(term, 1e-6) * scale)
    assert hidden.unit == known.parameters("accelerometer")[0].unit


GYROSCOPE_AXES = {
    "g-sensitivity": ("x", "xy", "zx"),
    "g2-sensitivity": ("y", "yz"),
    "cross-product": ("x", "z", "zyx"),
    "anisoelastic": ("y", "zyx"),
    "earth-rate": ("z",),
}


SAMPLE_BY_SAMPLE = [term for term in GYROSCOPE_TERMS if term != "axis-delay"]


@pytest.mark.parametrize(
    ("term", "axis"),
    [(t, axis) for t in SAMPLE_BY_SAMPLE for axis in GYROSCOPE_AXES.get(t, ("y",))],
)
def test_rates_move_by_columns_times_size_at_rest_and_in_motion(term: str, axis: str) -> None:
    """With the hidden effect minus without, sample by sample."""
    known, size = effect(term), 2.0 * _typical("gyroscope", term)
    text = f"gyroscope/{term}:{size}:{axis}"
    hidden = parse_hidden(text)
    moved = _take(text).gyroscope - _without().gyroscope
    every = np.arange(0, COUNT, 7)
    if term == "earth-rate":  # up is gravity's direction where nothing shakes or accelerates
        every = every[np.abs(_motion().acceleration[every]).max(axis=1) < 1e-9]
    rows = _rows([slice(k, k + 1) for k in every.tolist()])
    sizes = _size_on(known, "gyroscope", hidden.axes, size)
    expected = known.error("gyroscope", rows, sizes, VARIANTS.get(term))
    assert np.abs(expected).max() > 0.0
    share = ROUGHLY.get(term, 1e-9)
    np.testing.assert_allclose(moved[every], expected, atol=share * np.abs(expected).max())
    assert hidden.unit == known.parameters("gyroscope")[0].unit


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_late_axis_turns_the_attitude_as_its_products_of_rates_do(axis: str) -> None:
    """Over each motion from rest to rest, in the world, to the error of one sampling interval."""
    text = f"gyroscope/axis-delay:1.5:{axis}"
    moved, m = _take(text).gyroscope - _without().gyroscope, _motion()
    every = _rows([slice(k, k + 1) for k in range(COUNT)])
    sizes = _size_on(effect("axis-delay"), "gyroscope", parse_hidden(text).axes, 1.5)
    expected = effect("axis-delay").error("gyroscope", every, sizes)
    to_world = Attitude.from_quat(np.roll(m.attitude, -1, axis=1))
    ends = [0, *(hold.start for hold in _holds()), COUNT]
    turned = [
        np.array([to_world[a:b].apply(error[a:b]).sum(axis=0) for a, b in pairwise(ends)])
        for error in (moved, expected)
    ]
    assert np.abs(turned[1]).max() > 1e-4 * 100.0  # rad, in samples of 10 ms
    np.testing.assert_allclose(turned[0], turned[1], atol=0.04 * np.abs(turned[1]).max())


def test_both_sides_know_the_same_terms() -> None:
    """What can be hidden can be found, and the other way round."""
    from imucal_wizard.model.catalogue import effects_for

    assert {known.name for known in effects_for("accelerometer")} == set(ACCELEROMETER_TERMS)
    assert {known.name for known in effects_for("gyroscope")} == set(GYROSCOPE_TERMS)
