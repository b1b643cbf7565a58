"""What was measured, beside the model and sample by sample, without a screen."""

import numpy as np
import pytest

from imucal_wizard.core.quantities import number
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.views import COMPARED, ResidualView
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.tui.bench.pages import raw_trace_rows
from imucal_wizard.tui.bench.panels import picture_rows, point_row
from imucal_wizard.tui.bench.selection import Selection
from imucal_wizard.tui.bench.snapshot import BenchSnapshot, bench_snapshot
from imucal_wizard.tui.text import width_of
from tests.tui.terminals import page

MG = STANDARD_GRAVITY / 1000.0


def beside(snapshot: BenchSnapshot, axis: int) -> ResidualView:
    """Measurement and model of one axis over the force along it."""
    return next(view for view in snapshot.views if view.part == COMPARED[axis])


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
    snapshot = bench_snapshot(benches, bench)
    gap = np.zeros((len(bench.fit.residuals), 3))
    for axis in range(3):
        view = beside(snapshot, axis)
        assert view.model is not None
        gap[view.source, axis] = (view.y - view.model) * MG
    up = bench.measured.circumstances.force / STANDARD_GRAVITY
    np.testing.assert_allclose(gap @ bench.fit.matrix.T @ np.ones(3), (
        bench.fit.residuals[:, None] * up).sum(axis=1), atol=0.02 * MG)  # fmt: skip


def test_a_model_of_nothing_is_a_flat_line_and_a_bias_lifts_it(
    benches: Benches, bench: Bench
) -> None:
    for term in ("non-orthogonality", "scale", "bias"):
        bench.remove(term)
    view = beside(bench_snapshot(benches, bench), 0)
    assert view.model is not None
    np.testing.assert_allclose(view.model, 0.0, atol=1e-9)
    assert np.abs(view.y).max() > 5.0  # mg: it has a bias of some
    bench.add("bias")
    lifted = beside(bench_snapshot(benches, bench), 0)
    assert lifted.model is not None
    np.testing.assert_allclose(lifted.model, bench.fit.bias[0] / MG, rtol=1e-9)


def test_the_missing_effect_lies_between_measurement_and_model(
    benches: Benches, bench: Bench
) -> None:
    view = beside(bench_snapshot(benches, bench), 0)
    bench.add("second-order")
    better = beside(bench_snapshot(benches, bench), 0)
    assert view.model is not None
    assert better.model is not None
    assert np.std(better.y - better.model) < 0.2 * np.std(view.y - view.model)


def test_the_gyroscope_at_rest_stands_beside_its_model(sagged: Benches) -> None:
    bench = sagged.bench("gyroscope")
    assert bench is not None
    view = beside(bench_snapshot(sagged, bench), 0)
    assert view.model is not None
    assert view.unit == "°/s"
    assert np.ptp(view.y) > 0.08  # twice 0.05 °/s per g
    assert np.ptp(view.model) < 0.01  # a bias is all that the model has
    bench.add("g-sensitivity")
    after = beside(bench_snapshot(sagged, bench), 0)
    assert after.model is not None
    assert np.abs(after.y - after.model).max() < 0.02


def test_where_model_and_measurement_meet_they_share_a_sign() -> None:
    x, y = np.array([0.0, 1.0]), np.array([2.0, 2.0])
    view = ResidualView(
        "v", "x axis", "t", "x", "mg", x, y, np.arange(2), "", model=np.array([2.0, 1.0])
    )
    drawn = page(picture_rows(view, 40, 9))
    assert (drawn.count("⊗"), drawn.count("∘"), drawn.count("×")) == (1, 1, 1)


def test_poses_held_twice_stand_in_one_column(benches: Benches, bench: Bench) -> None:
    view = next(
        v for v in bench_snapshot(benches, bench).views if v.x_label.startswith("pose: 6 faces")
    )
    assert view.part == "holds"
    assert set(view.x) == set(range(1, 19))


def test_a_point_of_the_comparison_tells_both_numbers(benches: Benches, bench: Bench) -> None:
    snapshot = bench_snapshot(benches, bench)
    row = page([point_row(snapshot, beside(snapshot, 1), 0)])
    assert ", model " in row


def test_the_trace_shows_every_axis_with_mean_noise_and_the_part_averaged(bent: FitReport) -> None:
    benches = Benches(bent, readings_of(bent))
    snapshot = bench_snapshot(benches, benches.accelerometer)
    rows = raw_trace_rows(snapshot, snapshot.views[0], 0, 76)
    text = page(rows)
    hold = bent.holds[int(snapshot.views[0].source[0])]
    assert f"hold {snapshot.views[0].source[0] + 1}, " in text
    for k, axis in enumerate("xyz"):
        assert f"accelerometer {axis}   mean" in text
        assert f"mean {number(float(hold.accelerometer[k]), 5)[:5]}" in text
        assert f"gyroscope {axis}   mean" in text
    assert "noise 0.0" in text
    assert "│" in text
    assert max(width_of(row) for row in rows) <= 76


def test_a_turn_has_its_rates_even_where_the_readings_are_gone(sagged: Benches) -> None:
    bench = sagged.bench("gyroscope")
    assert bench is not None
    snapshot = bench_snapshot(sagged, bench)
    view = next(view for view in snapshot.views if view.part == "rotations")
    text = page(raw_trace_rows(snapshot, view, len(view.x) - 1, 76))
    assert "rotation " in text
    assert "largest" in text
    assert "°/s" in text


def test_without_readings_it_says_so(benches: Benches, bench: Bench) -> None:
    snapshot = bench_snapshot(benches, bench)
    assert "Only the means" in page(raw_trace_rows(snapshot, snapshot.views[0], 0, 76))


def test_nothing_picked_means_the_point_farthest_from_the_model(
    benches: Benches, bench: Bench
) -> None:
    selection = Selection()
    selection.show(bench_snapshot(benches, bench))
    selection.pick_farthest()
    view = selection.view()
    assert view is not None
    assert selection.cursor is not None
    assert abs(view.y[selection.cursor]) == pytest.approx(np.abs(view.y).max())
