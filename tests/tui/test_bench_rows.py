"""What the bench shows, without a screen."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.bench.benches import Benches
from imucal_wizard.bench.session import Bench
from imucal_wizard.tui.bench.added import added_view, freed
from imucal_wizard.tui.bench.desk import Desk
from imucal_wizard.tui.bench.entries import NOTHING, Entry
from imucal_wizard.tui.bench.guess import STAYS, Guess, reveal_rows
from imucal_wizard.tui.bench.ladder_rows import blocks, ladder_rows
from imucal_wizard.tui.bench.lesson_rows import rows_for
from imucal_wizard.tui.bench.model_rows import model_rows, pair
from imucal_wizard.tui.bench.next_rows import next_rows
from imucal_wizard.tui.bench.point_rows import point_row
from imucal_wizard.tui.bench.scatter import scatter
from imucal_wizard.tui.bench.sight import Sight, look
from imucal_wizard.tui.bench.suspect_rows import table_rows
from imucal_wizard.tui.bench.views import TURNS, View
from imucal_wizard.tui.bench.words import says
from imucal_wizard.tui.text import width_of
from tests.tui.terminals import lines


@pytest.fixture
def sight(benches: Benches, bench: Bench) -> Sight:
    return look(benches, bench)


def test_the_added_variable_slope_is_the_least_squares_size(sight: Sight) -> None:
    misfit, entry = sight.findings.misfit, sight.entries[0]
    view = added_view(misfit, entry)
    assert view is not None
    assert entry.suspect is not None
    assert entry.suspect.candidate is not None
    columns = np.column_stack([entry.suspect.candidate.columns, misfit.base])
    sizes = np.linalg.lstsq(columns, misfit.residual, rcond=None)[0]
    assert view.slope == pytest.approx(sizes[entry.largest], rel=1e-6)
    assert view.slope == pytest.approx(5.0, abs=0.3)


def test_what_the_other_columns_absorb_is_gone_from_residual_and_pattern(sight: Sight) -> None:
    misfit = sight.findings.misfit
    others = misfit.candidates[0].columns[:, 1:]
    for freed_one in freed(misfit, others, misfit.candidates[0].columns[:, 0]):
        columns = np.column_stack([misfit.base, others])
        overlap = columns.T @ freed_one / np.linalg.norm(columns, axis=0)
        assert np.abs(overlap).max() < 1e-8 * np.linalg.norm(freed_one)


def test_every_hold_stands_in_the_pictures_with_what_the_fit_left_of_it(sight: Sight) -> None:
    labels = [view.x_label for view in sight.views]
    assert labels[:6] == [
        "force along x, g", "force along y, g", "force along z, g",
        "pose: 6 faces, 12 edges, 8 corners", "number of the pose", "time, min",
    ]  # fmt: skip
    for view in sight.views[:3]:
        left = sight.fit.fit.residuals[view.source] * 1000.0 / 9.80665
        np.testing.assert_allclose(view.y, left, atol=1e-6)
        assert sorted(view.source) == list(range(len(sight.fit.fit.residuals)))


def test_the_gyroscope_has_pictures_of_its_turns_and_of_each_axis_at_rest(sagged: Benches) -> None:
    bench = sagged.gyroscope
    assert bench is not None
    sight = look(sagged, bench)
    rest = ("at rest, x axis", "at rest, y axis", "at rest, z axis")
    assert sight.parts == (TURNS, *rest, "x axis", "y axis", "z axis")
    turn = next(view for view in sight.views if view.part == TURNS)
    assert turn.x_label == "fastest rate, °/s"
    rms = float(np.sqrt(np.mean(turn.y**2)))
    assert rms == pytest.approx(np.degrees(sight.fit.rms_fitted), rel=0.03)
    assert "turn " in lines([point_row(sight, turn, 0)])[0]
    explained = added_view(sight.findings.misfit, sight.entries[0])
    assert explained is not None
    assert explained.part == "at rest, x axis"  # the axis that feels gravity shows it best


def test_a_plot_puts_points_noise_line_and_cursor_where_they_belong() -> None:
    x = np.array([-1.0, 0.0, 1.0])
    view = View("holds", "t", "force", "mg", x, np.array([-4.0, 0.5, 4.0]), np.arange(3), 1.0, 4.0)
    rows = lines(scatter(view, 51, 10, cursor=1))
    assert rows[0].endswith("●")
    assert rows[0].lstrip().startswith("4")
    assert rows[8][10] == "●"
    assert "◆" in rows[3] + rows[4]
    assert sum("┈" in row for row in rows) == 2
    assert sum("·" in row for row in rows) > 5
    assert "force" in rows[-1]
    assert {len(row) for row in rows} == {51}


def test_the_model_is_told_in_symbols_words_and_sizes(bench: Bench, benches: Benches) -> None:
    bench.add("second-order")
    rows = lines(model_rows(look(benches, bench), 70, 30))
    assert rows[0].startswith("f = T·s·(y − b) − ε₁")
    text = "\n".join(rows)
    assert "true force = matrix × (reading − bias) − second-order" in text
    assert "✓ second-order" in text
    assert "x 5.0" in text
    assert "mg/g²" in text


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [(-5.0312, 0.1066, "−5.03 ± 0.11"), (1234.5, 33.0, "1234 ± 33"), (0.5, None, "0.500"),
     (0.5, float("nan"), "0.500")],
)  # fmt: skip
def test_a_size_has_the_decimals_that_its_error_allows(
    value: float, error: float | None, text: str
) -> None:
    assert pair(value, error) == text


def test_a_rung_whose_held_out_error_rose_is_marked(sight: Sight) -> None:
    first = sight.ladder[0]
    held_out = first.rms_held_out
    assert held_out is not None
    worse = replace(first, model=(*first.model, "third-order"), added="third-order",
                    rms_fitted=0.9 * first.rms_fitted, rms_held_out=1.1 * held_out,
                    )  # fmt: skip
    risen = replace(sight, ladder=(first, worse))
    assert risen.rose(1)
    assert "▲ only the fitted error fell" in "\n".join(lines(ladder_rows(risen, 76)))
    better = replace(worse, rms_held_out=0.5 * held_out)
    assert not replace(sight, ladder=(first, better)).rose(1)


def test_bars_are_as_long_as_their_numbers() -> None:
    assert blocks(1.0, 2.0, 10) == "█████"
    assert blocks(2.0, 2.0, 10) == "█" * 10
    assert blocks(9.0, 2.0, 10) == "█" * 9 + "»"
    assert blocks(0.001, 2.0, 10) == "▏"


def test_with_a_part_of_the_base_out_nothing_else_is_named(bench: Bench, benches: Benches) -> None:
    bench.remove("scale")
    sight = look(benches, bench)
    assert sight.entries[0].term == "scale"
    assert (sight.entries[0].rms_held_out or 1.0) < 0.1 * (sight.fit.rms_held_out or 0.0)
    style, words = says(sight)
    assert style == "warn"
    assert words.startswith("Scale of the base model is left out")


def test_a_gyroscope_that_waits_for_the_accelerometer_is_not_ticked(benches: Benches) -> None:
    """Its model may leave only noise; nothing of it is settled before its reference is."""
    gyroscope = benches.bench("gyroscope")
    assert gyroscope is not None
    sight = look(benches, gyroscope)
    assert sight.said.waiting
    assert says(sight)[0] == "warn"


def test_a_guess_is_judged_line_by_line(sight: Sight) -> None:
    right = "\n".join(lines(reveal_rows(sight, Guess("second-order", "x", "+"), 70)))
    assert right.count("✓") == 4
    assert "✗" not in right
    wrong = "\n".join(lines(reveal_rows(sight, Guess("hysteresis", "y", "−", STAYS), 70)))
    assert "✗ you: hysteresis" in wrong
    nothing = "\n".join(lines(reveal_rows(sight, Guess(NOTHING), 70)))
    assert "✗ you: nothing is missing" in nothing
    alike = "\n".join(lines(reveal_rows(sight, Guess("asymmetry"), 70)))
    assert "≈ you: asymmetry" in alike


def test_where_noise_explains_all_the_right_guess_is_that_nothing_is_missing(
    bench: Bench, benches: Benches
) -> None:
    bench.add("second-order")
    sight = look(benches, bench)
    assert "✓ you: nothing" in "\n".join(lines(reveal_rows(sight, Guess(NOTHING), 70)))
    assert "✗ you: asymmetry" in "\n".join(lines(reveal_rows(sight, Guess("asymmetry"), 70)))


def test_after_adding_one_of_a_family_the_others_are_what_is_to_be_told_apart(
    bench: Bench, benches: Benches
) -> None:
    bench.add("second-order")
    rows = " ".join(lines(next_rows(look(benches, bench), 76)))
    assert "SECOND-ORDER OR ASYMMETRY?" in rows
    assert "Here it is about 5." in rows


@pytest.mark.parametrize("width", [60, 76, 104])
def test_no_row_is_wider_than_its_panel(sight: Sight, width: int) -> None:
    rows = [
        *table_rows(sight, max(width, 76), 20, 0), *ladder_rows(sight, width),
        *model_rows(sight, width, 20, 0), *next_rows(sight, width),
        *(row for entry in sight.entries for row in rows_for(sight, entry.term, width)),
        *scatter(sight.views[0], width, 12, 0),
    ]  # fmt: skip
    assert max(width_of(row) for row in rows) <= max(width, 76)


def test_the_desk_remembers_what_is_chosen_per_panel(sight: Sight) -> None:
    desk = Desk()
    desk.show(sight)
    desk.choose(1)
    assert entry_of(desk).term == sight.entries[1].term
    desk.panel = "model"
    desk.choose(2)
    assert desk.part is not None
    assert desk.part.term == "non-orthogonality"
    assert entry_of(desk).term == sight.entries[1].term
    desk.predict()
    assert entry_of(desk).term == min(entry.term for entry in sight.entries)
    desk.explain()
    assert not desk.added  # nothing is drawn that would tell the answer


def entry_of(desk: Desk) -> Entry:
    assert desk.entry is not None
    return desk.entry


def test_the_noise_in_the_ladder_is_that_of_the_model_that_shows_it_most_purely(
    sight: Sight,
) -> None:
    mg = 9.80665e-3
    rungs = tuple(replace(sight.ladder[0], floor=floor * mg) for floor in (0.4, 0.05, 7.0))
    noise = lines(ladder_rows(replace(sight, ladder=rungs), 90))[-1]
    assert noise.split()[:3] == ["noise", "alone", "0.0500"]
