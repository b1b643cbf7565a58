"""What the bench shows, without a screen."""

import re
from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.quantities import plus_minus
from imucal_wizard.diagnose.bench import NOTHING_MISSING, Bench, Entry
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.diagnosis import Apart
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.diagnose.views import (
    ResidualView,
    clearest,
    freed,
    misfit_curve,
    most_telling,
    pictures,
    suspect_view,
    views_of,
    views_over,
)
from imucal_wizard.report.bench_text import blocks, ladder_rows, suspect_size
from imucal_wizard.report.bench_views import view_text
from imucal_wizard.report.plot import scatter
from imucal_wizard.teach.prediction import FALLS, STAYS, Agreement, Prediction, judge_prediction
from imucal_wizard.tui.bench.pages import LESSON_PLOT_ROWS, gain_rows, next_rows, rows_for
from imucal_wizard.tui.bench.panels import (
    ladder_lines,
    model_rows,
    picture_rows,
    point_row,
    table_rows,
    verdict_rows,
    view_head,
)
from imucal_wizard.tui.bench.selection import Selection
from imucal_wizard.tui.bench.snapshot import BenchSnapshot, bench_snapshot
from imucal_wizard.tui.screens.guess import reveal_rows
from imucal_wizard.tui.text import width_of
from tests.tui.terminals import lines


@pytest.fixture
def snapshot(benches: Benches, bench: Bench) -> BenchSnapshot:
    return bench_snapshot(benches, bench)


def test_the_added_variable_slope_is_the_least_squares_size(snapshot: BenchSnapshot) -> None:
    misfit, entry = snapshot.findings.misfit, snapshot.entries[0]
    assert entry.suspect is not None
    assert entry.suspect.candidate is not None
    view = suspect_view(snapshot.findings, entry.suspect)
    assert view is not None
    columns = np.column_stack([entry.suspect.candidate.columns, misfit.base])
    sizes = np.linalg.lstsq(columns, misfit.residual, rcond=None)[0]
    assert view.slope == pytest.approx(sizes[entry.suspect.largest], rel=1e-6)
    assert view.slope == pytest.approx(5.0, abs=0.3)


def test_an_error_that_stays_as_it_is_does_not_fall(snapshot: BenchSnapshot) -> None:
    now = snapshot.fit.rms_held_out
    assert now is not None
    for answer, agreement in ((STAYS, Agreement.RIGHT), (FALLS, Agreement.WRONG)):
        guess = Prediction("hysteresis", held_out=answer)
        for share in (1.0, 0.98):  # less than what confirms an effect
            same = [replace(one, rms_held_out=share * now) for one in snapshot.entries]
            assert judge_prediction(snapshot.diagnosis, guess, same)[-1].agreement is agreement


def test_a_size_that_is_cut_short_keeps_its_unit(snapshot: BenchSnapshot) -> None:
    shown = 0
    for entry in snapshot.entries:
        if entry.effect is None:
            continue
        unit = entry.effect.parameters("accelerometer")[0].unit
        for room in range(60):
            size = suspect_size(entry, "accelerometer", room)
            assert len(size) <= room
            assert not size or unit in size
            shown += bool(size) and size != suspect_size(entry, "accelerometer")
    assert shown


def test_what_the_other_columns_absorb_is_gone_from_residual_and_pattern(
    snapshot: BenchSnapshot,
) -> None:
    misfit = snapshot.findings.misfit
    others = misfit.candidates[0].columns[:, 1:]
    for freed_one in freed(misfit, others, misfit.candidates[0].columns[:, 0]):
        columns = np.column_stack([misfit.base, others])
        overlap = columns.T @ freed_one / np.linalg.norm(columns, axis=0)
        assert np.abs(overlap).max() < 1e-8 * np.linalg.norm(freed_one)


