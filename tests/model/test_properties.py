"""What holds for every effect, whatever the circumstances."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.catalogue import builtin_effects, effects_for
from imucal_wizard.model.effect import Circumstances, Effect
from imucal_wizard.model.lesson import lesson, picture

PAIRS = [
    (effect, sensor) for sensor in ("accelerometer", "gyroscope") for effect in effects_for(sensor)
]
each = pytest.mark.parametrize(
    ("effect", "sensor"), PAIRS, ids=[f"{sensor}-{effect.name}" for effect, sensor in PAIRS]
)


@st.composite
def sessions(draw: st.DrawFn) -> Circumstances:
    """Anything a recording can be: few or many rows, unknown temperatures, no pose before."""
    n = draw(st.integers(1, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))

    def unknown(values: FloatArray) -> FloatArray:
        return np.where(rng.random(n)[:, None] < draw(st.sampled_from([0, 0.3, 1])), np.nan, values)

    return Circumstances(
        force=rng.uniform(-40.0, 40.0, (n, 3)) * draw(st.sampled_from([0, 1])),
        rate=rng.uniform(-35.0, 35.0, (n, 3)) * draw(st.sampled_from([0, 1])),
        temperature=unknown(rng.uniform(-40.0, 85.0, (n, 1)))[:, 0],
        time=np.sort(rng.uniform(0.0, 7200.0, n)),
        previous=unknown(rng.uniform(-10.0, 10.0, (n, 3))),
        vibration=unknown(rng.uniform(0.0, 10.0, (n, 1)))[:, 0],
    )


@each
@settings(max_examples=40)
@given(c=sessions())
def test_columns_are_finite_and_linear_for_every_variant(
    effect: Effect, sensor: str, c: Circumstances
) -> None:
    """(n, 3, p) finite numbers; twice the size is twice the error; rows stand for themselves."""
    p = len(effect.parameters(sensor))
    sizes = np.arange(1.0, p + 1.0)
    for variant in effect.variants(c):
        columns = effect.columns(sensor, c, variant)
        assert columns.shape == (len(c), 3, p)
        assert np.isfinite(columns).all()
        error = effect.error(sensor, c, sizes, variant)
        assert error.shape == (len(c), 3)
        np.testing.assert_allclose(effect.error(sensor, c, -2.0 * sizes, variant), -2.0 * error)
        last = effect.columns(sensor, c.select(slice(-1, None)), variant)
        np.testing.assert_array_equal(last, columns[-1:])


@each
@settings(max_examples=40)
@given(c=sessions())
def test_what_is_lacking_is_a_sentence_or_nothing(
    effect: Effect, sensor: str, c: Circumstances
) -> None:
    """No data make it fail."""
    reason = effect.lacking(sensor, c)
    assert reason is None or len(reason) > 10


def neutral() -> Circumstances:
    """Weightless, at rest, at the mean temperature, in the middle of an unshaken session."""
    nothing = np.zeros((1, 3))
    return Circumstances(
        force=nothing,
        rate=nothing,
        temperature=np.array([25.0]),
        time=np.array([600.0]),
        previous=np.full((1, 3), np.nan),
        vibration=np.zeros(1),
    )


@each
def test_without_its_cause_an_effect_moves_nothing(effect: Effect, sensor: str) -> None:
    """Warm-up fades, and a step is nothing before its moment; all others are exactly 0."""
    variant = {"warm-up": 60.0, "bias-step": 601.0}.get(effect.name)
    size = effect.columns(sensor, neutral(), variant)
    usual = effect.error(sensor, neutral(), np.ones(size.shape[2]), variant)
    assert np.abs(usual).max() < 1e-4 * abs(effect.parameters(sensor)[0].typical)
    if effect.name != "warm-up":
        np.testing.assert_array_equal(size, np.zeros_like(size))


@each
def test_an_effect_says_what_a_screen_and_a_prior_need(effect: Effect, sensor: str) -> None:
    """Names, units, a positive prior within the consumer range's reach, grades in order."""
    names = [parameter.name for parameter in effect.parameters(sensor)]
    assert len(set(names)) == len(names)
    assert effect.title
    assert effect.equation
    for parameter in effect.parameters(sensor):
        assert parameter.unit
        assert list(parameter.grades) == ["consumer", "industrial", "tactical"]
        for low, high in parameter.grades.values():
            assert 0.0 <= low < high
        low, high = parameter.grades["consumer"]
        assert low <= parameter.typical <= high
        assert set(parameter.chosen) <= set(parameter.grades)


@each
def test_every_lesson_is_told_in_full(effect: Effect, sensor: str) -> None:
    """Each part is a text of its own; sizes carry the unit, the cost a number of degrees."""
    explained = lesson(effect, sensor)
    parts = [
        explained.what,
        explained.equation,
        explained.signature,
        explained.sizes,
        explained.needs,
        explained.cost,
    ]
    parts += [explained.remedy, explained.confirm, explained.source]
    assert all(len(part) > 20 for part in parts)
    assert len(set(parts)) == len(parts)
    assert effect.parameters(sensor)[0].unit in explained.sizes
    assert "wrong by" in explained.cost
    assert "nan" not in " ".join(parts).replace("°", " ").split()


@each
def test_a_lesson_names_what_looks_like_the_effect(effect: Effect, sensor: str) -> None:
    """All other members of its family that the sensor has, and the aliases of its own."""
    alike = lesson(effect, sensor, builtin_effects()).alike
    others = {one.name for one in builtin_effects() if sensor in one.sensors} - {effect.name}
    family = {
        one.name for one in builtin_effects() if effect.family and one.family == effect.family
    }
    exactly = {*effect.aliases, *effect.aliases_while_settling} & others
    wanted = (family & others) | exactly
    assert {name for name in others if name in re.split(r"[ ,.:]+", alike)} == wanted
    assert ("Exactly" in alike) is bool(exactly)


@each
def test_the_picture_of_a_lesson_shows_the_effect(effect: Effect, sensor: str) -> None:
    """The base model absorbs no effect whole in an ordinary session; 1e-4 mg or °/s is nothing."""
    assert np.abs(picture(effect, sensor).y).max() > 1e-4


def test_family_members_are_those_of_the_contract() -> None:
    """Families that 1 g cannot split; other effects may join them, or have other families."""
    families: dict[str, set[str]] = {}
    for effect in builtin_effects():
        if effect.family:
            families.setdefault(effect.family, set()).add(effect.name)
    wanted = {
        "even-order": {"second-order", "asymmetry", "cross-product"},
        "odd-order": {"third-order", "odd-quadratic"},
        "slow-bias": {"bias-temperature", "warm-up", "bias-drift", "bias-step"},
    }
    assert {name: families[name] & members for name, members in wanted.items()} == wanted
    members = [name for names in families.values() for name in names]
    assert len(members) == len(set(members))
