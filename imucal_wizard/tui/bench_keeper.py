"""What is kept of the bench between its screens: the models found there, over fits and steps."""

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.bench.benches import Benches
    from imucal_wizard.solver.result import FitReport


class BenchKeeper:
    """Keeps the benches of the newest fit.

    Args:
        make: makes the benches of a fit, with the models of those before it.

    Attributes:
        benches: as they were left; None before the bench was opened.
        sensor: whose bench was open last.
        again: the bench has sent the operator to measure more, and is to be opened after that.
    """

    def __init__(self, make: "Callable[[FitReport, Benches | None], Benches]") -> None:
        self._make = make
        self.benches: Benches | None = None
        self.sensor = ""
        self.again = False

    def forget(self) -> None:
        """Another source: nothing of the last one holds."""
        self.benches, self.again = None, False

    def of(self, report: "FitReport") -> "Benches":
        """The benches of a fit. Takes a while: call it in a thread."""
        benches = self.benches
        if benches is None or benches.report is not report:
            benches = self.benches = self._make(report, benches)
        return benches

    def newest(self, report: "FitReport | None") -> "Benches | None":
        """The same where effects have been added; else what there is."""
        if report is None or self.benches is None or not self.benches.models():
            return self.benches
        return self.of(report)
