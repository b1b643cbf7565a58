"""Which parameters the still positions carry, decided from their directions."""

import numpy as np
import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.poses import DIRECTIONS, EDGES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.identifiability import (
    UNCALIBRATED,
    amplification,
    basis_of,
    expected_error,
    identifiable,
)
from tests.estimate.truth import (
    EIGHTEEN,
    SIX,
    even_directions,
    holds_of,
    tilted,
    typical_accelerometer,
)

ANGLES = {"theta_yz", "theta_zy", "theta_zx"}
XY_EDGES = np.array([EDGES[name] for name in ("+x+y", "+x-y", "-x+y", "-x-y")])
XZ_EDGES = np.array([EDGES[name] for name in ("+x+z", "+x-z", "-x+z", "-x-z")])
YZ_EDGES = np.array([EDGES[name] for name in ("+y+z", "+y-z", "-y+z", "-y-z")])


def _fit(up: FloatArray) -> SensorFit:
    rng = np.random.default_rng(0)
    noise = 1e-3 * rng.standard_normal((len(up), 3))
    holds = holds_of(typical_accelerometer(), up, noise=noise)
    return fit_accelerometer(holds, 9.80665, "m/s^2")


def _left(fit: SensorFit) -> set[str]:
    """Names of what is not carried; each stands at its nominal value, unjudged and named."""
    left = [p for p in fit.parameters if not p.carried]
    for parameter in left:
        assert parameter.value == 0.0
        assert parameter.standard_error is None
        assert parameter.standard_error_repeats is None
        assert any(parameter.name in warning for warning in fit.warnings)
    return {parameter.name for parameter in left}


def test_eighteen_poses_determine_everything() -> None:
    """Nine parameters, no warning, and each with a standard error."""
    fit = _fit(EIGHTEEN)
    assert _left(fit) == set()
    assert fit.warnings == ()
    assert fit.model == ("bias", "scale", "non-orthogonality")
    assert all(parameter.standard_error for parameter in fit.parameters)


def test_twelve_edges_alone_determine_everything() -> None:
    """Faces are no magic: twelve good directions do."""
    assert _left(_fit(np.array([*EDGES.values()]))) == set()


@pytest.mark.parametrize("seed", range(10))
def test_nine_directions_do_not_determine_nine_parameters(seed: int) -> None:
    """They can be fitted without error, and nothing would say how wrong that is."""
    fit = _fit(even_directions(9, np.random.default_rng(seed)))
    assert len(_left(fit)) >= 2


def test_six_faces_determine_bias_and_scale_and_leave_the_angles() -> None:
    """As the six-position method does; without repeats nothing judges the numbers."""
    fit = _fit(SIX)
    assert _left(fit) == ANGLES
    assert fit.model == ("bias", "scale")
    assert fit.rms_held_out is None
    assert all(parameter.standard_error is None for parameter in fit.parameters)
    assert fit.degrees_of_freedom == 0


def test_repeated_faces_are_judged_by_their_repeats() -> None:
    """Six more holds are no new directions, but six degrees of freedom."""
    fit = _fit(np.concatenate([SIX, SIX]))
    assert _left(fit) == ANGLES
    assert fit.repeatability is not None
    assert fit.degrees_of_freedom == fit.repeatability.freedom == 6
    assert all(p.standard_error for p in fit.parameters if p.carried)


@pytest.mark.parametrize(
    ("edges", "carried"),
    [(XY_EDGES, "theta_yz"), (XZ_EDGES, "theta_zy"), (YZ_EDGES, "theta_zx")],
)
def test_edges_about_one_axis_determine_the_one_angle_they_show(
    edges: FloatArray, carried: str
) -> None:
    """Six faces and the four edges between two of the axes: one angle, two left."""
    assert _left(_fit(np.concatenate([SIX, edges]))) == ANGLES - {carried}


def test_the_angle_between_x_and_z_may_be_left_alone() -> None:
    """Then it is zero exactly, although M_xz is not: the other two angles meet there (eq. 8)."""
    fit = _fit(np.concatenate([SIX, XY_EDGES, YZ_EDGES]))
    assert _left(fit) == {"theta_zy"}
    M = fit.matrix
    assert M[0, 2] == pytest.approx(M[0, 1] * M[1, 2] / M[1, 1], rel=1e-9)
    assert M[0, 2] != 0.0


def test_the_warning_says_which_edges_are_missing() -> None:
    """Advice that can be followed."""
    fit = _fit(np.concatenate([SIX, XY_EDGES]))
    assert "x and z; y and z" in fit.warnings[0]
    assert "x and y" not in fit.warnings[0]


def test_eight_equal_tilts_determine_one_common_scale() -> None:
    """N tilts four ways upright and upside down (VII-A).

    x² + y² is then a fixed multiple of z², so three separate scales are not carried, and no angle
    is claimed either.
    """
    s, c = np.sin(np.radians(30.0)), np.cos(np.radians(30.0))
    flat = [(s, 0.0), (-s, 0.0), (0.0, s), (0.0, -s)]
    tilts = np.array([(x, y, z) for z in (c, -c) for x, y in flat])
    fit = _fit(tilts)
    assert _left(fit) == ANGLES
    assert fit.matrix[0, 0] == fit.matrix[1, 1] == fit.matrix[2, 2]
    assert (
        "scale of its own for each axis: nominal angles and one scale are used" in fit.warnings[0]
    )


