"""Triangular, symmetric and full are three forms of one calibration."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.linalg import polar, rq
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.gauge import symmetric, triangular
from imucal_wizard.estimate.parameters import full_parameters

Form = Callable[[FloatArray], tuple[FloatArray, FloatArray]]
FORMS: tuple[Form, ...] = (triangular, symmetric)


def matrices() -> st.SearchStrategy[FloatArray]:
    """Matrices of calibrations: any rotation of a distorted identity, any overall scale."""
    distortion = arrays(float, (3, 3), elements=st.floats(-0.25, 0.25))
    rotation = arrays(float, 3, elements=st.floats(-3.0, 3.0))
    gain = st.sampled_from([1e-4, 2.4e-3, 1.0, 9.80665, 1e3])
    return st.builds(
        lambda d, r, k: k * Attitude.from_rotvec(r).as_matrix() @ (np.eye(3) + d),
        distortion,
        rotation,
        gain,
    ).filter(lambda m: np.linalg.cond(m) < 100.0)


@pytest.mark.parametrize("form", FORMS)
@given(matrix=matrices())
def test_a_form_and_its_rotation_give_the_matrix_back(form: Form, matrix: FloatArray) -> None:
    """R F is M to rounding, and R is a proper rotation."""
    rotation, shape = form(matrix)
    assert np.abs(rotation @ shape - matrix).max() < 1e-13 * np.abs(matrix).max()
    assert np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-13)
    assert np.linalg.det(rotation) == pytest.approx(1.0, abs=1e-12)


@given(matrix=matrices())
def test_forms_convert_into_one_another(matrix: FloatArray) -> None:
    """Triangular to symmetric to triangular, by way of any frame, changes nothing."""
    triangle, symmetry = triangular(matrix)[1], symmetric(matrix)[1]
    size = np.abs(matrix).max()
    assert np.abs(triangular(symmetry)[1] - triangle).max() < 1e-12 * size
    assert np.abs(symmetric(triangle)[1] - symmetry).max() < 1e-12 * size


@given(matrix=matrices(), vector=arrays(float, 3, elements=st.floats(-3.0, 3.0)))
def test_no_form_changes_a_magnitude(matrix: FloatArray, vector: FloatArray) -> None:
    """|M y| is the same in every form: that is all that a magnitude can know."""
    length = np.linalg.norm(matrix @ vector)
    for form in FORMS:
        assert np.linalg.norm(form(matrix)[1] @ vector) == pytest.approx(length, rel=1e-12)


@given(matrix=matrices(), turned=arrays(float, 3, elements=st.floats(-3.0, 3.0)))
def test_a_form_does_not_depend_on_the_frame(matrix: FloatArray, turned: FloatArray) -> None:
    """A rotation from the left is what the forms take away."""
    rotated = Attitude.from_rotvec(turned).as_matrix() @ matrix
    for form in FORMS:
        assert np.abs(form(rotated)[1] - form(matrix)[1]).max() < 1e-12 * np.abs(matrix).max()


@given(matrix=matrices())
def test_the_forms_are_the_textbook_decompositions(matrix: FloatArray) -> None:
    """Symmetric is SciPy's polar decomposition; triangular is RQ of the sensitivity S = M⁻¹."""
    assert np.abs(symmetric(matrix)[1] - polar(matrix)[1]).max() < 1e-12 * np.abs(matrix).max()
    upper, _ = rq(np.linalg.inv(matrix))
    upper = upper * np.sign(np.diag(upper))
    inverse = np.linalg.inv(triangular(matrix)[1])
    assert np.abs(inverse - upper).max() < 1e-11 * np.abs(upper).max()


def test_triangular_and_symmetric_look_as_named() -> None:
    """Zeros below the diagonal and positive scales; equal across the diagonal and positive."""
    matrix = np.array([[0.9, 0.2, -0.1], [0.05, 1.1, 0.3], [-0.2, 0.1, 1.0]])
    triangle, symmetry = triangular(matrix)[1], symmetric(matrix)[1]
    assert (triangle[np.tril_indices(3, -1)] == 0.0).all()
    assert (np.diag(triangle) > 0.0).all()
    assert (symmetry == symmetry.T).all()
    assert (np.linalg.eigvalsh(symmetry) > 0.0).all()


def test_left_handed_axes_keep_a_proper_rotation() -> None:
    """A mirrored sensor is no rotation of a right-handed one, and its form says so."""
    mirrored = np.diag([1.01, 0.99, -1.02])
    for form in FORMS:
        rotation, shape = form(mirrored)
        assert np.linalg.det(rotation) == pytest.approx(1.0)
        assert np.allclose(rotation @ shape, mirrored, atol=1e-14)
        assert np.linalg.det(shape) < 0.0


@pytest.mark.parametrize("form", FORMS)
def test_a_singular_matrix_is_refused(form: Form) -> None:
    """An axis that says nothing has no form."""
    with pytest.raises(DataError, match="singular"):
        form(np.diag([1.0, 0.0, 1.0]))


def test_a_cross_axis_gain_is_what_a_rate_about_one_axis_shows_about_another() -> None:
    """``M_ij / M_jj``, in parts of the scale of the axis that turns."""
    matrix = np.array([[1.0, 0.02, 0.0], [0.0, 2.0, 0.1], [0.03, 0.0, 0.5]])
    values = full_parameters(matrix, np.array([1.0, 2.0, 3.0]))
    assert values["cross_xy"] == pytest.approx(0.01)
    assert values["cross_yz"] == pytest.approx(0.2)
    assert values["cross_zx"] == pytest.approx(0.03)
    assert values["sensitivity_z"] == pytest.approx(2.0)
    assert values["bias_y"] == 2.0
