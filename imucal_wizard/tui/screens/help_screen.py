"""Help for the step in front, in plain words."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen

from imucal_wizard.tui.help_words import WORDS
from imucal_wizard.tui.leaving import being_left
from imucal_wizard.tui.text import Line, line, wrapped
from imucal_wizard.tui.widgets.lines import Lines

_LEAVE = (("q", "leaves; everything is written down and the session can be taken up again"),)
_BACK = (("b", "goes back one step"), ("m", "sounds off or on"), *_LEAVE)
_MEASURING = (
    ("u", "takes back the last hold, rotation or circle; nothing else is lost"),
    ("s", "skips the step; what that costs is said"),
    ("r", "does the step again from its beginning"),
    *_BACK,
)
_FITTED = ("result", "save")
_STILL = ("source", "columns", "heading", "methods", "parameters")
"""Pages on which nothing is measured: the keys of a measuring step do nothing there."""
_HAND = (
    ("← →", "turn the virtual device about its z axis by 15°: to the left, to the right"),
    ("↑ ↓", "about its y axis: to the left, to the right"),
    ("a d", "about its x axis: to the left, to the right"),
    ("space", "bring it into the pose asked for; in the step field, turn it round there"),
    ("S", "something of steel passes: the field is disturbed for a moment"),
    ("T", "hold it in a trembling hand, or lay it down"),
    ("H", "let the virtual hand do everything, or take over again"),
)
_SOUNDS = (
    "Sounds: one bell = still or moving; two quick = taken; three quick = step done; slow bells = "
    "look at the screen."
)


class HelpScreen(ModalScreen[None]):
    """What this step wants and what the keys do.

    Args:
        step: the step to explain.
        hand: whether there is a virtual hand.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,question_mark,enter,space", "dismiss", "close"),
        Binding("q", "app.leave", "quit"),
    ]

    def __init__(self, step: str, *, hand: bool = False) -> None:
        super().__init__()
        self._step = step
        self._hand = hand

    def compose(self) -> ComposeResult:
        """One scrolling text."""
        with VerticalScroll(classes="box") as box:
            box.border_title = f"help: {self._step}"
            box.border_subtitle = "any time: esc closes, ↑↓ scroll"
            yield Lines()

    def on_resize(self) -> None:
        """Wrap for the width there is."""
        if being_left(self):
            return
        lines = self.query_one(Lines)
        lines.show(self._rows(max(40, min(96, self.app.size.width * 9 // 10 - 10))))

    def _rows(self, width: int) -> list[Line]:
        rows: list[Line] = []
        for text in WORDS.get(self._step, ()):
            rows += [*wrapped(text, width), line("")]
        if self._step in (*_FITTED, *_STILL):
            return rows + self._keys(_BACK if self._step in _FITTED else _LEAVE, width)
        rows += self._keys(_MEASURING, width)
        if self._hand:
            rows += [line(""), line("The virtual hand:", "strong"), *self._keys(_HAND, width)]
        return [*rows, line(""), *wrapped(_SOUNDS, width)]

    @staticmethod
    def _keys(keys: tuple[tuple[str, str], ...], width: int) -> list[Line]:
        rows: list[Line] = []
        for key, text in keys:
            first, *rest = wrapped(text, width - 8)
            rows.append(((f"{key:<7} ", "key"), first[0]))
            rows += [((" " * 8, ""), row[0]) for row in rest]
        return rows
