"""Terms of the bench's command line, by sensor."""

import pytest

from imucal_wizard.cli.bench import BASES, base_terms, wanted_terms
from imucal_wizard.core.errors import UsageError
from imucal_wizard.estimate.accelerometer import BASE
from imucal_wizard.estimate.magnetometer.field_data import FIELD_BASE

WHOLE = BASES["accelerometer"]


@pytest.mark.parametrize(
    ("text", "inertial", "magnetometer"),
    [
        ("bias,scale,non-orthogonality", WHOLE, ("bias", "soft-iron")),
        ("bias", ("bias",), ("bias",)),
        ("none", (), ()),
        ("bias, scale", ("bias", "scale"), ("bias",)),
        ("magnetometer/bias", WHOLE, ("bias",)),
        ("bias,magnetometer/bias,magnetometer/soft-iron", ("bias",), ("bias", "soft-iron")),
    ],
)
def test_the_base_is_said_for_all_sensors_or_for_one(
    text: str, inertial: tuple[str, ...], magnetometer: tuple[str, ...]
) -> None:
    found = base_terms(text)
    assert found["accelerometer"] == found["gyroscope"] == inertial
    assert found["magnetometer"] == magnetometer


def test_the_command_line_knows_the_solvers_bases_without_loading_it() -> None:
    assert BASES == {"accelerometer": BASE, "gyroscope": BASE, "magnetometer": FIELD_BASE}


@pytest.mark.parametrize(
    "text", ["bias,colour", "compass/bias", "bias,magnetometer/size", "gyroscope/soft-iron"]
)
def test_a_term_outside_the_base_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="is not in the base; it has bias"):
        base_terms(text)


def test_terms_to_add_go_to_their_sensor() -> None:
    found = wanted_terms(["second-order", "magnetometer/bias-drift", "gyroscope/g-sensitivity"])
    assert found == {
        "accelerometer": ["second-order"],
        "gyroscope": ["g-sensitivity"],
        "magnetometer": ["bias-drift"],
    }


@pytest.mark.parametrize(
    ("term", "sensor"),
    [("current", "magnetometer"), ("soft-iron", "magnetometer"), ("g-sensitivity", "gyroscope")],
)
def test_a_term_of_one_sensor_alone_is_asked_for_with_it(term: str, sensor: str) -> None:
    with pytest.raises(UsageError, match=f"write {sensor}/{term}"):
        wanted_terms([term])
