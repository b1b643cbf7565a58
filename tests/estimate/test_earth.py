"""The Earth's rate in rests and rotations of a gyroscope with little noise."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Attitude

from benchmarks.gyroscope_bound import DEVICES, NAMES, Device, Session, fitted
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.held_out import items_of
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.rows.earth import ALONE, LEVEL, UPWARD, earth_axes
from imucal_wizard.model.terms import Term

QUIET = next(one for one in DEVICES if "0.0005" in one.name)
BROKEN = next(one for one in DEVICES if "chains" in one.name)
PER_HOUR = np.radians(1.0 / 3600.0)


@pytest.mark.parametrize(("device", "most"), [(QUIET, 0.6), (BROKEN, 2.4)], ids=["whole", "broken"])
def test_the_earth_is_no_part_of_a_bias(device: Device, most: float) -> None:
    """At an unknown latitude and with an unknown heading; four standard deviations each."""
    session = Session(device, 3)
    found = fitted(*session.recorded(np.random.default_rng(4)))
    own = {one.name: one for one in found.parameters}
    for name, true in zip(NAMES[9:], session.gyroscope.bias, strict=True):
        error = own[name].standard_error
        assert error is not None
        assert abs(own[name].value - true) < min(4.0 * error, most * PER_HOUR)
    # what is left of the rows is their noise
    assert found.minimum is not None
    system = found.minimum.system
    assert (found.minimum.balance.variance == system.own).all()


def test_the_effect_reports_what_every_fit_allows_for() -> None:
    """Its size is the vertical rate, the parameters are those of the fit without it."""
    session, rng = Session(QUIET, 3), np.random.default_rng(5)
    latitude = np.random.default_rng(5).uniform(-65.0, 65.0)  # the first number that is drawn
    plain = fitted(*session.recorded(rng))
    assert plain.experiment is not None
    added = fit(plain.experiment, (Term(effect("earth-rate")),))
    up, error = float(added.sizes[0][0]), float(added.size_errors[0][0])
    assert error < 0.5
    assert abs(up - 15.041 * np.sin(np.radians(latitude))) < 4.0 * error
    assert added.bias == pytest.approx(plain.bias, abs=0.01 * PER_HOUR)
    assert added.minimum is not None
    assert "earth-rate_up" not in added.minimum.shared


def test_rotations_carry_the_headings_until_the_chain_breaks() -> None:
    """Level directions of one chain are the same in the world; a rest in two parts is one."""
    rng = np.random.default_rng(6)
    lying = Attitude.from_rotvec(rng.standard_normal((7, 3)))
    lying = Attitude.concatenate([lying[:3], lying[2], lying[4:]])
    up = lying.inv().apply([0.0, 0.0, 1.0])
    before, after = np.array([0, 1, 5]), np.array([1, 2, 6])
    ends = (lying[before].inv() * lying[after]).as_matrix()
    found = earth_axes(up, np.array([0, 1, 2, 2, 3, 4, 5]), before, after, ends)
    assert found.chain.tolist() == [0, 0, 0, 0, ALONE, 1, 1]
    world = lying.as_matrix() @ found.axes
    assert world[:, :, 0] == pytest.approx(np.tile([0.0, 0.0, 1.0], (7, 1)))
    assert world[1:4] == pytest.approx(np.tile(world[0], (3, 1, 1)))
    assert world[6] == pytest.approx(world[5])
    # together they are a rate of the Earth's size in any direction that is level or upright
    rates = found.rates(np.arange(7))
    assert rates.shape == (7, 3, 5)
    each = (rates**2).sum(axis=(1, 2)) + found.unknown.sum(axis=1)
    assert each == pytest.approx(np.full(7, UPWARD**2 + 2.0 * LEVEL**2))
    assert np.sqrt(each[0]) / PER_HOUR == pytest.approx(15.041, abs=1e-3)


def test_the_error_contains_the_earths_part() -> None:
    """Errors are those of matrix and bias alone, as who applies the calibration has them."""
    session = Session(QUIET, 3)
    found = fitted(*session.recorded(np.random.default_rng(4)))
    assert found.minimum is not None
    turned = items_of(found.minimum).rms(
        found.minimum.errors - found.minimum.independent.measured(found.minimum.system.residual)
    )
    assert found.rms_fitted > 2.0 * (found.floor_fitted or 0.0)
    assert turned == pytest.approx(found.rms_fitted, rel=0.1)
