"""Device, place and operator of a measurement."""

from dataclasses import fields
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.screen import ModalScreen
from textual.widgets import Input, Label

from imucal_wizard.core.description import MAX_DESCRIPTION_CHARACTERS, Description
from imucal_wizard.tui.text import wrapped
from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Lines

_HINTS = {
    "device": "its calibrations are kept as the history of this name",
    "serial": "of the device or its board",
    "chip": "like BMI088",
    "place": "where it is measured",
    "operator": "who measures",
    "note": "anything else",
}
_WORDS = (
    "No field is required. The serial number distinguishes devices of the same name, and "
    "identifies a device that was renamed."
)


class DescriptionInput(Input):
    """One of the fields."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            "enter", "screen.use", "use", key_display="enter",
            tooltip="uses what the fields say",
        ),
        Binding("down", "app.focus_next", "field", key_display="↑↓", tooltip="another field"),
        Binding("up", "app.focus_previous", show=False),
    ]  # fmt: skip


class DescriptionScreen(ModalScreen[Description | None]):
    """Asks for device, place and operator; the result is the description, or None.

    Args:
        description: what is known.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "dismiss(None)", "cancel", tooltip="leaves it as it is"),
    ]

    def __init__(self, description: Description) -> None:
        super().__init__()
        self._description = description

    def compose(self) -> ComposeResult:
        """A row for each field."""
        with Vertical(classes="box small") as box:
            box.border_title = "what is measured?"
            for name, hint in _HINTS.items():
                with Horizontal(classes="field"):
                    yield Label(f"{name:<9}", markup=False)
                    yield DescriptionInput(
                        getattr(self._description, name),
                        placeholder=hint,
                        id=name,
                        compact=True,
                        max_length=MAX_DESCRIPTION_CHARACTERS,
                        select_on_focus=False,
                    )
            yield Lines(id="words")
        yield KeyFooter()

    def on_mount(self) -> None:
        """Show which fields are required."""
        self.query_one("#words", Lines).draw(lambda width, _: wrapped(_WORDS, width, "quiet"))

    def action_use(self) -> None:
        """Use what the fields say."""
        self.dismiss(
            Description.read(
                {
                    one.name: self.query_one(f"#{one.name}", Input).value
                    for one in fields(Description)
                }
            )
        )
