"""Rows of styled text, of which only changed ones are painted."""

from collections.abc import Callable, Hashable, Sequence

from rich.segment import Segment
from textual.geometry import Region, Size
from textual.strip import Strip
from textual.widget import Widget

from imucal_wizard.tui.text import STYLES, Line, clean, width_of

Build = Callable[[int, int], Sequence[Line]]
"""Makes rows for a width and a height in cells."""


class Lines(Widget):
    """Shows rows, and makes them again when its size changes.

    Only rows that differ from the previous ones are painted, which makes a screen cheap that
    changes 20 times a second. Text is never read as markup; control characters are dropped.
    """

    ALLOW_SELECT = False
    DEFAULT_CSS = "Lines { height: auto; }"

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:  # noqa: A002 (Textual's own name for it)
        super().__init__(id=id, classes=classes)
        self._rows: tuple[Line, ...] = ()
        self._build: Build | None = None
        self._drawn: Hashable = None

    @property
    def rows(self) -> tuple[Line, ...]:
        """The rows shown now."""
        return self._rows

    @property
    def plain(self) -> str:
        """The text shown now, without styles."""
        return "\n".join("".join(text for text, _ in row) for row in self._rows)

    def draw(self, build: Build, of: Hashable = None) -> None:
        """Show the rows that ``build`` makes for the present size, and for later ones.

        Args:
            build: makes the rows for a width and a height.
            of: identifies the content; if it is not None, equal content is not drawn again.
        """
        if of is not None and of == self._drawn:
            return
        self._build, self._drawn = build, of
        if self.size.width:
            self._show(build(*self.size))
        elif self.styles.is_auto_height:
            self.refresh(layout=True)

    def show(self, rows: Sequence[Line]) -> None:
        """Show these rows at any size."""
        self._build = self._drawn = None
        self._show(rows)

    def on_resize(self) -> None:
        """Make the rows for the new size."""
        if self._build is not None:
            self._show(self._build(*self.size))

    def _show(self, rows: Sequence[Line]) -> None:
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
        if self._build is not None and width:
            self._rows = tuple(self._build(width, 0))
        return len(self._rows)

    def render_line(self, y: int) -> Strip:
        """One row for Textual."""
        base = self.rich_style
        width = self.size.width
        if y >= len(self._rows):
            return Strip.blank(width, base)
        parts = [
            Segment(clean(text), base + STYLES[name] if name else base)
            for text, name in self._rows[y]
        ]
        return Strip(parts).adjust_cell_length(width, base)
