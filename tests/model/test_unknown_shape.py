"""The free curve: its prior in closed form, and what of it bias and scale leave."""

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.terms import Term, Terms, corrected
from imucal_wizard.model.unknown_shape import NODES, SETTINGS, UnknownShape
from imucal_wizard.report.calibration_file import SavedEffect

LENGTHS_AND_SIZES = [(0.1, 0.3), (0.4, 3.0)]


def curve(name: str) -> UnknownShape:
    """The curve of this name."""
    found = effect(name)
    assert isinstance(found, UnknownShape)
    return found


def held(up_x: FloatArray, minutes: FloatArray | None = None) -> Circumstances:
    """Holds with these forces along x, g, at these times of a session of ten minutes."""
    n = len(up_x)
    force = STANDARD_GRAVITY * np.column_stack([up_x, np.sqrt(1.0 - up_x**2), np.zeros(n)])
    none = np.zeros((n, 3))
    time = np.zeros(n) if minutes is None else 60.0 * minutes
    return Circumstances(
        force, none, np.full(n, 25.0), time, none, np.zeros(n), reference_time=300.0
    )


@pytest.mark.parametrize(("length", "size"), LENGTHS_AND_SIZES)
def test_the_prior_is_matern_without_its_straight_part(length: float, size: float) -> None:
    """Covariance at the nodes: Matérn 3/2, freed of constant and line on both sides."""
    variant = float(SETTINGS.index((length, size)))
    found = curve("unknown-shape/x")
    shape = found.shape(NODES, variant) * found.typical("accelerometer", variant)
    apart = 3.0**0.5 * np.abs(np.subtract.outer(NODES, NODES)) / length
    matern = size**2 * (1.0 + apart) * np.exp(-apart)
    left = np.eye(len(NODES)) - np.array(
        [np.polyval(np.polyfit(NODES, one, 1), NODES) for one in np.eye(len(NODES))]
    )
    assert shape @ shape.T == pytest.approx(left.T @ matern @ left, abs=1e-9 * size**2)


def test_the_sum_of_squares_of_the_coefficients_is_the_mean_square() -> None:
    found, sizes = curve("unknown-shape/x"), np.random.default_rng(1).standard_normal(19)
    values = found.error("accelerometer", held(NODES), sizes, 8.0) / (1e-3 * STANDARD_GRAVITY)
    assert np.mean(values[:, 0] ** 2) == pytest.approx(sizes @ sizes)
    assert not values[:, 1:].any()


@pytest.mark.parametrize(
    ("name", "most"), [("x-temperature", 40.0), ("x", 1800.0), ("x-current", 30.0)]
)
def test_the_range_reaches_as_far_as_the_session(name: str, most: float) -> None:
    """A chamber from −20 to 60 °C, a table at 1,800 °/s, motors of 60 A."""
    places = np.linspace(-1.0, 1.0, 9)
    c = replace(
        held(np.zeros(9)),
        temperature=20.0 + 40.0 * places,
        rate=np.radians(1800.0) * places[:, None] * np.eye(3)[0],
        current=30.0 + 30.0 * places,
        reference_temperature=20.0,
    )
    sensor = (
        "gyroscope" if name == "x" else "magnetometer" if "current" in name else "accelerometer"
    )
    found = curve(f"unknown-shape/{name}").suited(c)
    assert found.reach == pytest.approx(most)
    assert found.range(sensor, c).reach == pytest.approx(most)
    assert found.place(sensor, c) == pytest.approx(places)
    calm = replace(c, temperature=np.full(9, 20.0), rate=0.1 * c.rate, current=0.1 * c.current)
    assert found.place(sensor, calm) == pytest.approx(
        curve(found.name).reaching(most).place(sensor, calm)
    )
    assert curve(found.name).suited(calm).reach is None


def test_a_calibration_keeps_how_far_its_curve_reaches() -> None:
    """One of an earlier version does not state it: its curves have the usual range."""
    name, parameters = "unknown-shape/x-temperature", [f"x{k}" for k in range(1, 21)]
    saved = SavedEffect(name, "accelerometer", "", parameters, [0.0] * 20, "mg", 3.0, 20.0, 300.0)
    for one, reach in ((saved, 20.0), (msgspec.structs.replace(saved, reach=40.0), 40.0)):
        again = msgspec.json.decode(msgspec.json.encode(one), type=SavedEffect).known().effect
        assert isinstance(again, UnknownShape)
        assert again.range("accelerometer", held(np.zeros(2))).reach == reach


def test_beyond_the_range_the_curve_keeps_its_last_value() -> None:
    found = curve("unknown-shape/x-time")
    inside = found.columns("accelerometer", held(np.zeros(1), np.array([10.0])), 3.0)
    late = found.columns("accelerometer", held(np.zeros(1), np.array([30.0])), 3.0)
    assert late == pytest.approx(inside)


def test_a_curve_has_a_name_per_axis_and_influence_and_is_no_effect_of_the_catalogue() -> None:
    names = {
        f"unknown-shape/{axis}{over}" for axis in "xyz" for over in ("", "-time", "-temperature")
    }
    assert {curve(name).name for name in names} == names
    assert not names & {one.name for one in effects_for("accelerometer")}


def test_a_curve_as_steep_as_the_sensor_itself_is_inverted() -> None:
    """A step that raises the reading by as much as the input under it does.

    Inserting the error would go to and fro there.
    """
    found, setting = curve("unknown-shape/x"), float(SETTINGS.index((0.1, 10.0)))
    places = np.linspace(-0.99, 0.99, 400)
    where = held(places)
    wanted = 85.0 * np.tanh((places - 0.3) / 0.045)
    wanted -= np.polyval(np.polyfit(places, wanted, 1), places)
    sizes = np.linalg.lstsq(found.shape(places, setting), wanted, rcond=None)[0]
    terms = Terms("accelerometer", [Term(found, setting)])
    error = terms.columns(where) @ sizes
    slope = np.gradient(error[:, 0], where.force[:, 0])
    assert 0.9 < slope.max() < 1.1
    nominal = (np.eye(3), np.zeros(3))
    back = corrected(nominal, terms, np.asarray(sizes, float), where.force + error, where)
    assert back == pytest.approx(where.force, abs=1e-6)
