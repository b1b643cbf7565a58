"""The keys of a screen that shows a fit: its parameters, the bench, the heading, the methods."""

from typing import ClassVar

from textual.binding import Binding, BindingType

from imucal_wizard.fitting.compass import compass_of
from imucal_wizard.solver.result import FitReport
from imucal_wizard.tui.heading_rows import no_heading_rows
from imucal_wizard.tui.parameter_rows import parameter_rows
from imucal_wizard.tui.screens.comparison_screen import ComparisonScreen
from imucal_wizard.tui.screens.heading_screen import HeadingScreen
from imucal_wizard.tui.screens.live_screen import LiveScreen
from imucal_wizard.tui.screens.page_screen import PageScreen
from imucal_wizard.tui.screens.table_screen import TableScreen
from imucal_wizard.tui.widgets.key_footer import KeyFooter, Keys


class ReportScreen(LiveScreen):
    """Pages above a fit, each by one key."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("t", "table", "table of parameters"),
        Binding("f", "app.bench", "find what is missing"),
        Binding("h", "heading", "heading"),
        Binding("c", "compare", "compare the methods"),
    ]

    def offered(self, keys: Keys) -> Keys:
        """Those of the keys that lead somewhere: there is no north without a magnetometer."""
        found = self.report is not None and self.report.magnetic is not None
        return [key for key in keys if found or key[0] != "h"]

    def footer(self) -> None:
        """Show the keys."""
        self.query_one(KeyFooter).offer(self.offered(self.keys))

    @property
    def report(self) -> FitReport | None:
        """The fit, once there is one."""
        return self.wizard.report

    def on_screen_resume(self) -> None:
        """Back from a page above, perhaps at another size or with another model of the bench."""
        self.redraw_if_there()

    def action_table(self) -> None:
        """Every parameter with its standard error."""
        report = self.report
        if report is not None:
            self.app.push_screen(TableScreen(lambda width: parameter_rows(report, width)))

    def action_heading(self) -> None:
        """The heading by the device as it lies now; or why there is none."""
        report = self.report
        if report is None:
            return
        compass = compass_of(report)
        if compass is not None:
            self.app.push_screen(HeadingScreen(report, compass, self.step))
        else:
            rows = no_heading_rows
            self.app.push_screen(PageScreen("heading", lambda width: rows(report, width), "h"))

    def action_compare(self) -> None:
        """Both papers' methods and our own on what was measured."""
        report, source, snapshot = self.report, self.wizard.source, self.wizard.snapshot
        if report is not None and source is not None and snapshot is not None:
            make = self.wizard.services.compare
            self.app.push_screen(
                ComparisonScreen(lambda: make(report, source.collected(), snapshot), self.step)
            )
