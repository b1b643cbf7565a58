"""What static poses at 1 g see of an effect: the radial part, less what nine parameters take up.

The nine are the spherical harmonics of degree 0, 1 and 2; only degree 3 and more is left.
"""

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.formula import FormulaEffect
from tests.model.sphere import at_rest, full_sphere

MILLI_G = 9.80665e-3
SPHERE = full_sphere()
SESSION = at_rest(SPHERE)


def left(radial: FloatArray) -> FloatArray:
    """What the nine base parameters do not take up, for columns (n,) or (n, p)."""
    x, y, z = SPHERE.T
    base = np.stack([x, y, z, x * x, y * y, z * z, x * y, x * z, y * z], axis=1)
    q, _ = np.linalg.qr(base)
    return np.asarray(radial - q @ (q.T @ radial), np.float64)


def radial(name: str, parameter: str) -> FloatArray:
    """The radial error of one parameter on the full sphere, per mg/g…; shape (n,)."""
    known = FormulaEffect(name, "accelerometer") if ":" in name else effect(name)
    names = [one.name for one in known.parameters("accelerometer")]
    columns = known.columns("accelerometer", SESSION)[:, :, names.index(parameter)]
    return np.asarray((columns * SPHERE).sum(axis=1) / MILLI_G, np.float64)


def radials(name: str) -> FloatArray:
    """The radial errors of all parameters of an effect, shape (n, p)."""
    known = FormulaEffect(name, "accelerometer") if ":" in name else effect(name)
    columns = known.columns("accelerometer", SESSION) / MILLI_G
    return np.asarray((columns * SPHERE[:, :, None]).sum(axis=1), np.float64)


def rms(values: FloatArray) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.mark.parametrize(
    ("name", "parameter", "raw", "rest"),
    [
        ("second-order", "x", 0.378, 0.151),
        ("second-order", "z", 0.378, 0.151),
        ("asymmetry", "x", 0.447, 0.112),
        ("odd-quadratic", "y", 0.378, 0.047),
        ("third-order", "x", 0.333, 0.076),
        ("cross-product", "xxy", 0.169, 0.123),
        ("cross-product", "xyz", 0.098, 0.098),
        ("x: k*sign(a)", "k", 0.577, 0.072),
    ],
)
def test_most_of_an_effect_is_swallowed_by_the_base(
    name: str, parameter: str, raw: float, rest: float
) -> None:
    """Root mean square of the radial column before and after the nine base parameters."""
    column = radial(name, parameter)
    assert rms(column) == pytest.approx(raw, abs=6e-4)
    assert rms(left(column)) == pytest.approx(rest, abs=6e-4)


def test_sixty_percent_of_the_second_order_term_is_a_bias() -> None:
    """On the sphere x³ is 0.6 x and what is left."""
    column = radial("second-order", "x")
    np.testing.assert_allclose(left(column), column - 0.6 * SPHERE[:, 0], atol=2e-3)


@pytest.mark.parametrize(
    ("one", "other", "correlation"),
    [
        ("second-order", "asymmetry", 0.986),
        ("third-order", "odd-quadratic", 0.992),
        ("second-order", "x: k*a**4", 0.975),
        ("x: k*sign(a)", "odd-quadratic", -0.917),
        ("x: k*sign(a)", "third-order", -0.866),
    ],
)
def test_pairs_that_gravity_hardly_tells_apart(one: str, other: str, correlation: float) -> None:
    """Correlation of what is left, on the full sphere."""
    a = left(radial(one, "k" if ":" in one else "x"))
    b = left(radial(other, "k" if ":" in other else "x"))
    cosine = float(a @ b / np.sqrt((a @ a) * (b @ b)))
    assert cosine == pytest.approx(correlation, abs=2e-3)


def rank(columns: FloatArray) -> int:
    return int(np.linalg.matrix_rank(columns, tol=1e-6 * np.linalg.norm(columns)))


def test_the_product_of_all_three_axes_is_the_same_on_every_axis() -> None:
    """``u_y u_z`` on x, ``u_x u_z`` on y and ``u_x u_y`` on z: three names of one residual."""
    same = [radial("cross-product", name) for name in ("xyz", "yxz", "zxy")]
    assert rank(np.stack(same, axis=1)) == 1
    np.testing.assert_allclose(same[0], same[1], atol=1e-12)


def test_a_product_on_one_axis_is_a_square_on_another() -> None:
    """``u_x u_y`` on x is ``u_x²`` on y."""
    square = radial("y: k*ax**2", "k")
    np.testing.assert_allclose(radial("cross-product", "xxy"), square, atol=1e-12)


def test_the_second_order_term_is_two_products_and_a_bias() -> None:
    """``x³ = x − x y² − x z²``: K₂ on x, with ``yxy`` and ``zxz``, leaves nothing."""
    total = sum(left(radial("cross-product", name)) for name in ("yxy", "zxz"))
    np.testing.assert_allclose(left(radial("second-order", "x")), -total, atol=1e-12)


def test_eighteen_quadratic_coefficients_show_in_seven_ways() -> None:
    """The products alone have all seven; squares of any axis on any axis add none."""
    squares = [radials(f"{i}: k1*ax**2 + k2*ay**2 + k3*az**2") for i in "xyz"]
    products = radials("cross-product")
    assert rank(left(products)) == 7
    assert rank(left(np.hstack([products, *squares]))) == 7


def test_thirty_cubic_coefficients_show_in_nine_ways() -> None:
    """Ten monomials on each axis are ninefold, as the harmonics of degree 4 are."""
    monomials = "ax**3 ay**3 az**3 ax**2*ay ax**2*az ay**2*ax ay**2*az az**2*ax az**2*ay ax*ay*az"
    terms = " + ".join(f"k{n}*{term}" for n, term in enumerate(monomials.split()))
    columns = np.hstack([radials(f"{axis}: {terms}") for axis in "xyz"])
    assert columns.shape[1] == 30
    assert rank(left(columns)) == 9


def test_one_of_three_squares_of_gravity_is_a_bias_of_the_gyroscope() -> None:
    """At 1 g the squares add up to a constant: six of nine g² coefficients and three biases."""
    columns = effect("g2-sensitivity").columns("gyroscope", SESSION)
    biases = np.tile(np.eye(3), (len(SESSION), 1))
    both = np.hstack([columns.reshape(-1, 9) / columns.max(), biases])
    assert rank(both) == 9


def test_the_earth_looks_like_a_g_sensitivity_equal_on_all_axes() -> None:
    """The vertical part lies in the span of the nine g-sensitivity columns."""
    linear = effect("g-sensitivity").columns("gyroscope", SESSION)
    earth = effect("earth-rate").columns("gyroscope", SESSION)[:, :, 0]
    equal = linear[:, :, [0, 4, 8]].sum(axis=2)
    np.testing.assert_allclose(earth, equal / 3600.0, rtol=1e-12)