def test_every_hold_stands_in_the_pictures_with_what_the_fit_left_of_it(
    snapshot: BenchSnapshot,
) -> None:
    labels = [view.x_label for view in snapshot.views]
    assert labels[:6] == [
        "force along x, g", "force along y, g", "force along z, g",
        "pose: 6 faces, 12 edges, 8 corners", "number of the hold", "time, min",
    ]  # fmt: skip
    for view in snapshot.views[:3]:
        left = snapshot.fit.residuals[view.source] * 1000.0 / 9.80665
        np.testing.assert_allclose(view.y, left, atol=1e-6)
        assert sorted(view.source) == list(range(len(snapshot.fit.residuals)))


def test_the_gyroscope_has_pictures_of_its_turns_and_of_each_axis_at_rest(sagged: Benches) -> None:
    bench = sagged.bench("gyroscope")
    assert bench is not None
    snapshot = bench_snapshot(sagged, bench)
    rest = ("at rest, x axis", "at rest, y axis", "at rest, z axis")
    assert snapshot.parts == ("rotations", *rest, "x axis", "y axis", "z axis")
    turn = next(view for view in snapshot.views if view.part == "rotations")
    assert turn.x_label == "fastest rate, °/s"
    rms = float(np.sqrt(np.mean(turn.y**2)))
    assert rms == pytest.approx(np.degrees(snapshot.fit.rms_fitted), rel=0.03)
    assert "rotation " in lines([point_row(snapshot, turn, 0)])[0]
    suspect = snapshot.findings.suspects[0]
    explained = suspect_view(snapshot.findings, suspect)
    assert explained is not None
    assert explained.part == "at rest, x axis"  # the axis that feels gravity shows it best


def test_a_plot_puts_points_noise_line_and_cursor_where_they_belong() -> None:
    x = np.array([-1.0, 0.0, 1.0])
    view = ResidualView(
        "v", "holds", "t", "force", "mg", x, np.array([-4.0, 0.5, 4.0]), np.arange(3), "",
        np.ones(3), 4.0,
    )  # fmt: skip
    rows = lines(picture_rows(view, 51, 10, cursor=1))
    assert rows[0].endswith("●")
    assert rows[0].lstrip().startswith("4")
    assert rows[8][10] == "●"
    assert "◆" in rows[3] + rows[4]
    assert sum("▒" in row for row in rows) == 2  # one row on each side of the line of zero
    assert sum("│" in row[10:] for row in rows) >= 2  # the error bars of the points outside
    assert sum("·" in row for row in rows) > 5
    assert "force" in rows[-1]
    assert {len(row) for row in rows} == {51}


def test_the_misfit_curve_is_what_the_suspect_leaves_after_the_base(
    snapshot: BenchSnapshot, bench: Bench
) -> None:
    """Adding the suspect takes away what it predicts, hold by hold."""
    suspect = snapshot.entries[0].suspect
    before = next(view for view in snapshot.views if view.name == "force-y")
    drawn = misfit_curve(snapshot.findings, before, suspect)
    assert drawn.predicted is not None
    assert drawn.suspect == "second-order"
    bench.add("second-order")
    after = next(view for view in views_of(bench.fit) if view.name == "force-y")
    taken = before.y - after.y[np.argsort(after.source)][np.argsort(np.argsort(before.source))]
    assert drawn.error is not None
    np.testing.assert_allclose(drawn.predicted, taken, atol=0.5 * drawn.error.max())
    assert np.abs(drawn.predicted).max() > 10.0 * drawn.error.max()


