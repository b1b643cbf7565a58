"""Unit words at the edges."""

import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.units import canonical_unit, si_unit, unit_factor, unit_for_sensor


def test_a_g_is_gauss_for_a_field_and_a_gravity_for_an_acceleration() -> None:
    assert unit_for_sensor("magnetometer", "G") == "G"
    assert unit_for_sensor("accelerometer", "G") == "g"
    assert unit_factor("magnetometer", "mG") == pytest.approx(0.1)
    assert unit_factor("accelerometer", "mG") == pytest.approx(9.80665e-3)


def test_counts_stay_counts_and_an_unknown_word_stays_as_it_is() -> None:
    assert (unit_factor("gyroscope", "LSB"), si_unit("gyroscope", "LSB")) == (1.0, "count")
    assert canonical_unit("furlong") == "furlong"
    with pytest.raises(UsageError, match=r"'furlong' is not a unit of the gyroscope; .* mdeg/s"):
        unit_factor("gyroscope", "furlong")
