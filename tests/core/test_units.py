"""Unit words at the edges."""

import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.units import canonical, factor, si_unit, unit_of


def test_a_g_is_gauss_for_a_field_and_a_gravity_for_an_acceleration() -> None:
    assert unit_of("magnetometer", "G") == "G"
    assert unit_of("accelerometer", "G") == "g"
    assert factor("magnetometer", "mG") == pytest.approx(0.1)
    assert factor("accelerometer", "mG") == pytest.approx(9.80665e-3)


def test_counts_stay_counts_and_an_unknown_word_stays_as_it_is() -> None:
    assert (factor("gyroscope", "LSB"), si_unit("gyroscope", "LSB")) == (1.0, "count")
    assert canonical("furlong") == "furlong"
    with pytest.raises(UsageError, match=r"'furlong' is not a unit of the gyroscope; .* mdeg/s"):
        factor("gyroscope", "furlong")
