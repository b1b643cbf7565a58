"""Help for a screen: a text, and the keys that work there."""

from importlib.resources import files
from typing import ClassVar

from rich.table import Table
from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen, Screen
from textual.widgets import Markdown, Static


def chapter(name: str) -> str:
    """A chapter of the help text, in Markdown; "" if there is no such chapter."""
    text = files("imucal_wizard.tui").joinpath("help.md").read_text(encoding="utf-8")
    chapters = dict(part.split("\n", 1) for part in text.split("\n# ")[1:])
    return chapters.get(name, "").strip()


def key_table(screen: Screen[object]) -> Table:
    """The active keys of a screen, each with the text of its binding."""
    shown: dict[str, tuple[list[str], str]] = {}
    for _, binding, enabled, _ in screen.active_bindings.values():
        says = binding.tooltip or (binding.description if binding.show else "")
        if enabled and says and not binding.system:
            keys, _ = shown.setdefault(says, ([], says))
            key = screen.app.get_key_display(binding)
            keys += [key] if key not in keys else []
    table = Table.grid(padding=(0, 2))
    table.add_column(min_width=6, no_wrap=True)
    for keys, says in shown.values():
        table.add_row(Text(" ".join(keys), "bold"), says)
    return table


class HelpScreen(ModalScreen[None]):
    """The purpose of a screen, and its keys.

    Args:
        about: chapter of the help text.
        below: the screen whose keys are shown.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,question_mark,enter,space", "dismiss", "close"),
        Binding("q", "app.quit", "quit"),
    ]
    goes_with_step = True

    def __init__(self, about: str, below: Screen[object]) -> None:
        super().__init__()
        self._about = about
        # while another screen is on top, bindings to ``screen.…`` are checked against that one
        self._keys = key_table(below)

    def compose(self) -> ComposeResult:
        """A text that scrolls."""
        with VerticalScroll(classes="box") as box:
            box.border_title = f"help: {self._about}"
            box.border_subtitle = "esc closes, ↑↓ scroll"
            yield Markdown(chapter(self._about))
            yield Static(self._keys)