def test_eight_different_tilts_may_determine_three_scales_but_no_angle() -> None:
    """The off-diagonal elements that N sets to zero are left at zero."""
    tilts = [(0.7, 0.0), (-0.5, 0.0), (0.0, 0.8), (0.0, -0.4)]
    up = np.array([(np.sin(a), np.sin(b), z * np.cos(a + b)) for z in (1, -1) for a, b in tilts])
    fit = _fit(up)
    assert _left(fit) == ANGLES


@pytest.mark.parametrize("normal", ["x", "y", "z"])
def test_poses_in_a_plane_determine_nothing(normal: str) -> None:
    """Whatever their number: the axis across never sees gravity."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    ring = np.insert(
        np.column_stack([np.cos(angle), np.sin(angle)]), "xyz".index(normal), 0.0, axis=1
    )
    with pytest.raises(DataError, match=normal):
        _fit(ring)


def test_poses_nearly_in_a_plane_determine_nothing_either() -> None:
    """Three degrees of a hand's unsteadiness are no third dimension."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.zeros(24)])
    with pytest.raises(DataError):
        _fit(tilted(ring, 2.0, np.random.default_rng(1)))


def test_a_plane_across_all_axes_determines_nothing() -> None:
    """No axis is dead, and still one direction is never seen."""
    angle = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    across = np.linalg.svd(np.array([[1.0, 1.0, 1.0]]))[2][1:]
    ring = np.outer(np.cos(angle), across[0]) + np.outer(np.sin(angle), across[1])
    with pytest.raises(DataError, match="plane"):
        _fit(ring)


def test_one_hemisphere_is_determined_at_a_price() -> None:
    """The seventeen named directions not below the horizon: all is fitted, but less well."""
    half = _fit(np.array([up for up in DIRECTIONS.values() if up[2] >= 0.0]))
    whole = _fit(EIGHTEEN)
    assert _left(half) == set()
    errors = [
        {p.name: p.standard_error or 0.0 for p in fit.parameters}["bias_z"] / fit.rms_fitted
        for fit in (half, whole)
    ]
    assert errors[0] > 2.5 * errors[1]


def test_a_cap_is_too_little_for_nine() -> None:
    """Twenty directions within 35° of one another leave angles or scales undetermined."""
    rng = np.random.default_rng(3)
    up = tilted(np.tile([0.0, 0.0, 1.0], (20, 1)), 18.0, rng)
    with pytest.raises(DataError):
        _fit(up)


def test_amplification_is_what_noise_becomes() -> None:
    """Simulated: rms error at the worst direction over the noise of a hold, within 5 %."""
    rng = np.random.default_rng(4)
    full = basis_of(tuple(range(9)))
    design = _design(EIGHTEEN)
    everywhere = _design(even_directions(2000, rng))
    errors = everywhere @ np.linalg.pinv(design) @ rng.standard_normal((18, 4000))
    worst = float(np.sqrt((errors**2).mean(axis=1)).max())
    assert amplification(EIGHTEEN, full).max() == pytest.approx(worst, rel=0.05)


def test_the_expected_error_is_what_leaving_parameters_out_costs() -> None:
    """Simulated: sensors of usual sizes, angles left out, rms over new directions, within 5 %."""
    rng = np.random.default_rng(5)
    sizes = np.array([0.03, 0.03, 0.03, 0.02, 0.02, 0.02, 0.015, 0.015, 0.015])
    sensors = sizes[:, None] * rng.standard_normal((9, 4000))
    design, everywhere = _design(EIGHTEEN), _design(even_directions(2000, rng))
    readings = design @ sensors + 0.004 * rng.standard_normal((18, 4000))
    fitted = np.linalg.pinv(design[:, :6]) @ readings
    left = everywhere @ sensors - everywhere[:, :6] @ fitted
    six = basis_of((0, 1, 2, 3, 6, 8))
    expected = expected_error(EIGHTEEN, six, 0.004)
    assert expected == pytest.approx(float(np.sqrt((left**2).mean())), rel=0.05)
    assert expected < UNCALIBRATED


def _design(up: FloatArray) -> FloatArray:
    pairs = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]
    return np.column_stack([up, *(up[:, i] * up[:, j] for i, j in pairs)])


def test_a_better_set_never_determines_less() -> None:
    """Adding any of the named directions to the 18 keeps the model and lowers the error."""
    plain = identifiable(EIGHTEEN)
    least = expected_error(EIGHTEEN, plain.basis, 1e-3)
    for direction in DIRECTIONS.values():
        up = np.vstack([EIGHTEEN, direction])
        assert identifiable(up).terms == plain.terms
        assert expected_error(up, plain.basis, 1e-3) <= least + 1e-12
