"""The footer in up to two rows."""

from textual.app import ComposeResult
from textual.containers import HorizontalGroup
from textual.widgets import Footer
from textual.widgets._footer import FooterKey

_BLANKS = 3
"""Cells around a key and its description."""


class KeyFooter(Footer):
    """Textual's footer in rows: one row of 80 columns does not hold the keys of every screen."""

    DEFAULT_CSS = """
    KeyFooter { layout: vertical; height: auto; max-height: 2; }
    KeyFooter HorizontalGroup { height: 1; }
    """

    def __init__(self) -> None:
        super().__init__(show_command_palette=False)

    def compose(self) -> ComposeResult:
        """Fill row after row; the help lists the keys that do not fit."""
        row: list[FooterKey] = []
        room = self.app.size.width
        for key in super().compose():
            assert isinstance(key, FooterKey), "no binding here is in a group"  # noqa: S101 (narrows the type)
            wide = len(key.key_display) + len(key.description) + _BLANKS
            if row and wide > room:
                yield HorizontalGroup(*row)
                row, room = [], self.app.size.width
            row.append(key)
            room -= wide
        yield HorizontalGroup(*row)

    def on_resize(self) -> None:
        """Fill the rows for the new width."""
        self.call_after_refresh(self.recompose)
