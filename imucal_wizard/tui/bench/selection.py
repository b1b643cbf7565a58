"""The selection on the bench: panel, suspect, term, plot, point."""

import numpy as np

from imucal_wizard.diagnose.bench import Entry
from imucal_wizard.diagnose.views import ResidualView, misfit_curve, opening_view, suspect_view
from imucal_wizard.tui.bench.panels import Part, order, parts_of_model
from imucal_wizard.tui.bench.snapshot import BenchSnapshot

PANELS = ("suspects", "model", "ladder")


class Selection:
    """A snapshot with a selected item in each of its lists.

    Attributes:
        snapshot: of the bench; None before the first one.
        panel: the panel in which up and down select.
        hidden: the answer is hidden until a guess.
        added: the plot is that of the selected suspect.
        cursor: index of the picked point, or None.
    """

    def __init__(self) -> None:
        self.snapshot: BenchSnapshot | None = None
        self.panel = PANELS[0]
        self.hidden = False
        self.added = False
        self.cursor: int | None = None
        self._suspect = self._term = self._view = 0
        self._chosen = False
        self._part = ""

    def show(self, snapshot: BenchSnapshot) -> None:
        """Take another model or sensor; keep the plot if there is such a plot."""
        self.snapshot = snapshot
        self.added, self.cursor, self._suspect, self._chosen = False, None, 0, False
        self._term = min(self._term, len(self.parts()) - 1)
        if self._part not in snapshot.parts:
            # in an exercise the plot over what is missing would name the axis
            opening = opening_view(snapshot.diagnosis, snapshot.views, snapshot.catalogue)
            best = snapshot.views[0 if self.hidden else opening]
            own = [view.name for view in snapshot.views if view.part == best.part]
            self._part, self._view = best.part, own.index(best.name)

    def entries(self) -> tuple[Entry, ...]:
        """The suspects as shown."""
        return () if self.snapshot is None else order(self.snapshot, hidden=self.hidden)

    @property
    def place(self) -> int | None:
        """Index of the selected suspect."""
        count = len(self.entries())
        return min(self._suspect, count - 1) if count else None

    @property
    def entry(self) -> Entry | None:
        """The selected suspect."""
        return None if self.place is None else self.entries()[self.place]

    def parts(self) -> list[Part]:
        """The terms of the model, including those left out."""
        return [] if self.snapshot is None else parts_of_model(self.snapshot)

    @property
    def term_place(self) -> int | None:
        """Index of the selected term; None if another panel is active."""
        return self._term if self.panel == "model" and self.parts() else None

    @property
    def part(self) -> Part | None:
        """The selected term; None if another panel is active."""
        return None if self.term_place is None else self.parts()[self.term_place]

    def view(self) -> ResidualView | None:
        """The plot: the selected suspect's, or residuals against some quantity."""
        if self.snapshot is None:
            return None
        if self.added and self.entry is not None and not self.hidden:
            suspect = self.entry.suspect
            findings = self.snapshot.findings
            explained = None if suspect is None else suspect_view(findings, suspect)
            if explained is not None:
                return explained
        views = [view for view in self.snapshot.views if view.part == self._part]
        if not views:
            return None
        shown = self.entry is not None and not self.hidden
        if not self._chosen and self.snapshot.diagnosis.settled:
            shown = False  # what is left is noise, and so is the first suspect
        suspect = self.entry.suspect if shown and self.entry is not None else None
        return misfit_curve(self.snapshot.findings, views[self._view % len(views)], suspect)

    def choose(self, by: int) -> None:
        """Select another suspect, or another term of the model."""
        if self.panel == "model":
            self._term = (self._term + by) % max(1, len(self.parts()))
        else:
            self._chosen = True
            self._suspect = ((self.place or 0) + by) % max(1, len(self.entries()))
            self.cursor = None if self.added else self.cursor

    def select(self, term: str) -> None:
        """Select the suspect of this name."""
        names = [entry.term for entry in self.entries()]
        if term in names:
            self.panel, self._suspect, self._chosen = PANELS[0], names.index(term), True

    def point(self, by: int) -> None:
        """Pick another point of the plot."""
        view = self.view()
        if view is not None:
            first = 0 if by > 0 else -1
            self.cursor = (first if self.cursor is None else self.cursor + by) % len(view.x)

    def pick_farthest(self) -> None:
        """Pick the point with the largest residual."""
        view = self.view()
        if view is not None:
            model = 0.0 if view.model is None else view.model
            self.cursor = int(np.argmax(np.abs(view.y - model)))

    def turn(self, by: int) -> None:
        """Plot against another quantity; from a suspect's plot back to the one before."""
        self._view += 0 if self.added else by
        self.added, self.cursor = False, None

    def explain(self) -> None:
        """Switch between the selected suspect's plot and the residuals."""
        self.added, self.cursor = not self.added and not self.hidden, None

    def other_part(self) -> None:
        """Show another part of the data: rotations, or an axis at rest."""
        if self.snapshot is not None:
            parts = self.snapshot.parts
            self._part = parts[(parts.index(self._part) + 1) % len(parts)]
            self.added, self.cursor = False, None

    def predict(self) -> None:
        """Hide the answer, or show it."""
        self.hidden = not self.hidden
        self.panel, self.added, self._suspect = PANELS[0], False, 0
