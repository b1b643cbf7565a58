"""A page of text above another screen."""

from typing import ClassVar

from rich.console import RenderableType
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Build, Lines


class PageScreen(ModalScreen[bool]):
    """A page that scrolls.

    Args:
        title: what it is about.
        content: what Rich can show, or what makes the rows for a width.
        close: one more key that closes it, the one that opened it.
        about: part of the help that explains it, or "".
        measure: offers to measure what the page lists; the result is True then.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,enter,space", "dismiss", "close", tooltip="closes the page"),
        Binding("m", "measure", "measure these now", tooltip="leads through what is listed here"),
        Binding("question_mark", "explain", "help", tooltip="explains this page"),
        Binding("q", "app.quit", "quit", tooltip="leaves the program"),
    ]

    def __init__(
        self,
        title: str,
        content: RenderableType | Build,
        close: str = "",
        *,
        about: str = "",
        measure: bool = False,
    ) -> None:
        super().__init__()
        self._title = title
        self._content = content
        self._close = close
        self._about = about
        self._measure = measure

    def compose(self) -> ComposeResult:
        """One scrolling page."""
        with VerticalScroll(classes="box page-box") as box:
            box.border_title = self._title
            if callable(self._content):
                lines = Lines()
                lines.draw(self._content)
                yield lines
            else:
                yield Static(self._content)
        yield KeyFooter()

    def on_mount(self) -> None:
        """The key that opened the page closes it, too."""
        if self._close:
            self._bindings.bind(self._close, "dismiss", "close", show=False)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002 (Textual's signature)
        """Only what this page can do."""
        offered = {"measure": self._measure, "explain": bool(self._about)}
        return offered.get(action, True)

    def action_measure(self) -> None:
        """Measure what is listed."""
        self.dismiss(True)

    async def action_explain(self) -> None:
        """Help on what stands here."""
        await self.run_action(f"app.explain('{self._about}')")
