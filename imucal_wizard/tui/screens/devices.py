"""The devices that were measured, each with its history."""

from typing import TYPE_CHECKING, ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.content import Content
from textual.screen import ModalScreen
from textual.widgets import OptionList
from textual.widgets.option_list import Option

from imucal_wizard.core.dates import day_text
from imucal_wizard.core.errors import ImucalError
from imucal_wizard.core.quantities import plural
from imucal_wizard.sessions.history import distinct_names
from imucal_wizard.tui.services import Services
from imucal_wizard.tui.text import Line, clean, line, wrapped
from imucal_wizard.tui.threads import in_thread
from imucal_wizard.tui.widgets.footer import KeyFooter
from imucal_wizard.tui.widgets.lines import Lines

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.sessions.history import DeviceHistory, KnownDevice

_NONE = (
    "No device yet. A calibration belongs to a device: its name is proposed when a source is "
    "opened, and each calibration that is saved becomes part of the history of that device."
)


class DeviceList(OptionList):
    """The devices; the other keys belong to the page below."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("right", "screen.turn(1)", "parameters", key_display="←→",
                tooltip="plots the next or the previous parameter over the dates"),
        Binding("left", "screen.turn(-1)", show=False),
        Binding("o", "screen.over", "over temperature", tooltip="plots over dates or temperature"),
        Binding("pagedown,space", "screen.scroll(1)", "scroll", tooltip="scrolls the page"),
        Binding("pageup", "screen.scroll(-1)", show=False),
    ]  # fmt: skip


class DevicesScreen(ModalScreen[None]):
    """A list of devices; below it the history of the selected one, or a plot of a parameter.

    Args:
        services: list the devices.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,d", "dismiss", "close", tooltip="goes back to the sources"),
        Binding("question_mark", "app.explain('devices')", "help", tooltip="explains this screen"),
        Binding("q", "app.quit", "quit", tooltip="leaves the program"),
    ]

    def __init__(self, services: Services) -> None:
        super().__init__()
        self._services = services
        self._devices: list[KnownDevice] = []
        self._history: DeviceHistory | None = None
        self._place = 0
        """0 for the text, then the parameters."""
        self._over = "date"

    def compose(self) -> ComposeResult:
        """The list, and the page."""
        with Vertical(classes="box wide-box") as box:
            box.border_title = "devices"
            yield DeviceList(id="devices", markup=False)
            with VerticalScroll():
                yield Lines(id="history")
        yield KeyFooter()

    def on_mount(self) -> None:
        """List the devices."""
        self.query_one(DeviceList).focus()
        self._page().draw(lambda width, _: wrapped("Reading the catalogue …", width, "accent"))
        self.look()

    def _page(self) -> Lines:
        return self.query_one("#history", Lines)

    @work(exclusive=True, group="look")
    async def look(self) -> None:
        """Read the devices in a thread."""
        try:
            self._devices = list(await in_thread(self._services.devices))
        except (ImucalError, OSError) as error:
            problem = str(error)
            self._page().draw(lambda width, _: wrapped(f"▲ {problem}", width, "bad"))
            return
        if not self._devices:
            self._page().draw(lambda width, _: wrapped(_NONE, width))
        rows = map(_row, self._devices, distinct_names(self._devices))
        self.query_one(DeviceList).set_options([Option(one) for one in rows])
        if self._devices:
            self.query_one(DeviceList).highlighted = 0

    @on(OptionList.OptionHighlighted)
    def _selected(self, event: OptionList.OptionHighlighted) -> None:
        self.read(self._devices[event.option_index])

    @work(exclusive=True, group="read")
    async def read(self, device: "KnownDevice") -> None:
        """Read the history of a device in a thread."""
        try:
            self._history = await in_thread(lambda: self._services.history(device))
        except (ImucalError, OSError) as error:
            self._history, problem = None, str(error)
            self._page().draw(lambda width, _: wrapped(f"▲ {problem}", width, "bad"))
            return
        self._place = 0
        self._draw()

    def _parameters(self) -> list[tuple[str, str]]:
        """Sensor and name of the parameters of the newest calibration."""
        newest = self._history.calibrations[-1:] if self._history is not None else ()
        return [
            (sensor, name)
            for one in newest
            for sensor, record in one.sensors.items()
            for name in record.parameters
        ]

    def action_turn(self, by: int) -> None:
        """Show the next page: the text, then each parameter."""
        if self._history is not None:
            self._place = (self._place + by) % (len(self._parameters()) + 1)
            self._draw()

    def action_over(self) -> None:
        """Plot over temperature instead of dates, or the other way round."""
        self._over = "date" if self._over == "temperature" else "temperature"
        self._place = self._place or (1 if self._parameters() else 0)
        self._draw()

    def action_scroll(self, by: int) -> None:
        """Scroll the page."""
        scroll = self.query_one(VerticalScroll)
        (scroll.scroll_page_down if by > 0 else scroll.scroll_page_up)(animate=False)

    def _draw(self) -> None:
        history, scroll = self._history, self.query_one(VerticalScroll)
        if history is None:
            return
        from imucal_wizard.report.history_text import course_plot, history_text
        from imucal_wizard.report.text import TEXT_COLUMNS

        def rows(width: int, _height: int) -> list[Line]:
            if not self._place:
                text = history_text(history, min(width, TEXT_COLUMNS))
                return [line(clean(row)) for row in text.splitlines()]
            sensor, name = self._parameters()[self._place - 1]
            height = max(8, scroll.size.height)
            drawn = course_plot(history, sensor, name, width, height, self._over)
            return [line(clean(text)) for text in drawn]

        self._page().draw(rows)
        scroll.scroll_home(animate=False)


def _row(device: "KnownDevice", name: str) -> Content:
    counts = f"{plural(device.calibrations, 'calibration')}, {plural(device.rechecks, 'recheck')}"
    return Content(f"{clean(name):<28.28}").stylize("bold") + Content(
        f"  {counts}, {day_text(device.last)}"
    )
