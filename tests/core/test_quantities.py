"""Numbers, errors and units as they are printed."""

import math

import pytest

from imucal_wizard.core.quantities import number, plus_minus, quantity, size_with_unit
from imucal_wizard.core.units import STANDARD_GRAVITY

MILLI_G = STANDARD_GRAVITY / 1000.0


@pytest.mark.parametrize(
    ("unit", "value", "text"),
    [
        ("m/s^2", 36.38 * MILLI_G, "36.4 mg"),
        ("m/s^2", 0.0744 * MILLI_G, "0.0744 mg"),
        ("rad", math.radians(0.0283), "0.0283°"),
        ("rad/s", math.radians(1.244), "1.24 °/s"),
        ("uT", 0.4, "0.400 µT"),
        ("count", 48496.0, "48496 count"),
        ("m/s^2", None, "not known"),
        ("rad", math.nan, "not known"),
    ],
)
def test_an_error_is_shown_in_the_unit_people_read(
    unit: str, value: float | None, text: str
) -> None:
    """Three digits: two errors of 0.03° may differ by half."""
    assert quantity(value, unit) == text


def test_a_size_keeps_its_own_unit() -> None:
    """Two digits; a unit that is itself a number is multiplied."""
    assert size_with_unit(-5.06, "mg/g²") == "−5.1 mg/g²"
    assert size_with_unit(2.0, "1e-3") == "2.0 × 1e-3"


def test_a_value_has_the_decimals_of_its_error() -> None:
    """Two digits of the error; the value alone where the error is not known."""
    assert plus_minus(-5.0312, 0.11) == "−5.03 ± 0.11"
    assert plus_minus(-5.0312, None) == "−5.03"


def test_a_missing_number_is_printed_as_a_dash() -> None:
    """Tables stay in their columns."""
    assert number(None) == number(math.inf) == "–"
