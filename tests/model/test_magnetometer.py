"""The magnetometer's effects: columns in closed form, agreement with the simulator, lessons."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import MAGNETOMETER, FieldUnit
from imucal_wizard.model.formula import FormulaEffect
from imucal_wizard.model.lesson import (
    DIP,
    FIELD,
    SESSION_AMPERES,
    SESSION_MINUTES,
    SESSION_WARMTH,
    cost_of_ignoring,
    lesson,
    picture,
    session_poses,
)
from imucal_wizard.model.unknown_shape import UnknownShape
from imucal_wizard.simulate.forward import TrueCircumstances as Forward
from imucal_wizard.simulate.hidden import parse_hidden


def test_the_terms_of_the_contract_are_there() -> None:
    """The soft iron is a part of the base."""
    names = [known.name for known in effects_for(MAGNETOMETER)]
    assert names == ["misalignment", "current", "bias-temperature", "bias-drift"]


def test_in_the_ordinary_session_the_field_stands_at_one_dip() -> None:
    c = session_poses()
    sine = (c.magnetic * c.force).sum(axis=1) / (FIELD * c.gravity)
    np.testing.assert_allclose(sine, -np.sin(DIP), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(c.magnetic, axis=1), FIELD)


@pytest.mark.parametrize("term", ["misalignment", "current", "bias-temperature", "bias-drift"])
@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_the_simulator_written_apart_agrees_on_axis_sign_and_unit(term: str, axis: str) -> None:
    c, hidden = session_poses(), parse_hidden(f"magnetometer/{term}:0.7:{axis}")
    count = len(c)
    forward = Forward(
        np.zeros((count, 3)), np.zeros((count, 3)), 25.0 + np.repeat(SESSION_WARMTH, count // 5),
        np.repeat(SESSION_MINUTES, count // 5), np.zeros((count, 3)), np.zeros((count, 3)),
        np.zeros((count, 4)), c.magnetic, current=np.repeat(SESSION_AMPERES, count // 5),
    )  # fmt: skip
    known = effect(term)
    sizes = 0.7 * np.eye(3)["xyz".index(axis)]
    c = replace(c, reference_temperature=25.0, reference_time=0.0)
    expected = known.error(MAGNETOMETER, c, sizes)
    assert np.abs(expected).max() > 0.0
    np.testing.assert_allclose(hidden.error(forward), expected, atol=1e-12)
    assert hidden.unit == known.parameters(MAGNETOMETER)[0].unit


def test_a_misaligned_sensor_sees_the_field_turned_the_other_way() -> None:
    """To first order: ``R(φ)ᵀ m`` of a small turn φ about z."""
    c, angle = session_poses(), 0.1
    turn = np.radians(angle)
    matrix = np.array([[np.cos(turn), np.sin(turn), 0.0], [-np.sin(turn), np.cos(turn), 0.0],
                       [0.0, 0.0, 1.0]])  # fmt: skip
    moved = c.magnetic @ matrix.T - c.magnetic
    found = effect("misalignment").error(MAGNETOMETER, c, np.array([0.0, 0.0, angle]))
    np.testing.assert_allclose(found, moved, atol=FIELD * turn**2)


def test_of_a_misalignment_the_magnitude_shows_nothing_and_the_heading_all() -> None:
    """Half a degree about the vertical is as much of heading, and more where it is tilted."""
    sizes = np.array([0.0, 0.0, 0.5])
    price = cost_of_ignoring(effect("misalignment"), MAGNETOMETER, sizes)
    assert price.tilt_rms is None
    assert price.heading_worst is not None
    assert price.heading_worst > 0.5
    assert picture(effect("misalignment"), MAGNETOMETER).y_label == "m along up, µT"


@pytest.mark.parametrize("known", effects_for(MAGNETOMETER), ids=lambda known: known.name)
def test_every_effect_has_its_lesson_with_sizes_and_the_cost_in_degrees_of_heading(
    known: object,
) -> None:
    own = next(one for one in effects_for(MAGNETOMETER) if one is known)
    explained = lesson(own, MAGNETOMETER)
    assert "consumer" in explained.sizes
    assert "the heading wrong by" in explained.cost
    assert min(len(explained.what), len(explained.signature), len(explained.needs)) > 60
    assert len(np.unique(picture(own, MAGNETOMETER).x)) > 3


@pytest.mark.parametrize(
    ("name", "change", "says"),
    [
        ("current", {"current": np.full(300, np.nan)}, "current[A] or throttle[%]"),
        ("current", {"current": np.full(300, 2.0)}, "only one current, 2 A"),
        (
            "current",
            {"current": np.append(np.arange(299.0), np.nan)},
            "recorded for 299 of 300 means",
        ),
        ("misalignment", {}, "aligned by the dip of the field"),
    ],
)
def test_what_the_data_lack_is_told(name: str, change: dict[str, np.ndarray], says: str) -> None:
    reason = effect(name).lacking(MAGNETOMETER, replace(session_poses(), **change))  # type: ignore[arg-type] # one field at a time
    assert says in (reason or "")


def test_a_formula_may_depend_on_field_and_current() -> None:
    """``k*m*I`` on the axis itself; nothing to see where the current is unknown."""
    typed = FormulaEffect("x: k*mx*I/100", MAGNETOMETER)
    c = session_poses()
    columns = typed.columns(MAGNETOMETER, c)
    np.testing.assert_allclose(columns[:, 0, 0], c.magnetic[:, 0] * c.current / 100.0)
    assert not columns[:, 1:].any()
    unknown = replace(c, current=np.full(len(c), np.nan))
    assert "no current" in (typed.lacking(MAGNETOMETER, unknown) or "")


def test_a_formula_on_counts_is_in_counts() -> None:
    """As strong a prior as in µT: half a µT, of which each is 20 counts here."""
    c = session_poses()
    counts = replace(c, magnetic=20.0 * c.magnetic, field_unit=FieldUnit("count", 20.0))
    for text in ("k*m", "k*I", "k*m**2/1000"):
        typed = FormulaEffect(text, MAGNETOMETER)
        counted = typed.suited(counts)
        worth = [
            found.parameters(MAGNETOMETER)[0].typical
            * np.sqrt((found.columns(MAGNETOMETER, where)[:, :, 0] ** 2).sum(axis=1).mean())
            for found, where in ((typed, c), (counted, counts))
        ]
        assert worth == pytest.approx([0.5, 10.0])
        assert counted.parameters(MAGNETOMETER)[0].unit == "count"
        assert counted.suited(counts) is counted
    assert "count" in counted.stories[MAGNETOMETER].signature
    assert "µT" not in counted.stories[MAGNETOMETER].signature


def test_what_a_curve_costs_in_counts_is_the_same_angle() -> None:
    """Twenty counts for each µT turn the heading as far as this does."""
    c = session_poses()
    counts = replace(c, magnetic=20.0 * c.magnetic, field_unit=FieldUnit("count", 20.0))
    curve = effect("unknown-shape/x")
    assert isinstance(curve, UnknownShape)
    counted = curve.suited(counts)
    sizes = np.ones(len(curve.parameters(MAGNETOMETER)))
    costs = [
        cost_of_ignoring(one, MAGNETOMETER, scale * sizes).heading_rms
        for one, scale in ((curve, 1.0), (counted, 20.0))
    ]
    assert costs[0] is not None
    assert costs[1] == pytest.approx(costs[0], rel=1e-6)
