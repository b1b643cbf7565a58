"""The footer in up to two rows."""

from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import HorizontalGroup
from textual.reactive import reactive
from textual.screen import Screen
from textual.widgets import Footer
from textual.widgets._footer import FooterKey

_BLANKS = 3
"""Cells around a key and its description."""


class _Key(FooterKey):
    """A key as it is: a change of its style costs more than everything else in a footer."""

    compact = reactive(False)


class KeyFooter(Footer):
    """Textual's footer in rows: one row of 80 columns does not hold the keys of every screen.

    It is composed again only if the keys or the width have changed.
    """

    DEFAULT_CSS = """
    KeyFooter { layout: vertical; height: auto; max-height: 2; }
    KeyFooter HorizontalGroup { height: 1; }
    """

    def __init__(self) -> None:
        super().__init__(show_command_palette=False)
        self._composed: tuple[object, ...] = ()

    def compose(self) -> ComposeResult:
        """Fill row after row; the help lists the keys that do not fit."""
        if not self._bindings_ready:
            return
        self._composed = self._content()
        row: list[FooterKey] = []
        room = self.app.size.width
        for binding, enabled, tooltip in self._keys():
            shown = self.app.get_key_display(binding)
            wide = len(shown) + len(binding.description) + _BLANKS
            if row and wide > room:
                yield HorizontalGroup(*row)
                row, room = [], self.app.size.width
            key = binding.key, shown, binding.description, binding.action
            row.append(_Key(*key, disabled=not enabled, tooltip=tooltip))
            room -= wide
        yield HorizontalGroup(*row)

    def _keys(self) -> list[tuple[Binding, bool, str]]:
        """The first key of each action, whether it is enabled, and its tooltip."""
        first: dict[str, tuple[Binding, bool, str]] = {}
        for one in self.screen.active_bindings.values():
            if one.binding.show:
                first.setdefault(one.binding.action, (one.binding, one.enabled, one.tooltip))
        return list(first.values())

    def _content(self) -> tuple[object, ...]:
        """What the footer depends on."""
        return (self.app.size.width, *self._keys())

    def bindings_changed(self, screen: "Screen[object]") -> None:
        """Show other keys."""
        if not self._bindings_ready or self._content() != self._composed:
            super().bindings_changed(screen)

    def on_resize(self) -> None:
        """Fill the rows for the new width."""
        if self._bindings_ready and self._content() != self._composed:
            self.call_after_refresh(self.recompose)
