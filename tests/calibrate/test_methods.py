"""What the comparison of methods says of their differences."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.estimate.comparison import (
    MethodRow,
    difference,
    least_held_out,
    offset_difference,
)
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.report.tables import method_table


def fit(held_out: float | None = 0.01, unit: str = "m/s^2") -> SensorFit:
    """An accelerometer of 1 mm/s² a count."""
    return SensorFit(
        "accelerometer", ("bias", "scale"), "least_squares", "own", 0.001 * np.eye(3),
        np.array([100.0, 0.0, 0.0]), "count", (), unit, 0.5, 0.009, held_out, 0.01, np.zeros(3),
    )  # fmt: skip


FIRST = MethodRow("accelerometer", "least_squares", "", fit())


def test_matrix_and_bias_are_held_against_those_of_the_first_method() -> None:
    """2 % in one gain; 50 counts are 0.05 m/s², which is 5.1 mg."""
    matrix = 0.001 * np.diag([1.0, 1.02, 1.0])
    bias = np.array([100.0, 0.0, -50.0])
    other = MethodRow("accelerometer", "newton", "Q", replace(fit(), matrix=matrix, bias=bias))
    assert difference(other, FIRST) == pytest.approx(0.02)
    assert offset_difference(other, FIRST) == pytest.approx(0.05)
    line = next(line for line in method_table([FIRST, other]).splitlines() if "newton" in line)
    assert line.split()[-4:] == ["2.000", "%", "5.1", "mg"]


def test_a_method_without_a_result_differs_from_nothing() -> None:
    none = MethodRow("accelerometer", "newton", "Q", None, why="it does not converge")
    assert difference(none, FIRST) is None
    assert offset_difference(none, FIRST) is None
    assert "no result: it does not converge" in method_table([FIRST, none])


def test_methods_that_are_as_good_as_the_best_are_marked_with_it() -> None:
    """Within 2 %; an error of another kind does not compete."""
    near = MethodRow("accelerometer", "newton", "Q", fit(0.0101))
    far = MethodRow("accelerometer", "two-step", "N", fit(0.0103))
    rate = MethodRow("accelerometer", "offset", "N", fit(0.0001, "rad/s"))
    unknown = MethodRow("accelerometer", "six-position", "Q", fit(None))
    assert least_held_out([FIRST, near, far, rate, unknown]) == (FIRST, near)
    assert least_held_out([unknown]) == ()