def test_the_curve_of_rows_that_share_noise_is_that_of_the_measured_rows(sagged: Benches) -> None:
    """Rotations share the directions of their holds: the whitening is taken back as a whole."""
    bench = sagged.bench("gyroscope")
    assert bench is not None
    findings = bench.look()
    misfit, suspect = findings.misfit, findings.suspects[0]
    assert suspect.candidate is not None
    turn = next(view for view in views_of(bench.fit) if view.part == "rotations")
    drawn = misfit_curve(findings, turn, suspect)
    wider = np.column_stack([misfit.base, suspect.candidate.columns])
    with_it, without = (
        columns @ np.linalg.lstsq(columns, misfit.residual, rcond=None)[0]
        for columns in (wider, misfit.base)
    )
    taken = np.degrees(misfit.measured(with_it - without))[misfit.table.moving]
    assert drawn.predicted is not None
    assert (drawn.predicted**2).sum() == pytest.approx((taken**2).sum(), rel=1e-6)


@pytest.mark.parametrize("axis", "xyz")
def test_the_first_picture_is_the_one_along_which_the_misfit_runs(axis: str) -> None:
    """Whatever the axis of the effect; no shape of the program's own effects is used."""
    rng = np.random.default_rng(4)
    up = rng.normal(size=(30, 3))
    up /= np.linalg.norm(up, axis=1)[:, None]
    left = 3.0 * np.abs(up[:, "xyz".index(axis)]) ** 3 + rng.normal(0.0, 0.3, 30)
    views = [
        ResidualView(
            f"force-{name}", "holds", "", "", "mg", up[:, k], left, np.arange(30), "", np.ones(30)
        )
        for k, name in enumerate("xyz")
    ]
    assert views[most_telling(views)].name == f"force-{axis}"


def test_the_first_picture_of_an_exercise_does_not_name_the_axis(snapshot: BenchSnapshot) -> None:
    """The bench opens on the plot that explains most, an exercise on the first one."""
    told, hidden = Selection(), Selection()
    hidden.hidden = True
    reversed_views = replace(snapshot, views=snapshot.views[::-1])
    for selection in (told, hidden):
        selection.show(reversed_views)
    opened, first = told.view(), hidden.view()
    assert opened is not None
    assert first is not None
    assert opened.name == snapshot.views[most_telling(snapshot.views)].name
    assert first.name == reversed_views.views[0].name != opened.name


def test_a_plot_against_a_count_ends_in_counts() -> None:
    foot = scatter(np.arange(1.0, 61.0), np.ones(60), 60, 10, x_label="number of the hold")[-1]
    assert foot.split() == ["1", "number", "of", "the", "hold", "60"]
    assert scatter(np.array([-0.98, 1.0]), np.ones(2), 60, 10)[-1].split() == ["−0.980", "1"]


def test_the_model_is_told_in_symbols_words_and_sizes(bench: Bench, benches: Benches) -> None:
    bench.add("second-order")
    rows = lines(model_rows(bench_snapshot(benches, bench), 70, 30))
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
    assert plus_minus(value, error) == text


def test_a_rung_whose_held_out_error_rose_is_marked(snapshot: BenchSnapshot) -> None:
    first = replace(snapshot.ladder[0], held_out_in_noise=1.0)
    held_out = first.rms_held_out
    assert held_out is not None
    worse = replace(first, model=(*first.model, "third-order"), added="third-order",
                    rms_fitted=0.9 * first.rms_fitted, rms_held_out=1.1 * held_out,
                    held_out_in_noise=1.1, confirmed=False,
                    )  # fmt: skip
    unit = snapshot.fit.unit
    assert "▲ only the fitted error fell" in "\n".join(ladder_rows((first, worse), unit, 76))
    more = replace(worse, rms_fitted=1.1 * first.rms_fitted)
    rows = "\n".join(ladder_rows((first, more), unit, 76))
    assert "▲ the held-out error did not fall by 3 %" in rows
    shown = replace(worse, rms_held_out=0.9 * held_out)
    rows = "\n".join(ladder_rows((first, shown), unit, 76))
    assert "▲ in units of the noise, the held-out error did not fall by 3 %" in rows
    late = replace(worse, held_out_in_noise=0.9)
    assert "does not predict the late part" in "\n".join(ladder_rows((first, late), unit, 76))
    better = replace(worse, rms_held_out=0.5 * held_out, confirmed=True)
    assert "▲" not in "\n".join(ladder_rows((first, better), unit, 76))


