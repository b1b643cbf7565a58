"""The keys that work now."""

from collections.abc import Sequence

from imucal_wizard.tui.text import Line, Span
from imucal_wizard.tui.widgets.lines import Lines

Keys = Sequence[tuple[str, str]]
"""Key and what it does, in a word or two."""
_ALWAYS = ("?", "q")
_GAP = 2


class KeyFooter(Lines):
    """One row of keys; a second one for the virtual hand where there is one.

    Where not all fit, help and quit stay; of the others the last are left out.
    """

    DEFAULT_CSS = "KeyFooter { height: auto; background: $panel; }"

    def offer(self, *rows: Keys) -> None:
        """Show these rows of keys."""
        self.show([footer_row(keys, self.size.width or 80) for keys in rows if keys])


def footer_row(keys: Keys, width: int) -> Line:
    """As many of the keys as fit into a row, help and quit among them."""
    kept = list(keys)
    lesser = [key for key in keys if key[0] not in _ALWAYS]
    while lesser and sum(map(_cells, kept)) + 1 - _GAP > width:
        kept.remove(lesser.pop())
    spans: list[Span] = [(" ", "")]
    for key, text in kept:
        spans += [(key, "key"), (f" {text}" + " " * _GAP, "")]
    return tuple(spans)


def _cells(key: tuple[str, str]) -> int:
    return len(key[0]) + 1 + len(key[1]) + _GAP
