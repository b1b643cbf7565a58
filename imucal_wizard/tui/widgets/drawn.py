"""Rows that are drawn for the size there is."""

from textual import events

from imucal_wizard.tui.widgets.lines import Lines


class Drawn(Lines):
    """Draws again when its size changes."""

    def on_resize(self, event: events.Resize) -> None:
        """Draw for the new size."""
        event.stop()
        self.draw()

    def draw(self) -> None:
        """Show what is known in the room there is."""
