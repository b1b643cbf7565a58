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
from imucal_wizard.tui.widgets.rendered import Rendered


class PageScreen(ModalScreen[bool]):
    """A page that scrolls.

    Args:
        title: of the page.
        content: a Rich renderable, or a function that makes rows for a width.
        close: one more key that closes it: the one that opened it.
        about: chapter of the help, or "".
        measure: offers to measure what the page lists; the result is then True.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,enter,space", "dismiss", "close", tooltip="closes the page"),
        Binding("m", "measure", "measure these now", tooltip="measures what this page lists"),
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
        """A page that scrolls."""
        with VerticalScroll(classes="box page-box") as box:
            box.border_title = self._title
            if callable(self._content):
                lines = Lines()
                lines.draw(self._content)
                yield lines
            else:
                yield Static(Rendered(self._content))
        yield KeyFooter()

    def on_mount(self) -> None:
        """Bind the key that opened the page."""
        if self._close:
            self._bindings.bind(self._close, "dismiss", "close", show=False)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002 (Textual's signature)
        """Disable the keys that this page does not offer."""
        offered = {"measure": self._measure, "explain": bool(self._about)}
        return offered.get(action, True)

    def action_measure(self) -> None:
        """Close the page to measure what it lists."""
        self.dismiss(True)

    async def action_explain(self) -> None:
        """Show help for this page."""
        await self.run_action(f"app.explain('{self._about}')")
