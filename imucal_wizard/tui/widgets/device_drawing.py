"""A drawing of the device: how it lies now, or how it is wanted."""

from imucal_wizard.tui.cube import Matrix, draw
from imucal_wizard.tui.text import line
from imucal_wizard.tui.widgets.drawn import Drawn


class DeviceDrawing(Drawn):
    """A cube with named faces in a frame with a title."""

    DEFAULT_CSS = """
    DeviceDrawing { width: 1fr; height: 1fr; }
    DeviceDrawing { border: round $foreground 40%; border-title-style: bold; }
    """

    def __init__(self, title: str, *, id: str | None = None) -> None:  # noqa: A002 (Textual's own name for it)
        super().__init__(id=id)
        self.border_title = title
        self._attitude: Matrix | None = None
        self._axis = ""

    def place(self, attitude: Matrix | None, axis: str = "") -> None:
        """Draw the device with this body-to-world rotation; None while it is not known.

        Args:
            attitude: body to world.
            axis: a body axis to draw through it, or "".
        """
        self._attitude, self._axis = attitude, axis
        self.draw()

    def draw(self) -> None:
        """Show it in the room there is."""
        width, height = self.size
        if not width or not height:
            return
        if self._attitude is None:
            self.show([line("")] * (height // 2) + [line("not known yet".center(width), "quiet")])
            return
        self.show([line(row) for row in draw(self._attitude, width, height, self._axis)])
