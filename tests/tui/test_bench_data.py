"""What was measured, beside the model and sample by sample, without a screen."""

import numpy as np
import pytest

from imucal_wizard.bench.benches import Benches
from imucal_wizard.bench.session import Bench
from imucal_wizard.readings import Readings, Series
from imucal_wizard.solver.result import FitReport
from imucal_wizard.tui.bench.compared import COMPARED
from imucal_wizard.tui.bench.desk import Desk
from imucal_wizard.tui.bench.point_rows import point_row
from imucal_wizard.tui.bench.scatter import scatter
from imucal_wizard.tui.bench.sight import Sight, look
from imucal_wizard.tui.bench.trace_rows import trace_rows
from imucal_wizard.tui.bench.views import HOLDS, TURNS, View
from imucal_wizard.tui.text import number, width_of
from imucal_wizard.units import STANDARD_GRAVITY
from tests.tui.terminals import page

MG = STANDARD_GRAVITY / 1000.0


def beside(sight: Sight, axis: int) -> View:
    """Measurement and model of one axis over the force along it."""
    return next(view for view in sight.views if view.part == COMPARED[axis])


def readings_of(report: FitReport) -> Readings:
    """What may have been read in and around each hold of a report."""
    times, forces, rates = [], [], []
    for hold in report.holds:
        time = np.arange(hold.start - 0.2, hold.end + 0.2, 0.01)
        assert hold.gyroscope is not None
        times.append(time)
        noise = np.where(np.arange(len(time)) % 2, 1.0, -1.0)[:, None]
        forces.append(hold.accelerometer + 0.01 * noise)
        rates.append(hold.gyroscope + 0.001 * noise)
    time = np.concatenate(times)
    return Readings(
        Series(time, np.concatenate(forces), "m/s^2"), Series(time, np.concatenate(rates), "rad/s")
    )


def test_measurement_minus_model_is_what_is_left_along_up(benches: Benches, bench: Bench) -> None:
    sight = look(benches, bench)
    gap = np.zeros((len(bench.fit.fit.residuals), 3))
    for axis in range(3):
        view = beside(sight, axis)
        assert view.model is not None
        gap[view.source, axis] = (view.y - view.model) * MG
    up = bench.measured.circumstances.force / STANDARD_GRAVITY
    np.testing.assert_allclose(gap @ bench.fit.fit.matrix.T @ np.ones(3), (
        bench.fit.fit.residuals[:, None] * up).sum(axis=1), atol=0.02 * MG)  # fmt: skip


def test_a_model_of_nothing_is_a_flat_line_and_a_bias_lifts_it(
    benches: Benches, bench: Bench
) -> None:
    for term in ("non-orthogonality", "scale", "bias"):
        bench.remove(term)
    view = beside(look(benches, bench), 0)
    assert view.model is not None
    np.testing.assert_allclose(view.model, 0.0, atol=1e-9)
    assert np.abs(view.y).max() > 5.0  # mg: it has a bias of some
    bench.add("bias")
    lifted = beside(look(benches, bench), 0)
    assert lifted.model is not None
    np.testing.assert_allclose(lifted.model, bench.fit.fit.bias[0] / MG, rtol=1e-9)


def test_the_missing_effect_lies_between_measurement_and_model(
    benches: Benches, bench: Bench
) -> None:
    view = beside(look(benches, bench), 0)
    bench.add("second-order")
    better = beside(look(benches, bench), 0)
    assert view.model is not None
    assert better.model is not None
    assert np.std(better.y - better.model) < 0.2 * np.std(view.y - view.model)


def test_the_gyroscope_at_rest_stands_beside_its_model(sagged: Benches) -> None:
    bench = sagged.gyroscope
    assert bench is not None
    view = beside(look(sagged, bench), 0)
    assert view.model is not None
    assert view.unit == "°/s"
    assert np.ptp(view.y) > 0.08  # twice 0.05 °/s per g
    assert np.ptp(view.model) < 0.01  # a bias is all that the model has
    bench.add("g-sensitivity")
    after = beside(look(sagged, bench), 0)
    assert after.model is not None
    assert np.abs(after.y - after.model).max() < 0.02


def test_where_model_and_measurement_meet_they_share_a_sign() -> None:
    x, y = np.array([0.0, 1.0]), np.array([2.0, 2.0])
    view = View("x axis", "t", "x", "mg", x, y, np.arange(2), None, model=np.array([2.0, 1.0]))
    drawn = page(scatter(view, 40, 9))
    assert (drawn.count("⊗"), drawn.count("∘"), drawn.count("×")) == (1, 1, 1)


def test_poses_held_twice_stand_in_one_column(benches: Benches, bench: Bench) -> None:
    view = next(v for v in look(benches, bench).views if v.x_label.startswith("pose: 6 faces"))
    assert view.part == HOLDS
    assert set(view.x) == set(range(1, 19))


def test_a_point_of_the_comparison_tells_both_numbers(benches: Benches, bench: Bench) -> None:
    sight = look(benches, bench)
    row = page([point_row(sight, beside(sight, 1), 0)])
    assert ", model " in row


def test_the_trace_shows_every_axis_with_mean_noise_and_the_part_averaged(bent: FitReport) -> None:
    benches = Benches(bent, readings_of(bent))
    sight = look(benches, benches.accelerometer)
    rows = trace_rows(sight, sight.views[0], 0, 76)
    text = page(rows)
    hold = bent.holds[int(sight.views[0].source[0])]
    assert f"pose {sight.views[0].source[0] + 1}, " in text
    for k, axis in enumerate("xyz"):
        assert f"accelerometer {axis}   mean" in text
        assert f"mean {number(float(hold.accelerometer[k]), 5)[:5]}" in text
        assert f"gyroscope {axis}   mean" in text
    assert "noise 0.0" in text
    assert "│" in text
    assert max(width_of(row) for row in rows) <= 76


def test_a_turn_has_its_rates_even_where_the_readings_are_gone(sagged: Benches) -> None:
    bench = sagged.gyroscope
    assert bench is not None
    sight = look(sagged, bench)
    view = next(view for view in sight.views if view.part == TURNS)
    text = page(trace_rows(sight, view, len(view.x) - 1, 76))
    assert "turn " in text
    assert "largest" in text
    assert "°/s" in text


def test_without_readings_it_says_so(benches: Benches, bench: Bench) -> None:
    sight = look(benches, bench)
    assert "only their means" in page(trace_rows(sight, sight.views[0], 0, 76))


def test_nothing_picked_means_the_point_farthest_from_the_model(
    benches: Benches, bench: Bench
) -> None:
    desk = Desk()
    desk.show(look(benches, bench))
    desk.pick_farthest()
    view = desk.view()
    assert view is not None
    assert desk.cursor is not None
    assert abs(view.y[desk.cursor]) == pytest.approx(np.abs(view.y).max())