def test_bars_are_as_long_as_their_numbers() -> None:
    assert blocks(1.0, 2.0, 10) == "█████"
    assert blocks(2.0, 2.0, 10) == "█" * 10
    assert blocks(9.0, 2.0, 10) == "█" * 9 + "»"
    assert blocks(0.001, 2.0, 10) == "▏"


def test_with_a_part_of_the_base_out_nothing_else_is_named(bench: Bench, benches: Benches) -> None:
    bench.remove("scale")
    snapshot = bench_snapshot(benches, bench)
    assert snapshot.entries[0].term == "scale"
    assert (snapshot.entries[0].rms_held_out or 1.0) < 0.1 * (snapshot.fit.rms_held_out or 0.0)
    style, words = snapshot.style, snapshot.diagnosis.says
    assert style == "warn"
    assert words.startswith("Scale of the base model is left out")


def test_a_gyroscope_that_waits_for_the_accelerometer_is_not_ticked(benches: Benches) -> None:
    """Its model may leave only noise; nothing of it is settled before its reference is."""
    gyroscope = benches.bench("gyroscope")
    assert gyroscope is not None
    snapshot = bench_snapshot(benches, gyroscope)
    assert snapshot.diagnosis.verdict is Verdict.WAITING
    assert snapshot.style == "warn"
    assert "MEASURE NEXT" not in "\n".join(lines(next_rows(snapshot, 76)))
    turns, *_, resting = (view for view in snapshot.views if view.model is None)
    assert "noise and reference error of each point" in turns.legend  # not what noise alone leaves
    assert "noise of each point" in resting.legend


def test_a_guess_is_judged_line_by_line(snapshot: BenchSnapshot) -> None:
    right = "\n".join(lines(reveal_rows(snapshot, Prediction("second-order", "x", "+"), 70)))
    assert right.count("✓") == 4
    assert "✗" not in right
    wrong = "\n".join(lines(reveal_rows(snapshot, Prediction("hysteresis", "y", "−", STAYS), 70)))
    assert "✗ you: hysteresis" in wrong
    nothing = "\n".join(lines(reveal_rows(snapshot, Prediction(NOTHING_MISSING), 70)))
    assert "✗ you: nothing is missing" in nothing
    alike = "\n".join(lines(reveal_rows(snapshot, Prediction("asymmetry"), 70)))
    assert "≈ you: asymmetry" in alike
    assert "cannot separate" not in alike  # at this size they do


def test_no_suspect_looks_the_same_as_one_that_the_data_separate(snapshot: BenchSnapshot) -> None:
    """The verdict decides between second-order and asymmetry, by the gyroscope's closure."""
    assert "this decides for second-order" in " ".join(lines(next_rows(snapshot, 70)))
    table = "\n".join(lines(table_rows(snapshot, 76, 20, 0)))
    assert "looks the same" not in table
    assert "nearly the same pattern here as asymmetry" in " ".join(table.split())


def test_where_noise_explains_all_the_right_guess_is_that_nothing_is_missing(
    bench: Bench, benches: Benches
) -> None:
    bench.add("second-order")
    snapshot = bench_snapshot(benches, bench)
    selection = Selection()
    selection.show(snapshot)
    first = selection.view()
    assert first is not None
    assert first.suspect == ""  # none stands out from the noise
    selection.choose(1)
    chosen = selection.view()
    assert chosen is not None
    assert chosen.suspect == entry_of(selection).term
    assert "✓ you: nothing" in "\n".join(
        lines(reveal_rows(snapshot, Prediction(NOTHING_MISSING), 70))
    )
    assert "✗ you: asymmetry" in "\n".join(
        lines(reveal_rows(snapshot, Prediction("asymmetry"), 70))
    )


