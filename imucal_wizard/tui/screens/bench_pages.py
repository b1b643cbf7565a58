"""The pages above the bench: lesson, raw trace, a formula to type, help."""

from imucal_wizard.effects.formula import FormulaEffect
from imucal_wizard.tui.bench.help_rows import help_rows
from imucal_wizard.tui.bench.lesson_rows import rows_for
from imucal_wizard.tui.bench.trace_rows import trace_rows
from imucal_wizard.tui.screens.bench_work import BenchWork
from imucal_wizard.tui.screens.formula_screen import FormulaScreen
from imucal_wizard.tui.screens.page_screen import PageScreen


class BenchPages(BenchWork):
    """Opened by a key, closed by the same one."""

    def action_lesson(self) -> None:
        """The lesson of the chosen suspect or term."""
        sight, chosen = self.desk.sight, self.desk.part or self.desk.entry
        if sight is not None and chosen is not None:
            term = chosen.term
            self.app.push_screen(
                PageScreen(f"lesson: {term}", lambda width: rows_for(sight, term, width), "l")
            )

    def action_trace(self) -> None:
        """Every reading of the point picked; of the one that stands out most when none is."""
        sight, view = self.desk.sight, self.desk.view()
        if sight is None or view is None or not len(view.x):
            return
        if self.desk.cursor is None:
            self.desk.pick_farthest()
            self.redraw()
        place = min(self.desk.cursor or 0, len(view.x) - 1)
        self.app.push_screen(
            PageScreen("raw trace", lambda width: trace_rows(sight, view, place, width), "t")
        )

    def action_formula(self) -> None:
        """An effect of one's own."""
        if self.desk.sight is not None:
            taken = {effect.name for effect in self.desk.sight.catalogue}
            self.app.push_screen(FormulaScreen(self.sensor, taken), self._typed)

    def _typed(self, effect: FormulaEffect | None) -> None:
        if effect is not None:
            self.do("Testing your formula …", lambda bench: bench.offer(effect), effect.name)

    def action_explain(self) -> None:
        """Help."""
        self.app.push_screen(PageScreen("help: the bench", help_rows, "question_mark"))
