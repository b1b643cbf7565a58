"""The picture in a lesson shows what the words beside it say."""

import numpy as np
import pytest

from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import Effect
from imucal_wizard.model.formula import FormulaEffect
from imucal_wizard.model.lesson import picture, session_poses


@pytest.mark.parametrize(
    ("known", "sensor"),
    [(known, sensor) for sensor in ("accelerometer", "gyroscope") for known in effects_for(sensor)],
)
def test_every_effect_has_a_picture_in_which_something_is_seen(known: Effect, sensor: str) -> None:
    """Points in the order of x, over something that varies, with a residual that does."""
    seen = picture(known, sensor)
    assert np.isfinite(seen.x).all()
    assert (np.diff(seen.x) >= 0.0).all()
    assert np.ptp(seen.x) > 0.0
    assert np.ptp(seen.y) > 0.0
    assert "," in seen.x_label
    assert seen.y_label.endswith(("mg", "°/s"))


def test_a_second_order_term_is_an_s_that_crosses_zero_at_forty_degrees_from_the_face() -> None:
    """2 mg/g² leave 2·(x³ − 0.6 x) mg: +0.8 at one face, −0.8 at the other."""
    seen = picture(effect("second-order"), "accelerometer")
    np.testing.assert_allclose(seen.y, 2.0 * (seen.x**3 - 0.6 * seen.x), atol=0.02)


def test_g_sensitivity_is_a_straight_line_over_the_force() -> None:
    """0.1 °/s/g: a slope of 0.1 at rest and in motion alike."""
    seen = picture(effect("g-sensitivity"), "gyroscope")
    np.testing.assert_allclose(seen.y, 0.1 * seen.x, atol=1e-9)
    assert seen.x_label == "force along x, g"


def test_a_typed_formula_is_drawn_over_what_it_depends_on() -> None:
    """Temperature before anything else; sizes other than the usual ones may be given."""
    seen = picture(FormulaEffect("x: k*T*w", "gyroscope"), "gyroscope", np.array([0.01]))
    assert seen.x_label == "temperature, °C"
    wide = picture(FormulaEffect("x: k*T*w", "gyroscope"), "gyroscope", np.array([0.02]))
    np.testing.assert_allclose(wide.y, 2.0 * seen.y)


def test_an_asymmetry_bends_nowhere_in_the_magnitude() -> None:
    """1.5 mg/g leave 1.5·(x|x| − 0.75 x) mg: the gain changes where the axis adds nothing."""
    seen = picture(effect("asymmetry"), "accelerometer")
    law = 1.5 * (seen.x * np.abs(seen.x) - 0.75 * seen.x)
    np.testing.assert_allclose(seen.y, law, atol=0.02)
    assert "kink" not in effect("asymmetry").stories["accelerometer"].signature


def test_two_fifths_of_a_cross_product_pass_for_a_bias() -> None:
    """2 mg/g² on xxy leave 2·(x²y − y/5) mg: at an edge 0.42 of 0.71, at the faces of y −0.4."""
    seen = picture(effect("cross-product"), "accelerometer")
    y = session_poses().force[:, 1] / STANDARD_GRAVITY
    x = session_poses().force[:, 0] / STANDARD_GRAVITY
    order = np.argsort(y, kind="stable")
    np.testing.assert_allclose(seen.y, (2.0 * (x**2 * y - y / 5.0))[order], atol=0.02)
    assert "40 %" in effect("cross-product").stories["accelerometer"].signature


def test_a_dead_zone_has_a_kink_in_the_magnitude_and_no_jump() -> None:
    """2 mg leave −2·(|x| − 15/16 x² − 3/16) mg: one sign at faces and level, another at 45°."""
    seen = picture(effect("dead-zone"), "accelerometer")
    law = -2.0 * (np.abs(seen.x) - 15 / 16 * seen.x**2 - 3 / 16)
    np.testing.assert_allclose(seen.y, law, atol=0.02)
    signature = effect("dead-zone").stories["accelerometer"].signature
    assert "kink" in signature
    assert "jump" not in signature


@pytest.mark.parametrize(
    ("name", "sensor", "untrue"),
    [
        ("warm-up", "accelerometer", "zero in the last"),
        ("vibration-rectification", "accelerometer", "quiet holds have none"),
        ("current", "magnetometer", "through zero"),
    ],
)
def test_no_signature_forgets_the_mean_that_the_bias_absorbs(
    name: str, sensor: str, untrue: str
) -> None:
    """Where the effect itself is almost nothing, the residual is that of the absorbed mean."""
    known = effect(name)
    seen = picture(known, sensor)
    least = seen.x == (seen.x.max() if name == "warm-up" else seen.x.min())
    assert np.abs(seen.y[least]).max() > 0.2 * np.abs(seen.y).max()
    assert untrue not in known.stories[sensor].signature