def test_after_adding_one_of_a_family_the_others_are_what_is_to_be_told_apart(
    bench: Bench, benches: Benches
) -> None:
    bench.add("second-order")
    rows = " ".join(lines(next_rows(bench_snapshot(benches, bench), 76)))
    assert "SECOND-ORDER OR ASYMMETRY?" in rows
    assert "The size here is about 5.0 mg/g²." in rows


def test_only_what_follows_the_orientation_is_left_to_a_rate_table(snapshot: BenchSnapshot) -> None:
    """Effects of the temperature and of the time are separated by another course of these."""
    apart = Apart("thermal-lag", "warm-up", np.inf, np.inf, 30.0, "s", 0, turning=True)

    def said(first: str) -> str:
        return " ".join(lines(gain_rows(replace(apart, first=first), snapshot.catalogue, 70)))

    for slow in ("thermal-lag", "bias-temperature", "warm-up", "scale-temperature"):
        assert said(slow).endswith("; a session in which the temperature rises and falls may.")
    assert said("cross-product").endswith("as on a rate table, may.")


@pytest.mark.parametrize(
    ("sensor", "foreign"),
    [("gyroscope", ("force", "one g")), ("magnetometer", ("force", "one g", "rate"))],
)
def test_the_lessons_of_the_base_speak_of_the_sensor_they_are_about(
    snapshot: BenchSnapshot, sensor: str, foreign: tuple[str, ...]
) -> None:
    """A gyroscope's scale is no half of a difference of one g."""
    own = replace(snapshot, sensor=sensor)
    for term in ("bias", "scale", "non-orthogonality", "soft-iron"):
        text = "\n".join(lines(rows_for(own, term, 76)))
        assert not [word for word in foreign if re.search(rf"\b{word}\b", text)], text


def test_a_lesson_shows_the_users_own_points_over_its_prediction(snapshot: BenchSnapshot) -> None:
    """Over the force along the axis that it bends; without the prediction before the guess."""
    rows = lines(rows_for(snapshot, "second-order", 76))
    own = rows[rows.index("your data") :]
    assert "━ second-order" in own[2]
    plot = own[3 : 3 + LESSON_PLOT_ROWS]
    assert "━" in "".join(plot)
    assert set("∘●") & set("".join(plot))
    assert "force along x, g" in "".join(plot)
    hidden = lines(rows_for(snapshot, "second-order", 76, hidden=True))
    assert "your data" in hidden
    assert "━" not in "".join(hidden)


@pytest.mark.parametrize("width", [60, 76, 104])
def test_no_row_is_wider_than_its_panel(snapshot: BenchSnapshot, width: int) -> None:
    rows = [
        *table_rows(snapshot, max(width, 76), 20, 0), *ladder_lines(snapshot, width),
        *model_rows(snapshot, width, 20, 0), *next_rows(snapshot, width),
        *(row for entry in snapshot.entries for row in rows_for(snapshot, entry.term, width)),
        *picture_rows(snapshot.views[0], width, 12, 0),
        *(row for view in snapshot.views for row in view_head(view, width)),
    ]  # fmt: skip
    assert max(width_of(row) for row in rows) <= max(width, 76)


def test_the_desk_remembers_what_is_chosen_per_panel(snapshot: BenchSnapshot) -> None:
    selection = Selection()
    selection.show(snapshot)
    selection.choose(1)
    assert entry_of(selection).term == snapshot.entries[1].term
    selection.panel = "model"
    selection.choose(2)
    assert selection.part is not None
    assert selection.part.term == "non-orthogonality"
    assert entry_of(selection).term == snapshot.entries[1].term
    selection.predict()
    assert entry_of(selection).term == min(entry.term for entry in snapshot.entries)
    selection.explain()
    assert not selection.added  # nothing is drawn that would tell the answer


def entry_of(selection: Selection) -> Entry:
    assert selection.entry is not None
    return selection.entry


