"""The keys that work now."""

from collections.abc import Sequence

from imucal_wizard.tui.text import Line, Span
from imucal_wizard.tui.widgets.lines import Lines

Keys = Sequence[tuple[str, str]]
"""Key and what it does, in a word or two."""


class KeyFooter(Lines):
    """One row of keys; a second one for the virtual hand where there is one."""

    DEFAULT_CSS = "KeyFooter { height: auto; background: $panel; }"

    def offer(self, *rows: Keys) -> None:
        """Show these rows of keys; those that do not fit any more are left out from the end."""
        self.show([self._row(keys) for keys in rows if keys])

    def _row(self, keys: Keys) -> Line:
        width = self.size.width or 80
        spans: list[Span] = [(" ", "")]
        used = 1
        for key, text in keys:
            if used + len(key) + len(text) + 1 > width:
                break
            spans += [(key, "key"), (f" {text}  ", "")]
            used += len(key) + len(text) + 3
        return tuple(spans)
