"""Rows of styled text that go to the terminal only where they have changed."""

from collections.abc import Sequence
from typing import ClassVar

from rich.segment import Segment
from rich.style import Style
from textual.geometry import Region, Size
from textual.strip import Strip
from textual.widget import Widget

from imucal_wizard.tui.text import Line, clean, width_of


class Lines(Widget):
    """Shows rows; only the rows that differ from those before are painted again.

    The text is never read as markup, and control characters in it are dropped.
    """

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "lines--strong",
        "lines--quiet",
        "lines--good",
        "lines--warn",
        "lines--bad",
        "lines--accent",
        "lines--key",
    }
    ALLOW_SELECT = False
    DEFAULT_CSS = """
    Lines { height: auto; }
    Lines .lines--strong { text-style: bold; }
    Lines .lines--quiet { color: $text-muted; }
    Lines .lines--good { color: $text-success; text-style: bold; }
    Lines .lines--warn { color: $text-warning; text-style: bold; }
    Lines .lines--bad { color: $text-error; text-style: bold; }
    Lines .lines--accent { color: $text-accent; text-style: bold; }
    Lines .lines--key { color: $text-accent; text-style: bold; }
    """

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:  # noqa: A002 (Textual's own name for it)
        super().__init__(id=id, classes=classes)
        self._rows: tuple[Line, ...] = ()

    @property
    def rows(self) -> tuple[Line, ...]:
        """The rows shown now."""
        return self._rows

    @property
    def plain(self) -> str:
        """The text shown now, without styles."""
        return "\n".join("".join(text for text, _ in row) for row in self._rows)

    def show(self, rows: Sequence[Line]) -> None:
        """Show these rows from now on."""
        new = tuple(rows)
        old, self._rows = self._rows, new
        if new == old:
            return
        if len(new) != len(old):
            self.refresh(layout=self.styles.is_auto_height)
            return
        width = self.size.width
        changed = [y for y, pair in enumerate(zip(old, new, strict=True)) if pair[0] != pair[1]]
        self.refresh(*(Region(0, y, width, 1) for y in changed))

    def get_content_width(self, container: Size, viewport: Size) -> int:  # noqa: ARG002 (Textual's signature)
        """Width of the longest row."""
        return max((width_of(row) for row in self._rows), default=0)

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:  # noqa: ARG002 (Textual's signature)
        """One line per row."""
        return len(self._rows)

    def render_line(self, y: int) -> Strip:
        """One row as Textual wants it."""
        base = self.rich_style
        width = self.size.width
        if y >= len(self._rows):
            return Strip.blank(width, base)
        parts = [Segment(clean(text), self._style(base, name)) for text, name in self._rows[y]]
        return Strip(parts).adjust_cell_length(width, base)

    def _style(self, base: Style, name: str) -> Style:
        return (
            base + self.get_component_rich_style(f"lines--{name}", partial=True) if name else base
        )