def test_the_noise_in_the_ladder_is_that_of_the_last_model_for_each_error(
    snapshot: BenchSnapshot,
) -> None:
    mg = 9.80665e-3
    rungs = tuple(
        replace(snapshot.ladder[0], floor=floor * mg, floor_fitted=0.5 * floor * mg)
        for floor in (0.4, 0.05)
    )
    noise = ladder_rows(rungs, snapshot.fit.unit, 90)[-1]
    assert re.fullmatch(r"  noise alone +0\.0250 \S+ +0\.0500 \S+", noise)


def test_every_picture_of_the_screen_can_be_printed(sagged: Benches) -> None:
    """By its name, which no other picture of the sensor has, on 79 columns."""
    for sensor in sagged.sensors:
        bench = sagged.bench(sensor)
        assert bench is not None
        snapshot = bench_snapshot(sagged, bench)
        suspects = (entry.suspect for entry in snapshot.entries if entry.suspect is not None)
        drawn = [suspect_view(snapshot.findings, one) for one in suspects]
        shown = {view.name for view in (*snapshot.views, *drawn) if view is not None}
        printed = pictures(snapshot.diagnosis)
        assert len({view.name for view in printed}) == len(printed)
        assert {view.name for view in printed} == shown
        for view in printed:
            lines = view_text(sensor, view).splitlines()
            assert lines[0].startswith(f"{sensor.upper()}  {view.part}: ")
            assert max(map(len, lines[1:])) <= 79
            assert not any("…" in row for row in lines[1:]), "a label is cut off"
            assert not re.search(r"[0-9] °(?![C/])", "".join(lines)), "written as 0.1°"


def test_a_suspect_is_drawn_over_what_it_depends_on(sagged: Benches) -> None:
    """Nor over the pose before, nor, where it acts in rotations only, over the rests."""
    depends = {
        "cross-product": "rate",
        "axis-delay": "rate",
        "third-order": "rate",
        "g-sensitivity": "force along",
        "anisoelastic": "force along",
        "scale-drift": "time",
        "clock": "time",
    }
    bench = sagged.bench("gyroscope")
    assert bench is not None
    snapshot, seen = bench_snapshot(sagged, bench), set()
    for one in snapshot.findings.suspects:
        if one.candidate is None or one.term not in depends:
            continue
        over = views_over(snapshot.views, one.candidate.effect, "gyroscope")
        drawn = clearest(snapshot.findings, over, one)
        assert drawn is not None
        assert depends[one.term] in drawn.x_label, (one.term, drawn.x_label)
        assert "before" not in drawn.x_label, (one.term, drawn.x_label)
        moving = depends[one.term] != "force along"
        assert drawn.part == "rotations" if moving else "at rest" in drawn.part, one.term
        seen.add(one.term)
    assert {"cross-product", "g-sensitivity"} <= seen


def test_the_rests_of_a_gyroscope_are_not_looked_at_as_an_accelerometer(sagged: Benches) -> None:
    bench = sagged.bench("gyroscope")
    assert bench is not None
    said = {view.name: view.look_for for view in views_of(bench.fit)}
    assert "g-sensitivity" in said["rest-x-force-x"]
    assert "second-order" not in said["rest-x-force-x"]
    assert "product of two forces" in said["rest-x-pose"]


def test_a_verdict_that_does_not_fit_ends_with_a_sentence(snapshot: BenchSnapshot) -> None:
    more, says = "  … (n shows the rest)", snapshot.diagnosis.says
    whole = " ".join(row.strip() for row in lines(verdict_rows(snapshot, 78, 9)))
    assert whole.endswith(says)
    for height in (2, 3):
        rows = lines(verdict_rows(snapshot, 78, height))
        assert len(rows) <= height
        assert rows[-1].endswith(f".{more}")
    assert lines(verdict_rows(snapshot, 30, 1))[0].endswith(more)
    assert verdict_rows(snapshot, 78, 0) == []
