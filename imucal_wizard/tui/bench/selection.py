"""What is chosen on the bench: panel, suspect, term, picture, point. It knows no screen."""

import numpy as np

from imucal_wizard.diagnose.bench import Entry
from imucal_wizard.diagnose.views import ResidualView, suspect_view
from imucal_wizard.tui.bench.panels import Part, order, parts_of_model
from imucal_wizard.tui.bench.snapshot import BenchSnapshot

PANELS = ("suspects", "model", "ladder")


class Selection:
    """A snapshot with a place in each of its lists.

    Attributes:
        snapshot: what was looked up; None before the first look.
        panel: where up and down choose.
        hidden: lesson mode: nothing is told before a guess.
        added: the picture is that of the chosen suspect.
        cursor: place of the point picked, or None.
    """

    def __init__(self) -> None:
        self.snapshot: BenchSnapshot | None = None
        self.panel = PANELS[0]
        self.hidden = False
        self.added = False
        self.cursor: int | None = None
        self._suspect = self._term = self._view = 0
        self._part = ""

    def show(self, snapshot: BenchSnapshot) -> None:
        """Another model, or another sensor; pictures stay what they are where they can."""
        self.snapshot = snapshot
        self.added, self.cursor, self._suspect = False, None, 0
        self._term = min(self._term, len(self.parts()) - 1)
        if self._part not in snapshot.parts:
            self._part, self._view = snapshot.parts[0], 0

    def entries(self) -> tuple[Entry, ...]:
        """The suspects in the order shown."""
        return () if self.snapshot is None else order(self.snapshot, hidden=self.hidden)

    @property
    def place(self) -> int | None:
        """Place of the chosen suspect."""
        count = len(self.entries())
        return min(self._suspect, count - 1) if count else None

    @property
    def entry(self) -> Entry | None:
        """The chosen suspect."""
        return None if self.place is None else self.entries()[self.place]

    def parts(self) -> list[Part]:
        """The terms of the model, those left out among them."""
        return [] if self.snapshot is None else parts_of_model(self.snapshot)

    @property
    def term_place(self) -> int | None:
        """Place of the chosen term; None while another panel has the arrows."""
        return self._term if self.panel == "model" and self.parts() else None

    @property
    def part(self) -> Part | None:
        """The chosen term; None while another panel has the arrows."""
        return None if self.term_place is None else self.parts()[self.term_place]

    def view(self) -> ResidualView | None:
        """The picture: the chosen suspect's, or what is left against something."""
        if self.snapshot is None:
            return None
        if self.added and self.entry is not None and not self.hidden:
            suspect = self.entry.suspect
            findings = self.snapshot.findings
            explained = None if suspect is None else suspect_view(findings, suspect)
            if explained is not None:
                return explained
        views = [view for view in self.snapshot.views if view.part == self._part]
        return views[self._view % len(views)] if views else None

    def choose(self, by: int) -> None:
        """Another suspect, or another term of the model."""
        if self.panel == "model":
            self._term = (self._term + by) % max(1, len(self.parts()))
        else:
            self._suspect = ((self.place or 0) + by) % max(1, len(self.entries()))
            self.cursor = None if self.added else self.cursor

    def select(self, term: str) -> None:
        """Choose the suspect of this name."""
        names = [entry.term for entry in self.entries()]
        if term in names:
            self.panel, self._suspect = PANELS[0], names.index(term)

    def point(self, by: int) -> None:
        """Another point of the picture."""
        view = self.view()
        if view is not None:
            first = 0 if by > 0 else -1
            self.cursor = (first if self.cursor is None else self.cursor + by) % len(view.x)

    def pick_farthest(self) -> None:
        """Pick the point that is farthest from the model."""
        view = self.view()
        if view is not None:
            model = 0.0 if view.model is None else view.model
            self.cursor = int(np.argmax(np.abs(view.y - model)))

    def turn(self, by: int) -> None:
        """What is left against something else; from a suspect's picture back to the one before."""
        self._view += 0 if self.added else by
        self.added, self.cursor = False, None

    def explain(self) -> None:
        """The chosen suspect's picture, and back."""
        self.added, self.cursor = not self.added and not self.hidden, None

    def other_part(self) -> None:
        """Another part of the data: turns, or an axis at rest."""
        if self.snapshot is not None:
            parts = self.snapshot.parts
            self._part = parts[(parts.index(self._part) + 1) % len(parts)]
            self.added, self.cursor = False, None

    def predict(self) -> None:
        """Hide the answer, or show it again."""
        self.hidden = not self.hidden
        self.panel, self.added, self._suspect = PANELS[0], False, 0
