"""The first step: choice of the source, and preview of its samples."""

import re
import time
from collections.abc import Collection
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.content import Content
from textual.message import Message
from textual.widgets import Input, OptionList
from textual.widgets.option_list import Option

from imucal_wizard.core.errors import ImucalError
from imucal_wizard.core.input import is_port
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.tui.panels.preview import (
    can_be_entered,
    preview_rows,
    startable,
    state_span,
    welcome_rows,
)
from imucal_wizard.tui.screens.base import OF_A_RECHECK, Failed, LiveScreen
from imucal_wizard.tui.sources import SourceChoice, SourceKind
from imucal_wizard.tui.state import WizardState
from imucal_wizard.tui.text import clean, wrapped
from imucal_wizard.tui.threads import being_left, in_thread
from imucal_wizard.tui.widgets.lines import Lines

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.acquire.setup import StreamSetup
    from imucal_wizard.run.snapshot import Snapshot, StreamStatus

VIRTUAL = SourceChoice(
    SourceKind.VIRTUAL,
    title="virtual IMU",
    detail="a simulated sensor to practise with; no hardware needed",
)
_PORT = re.compile(r"\w+://|/dev/|COM\d+$|mavlink:", re.IGNORECASE)
"""Typed text of this form is a port or a URL; other text is a file, or another name of a port."""
_RECORDED = (SourceKind.FILE, SourceKind.SESSION)
_DEVICES = (SourceKind.VIRTUAL, SourceKind.PORT)
_PLACES = {
    SourceKind.VIRTUAL: 0, SourceKind.PORT: 0, SourceKind.FILE: 0, SourceKind.RECHECK: 2,
    SourceKind.SESSION: 3,
}  # fmt: skip
"""Order in the list; interrupted sessions are between ports and rechecks."""
_QUESTION = "Where do the samples come from?   ↑↓ and enter"


_ENTER: list[BindingType] = [
    Binding(
        "enter", "screen.open", "open", key_display="enter",
        tooltip="opens the selected source, or the typed one",
    ),
    Binding(
        "enter", "screen.start", "start", key_display="enter",
        tooltip="starts the calibration or the recheck",
    ),
]  # fmt: skip
"""Bound by the widget that has the focus: a key bound with priority would overtake those typed
before it."""


class SourceList(OptionList):
    """The sources found."""

    BINDINGS: ClassVar[list[BindingType]] = _ENTER


class SourceInput(Input):
    """A field for a file or URL."""

    BINDINGS: ClassVar[list[BindingType]] = _ENTER


class SourceScreen(LiveScreen):
    """A list of sources on the left, the preview of the chosen one on the right."""

    class Seen(Message):
        """The screen has been drawn."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("m", "app.mute", "sound", show=False, tooltip="switches the sounds off or on"),
        Binding(
            "tab", "type", "type a file or URL",
            tooltip="moves to the field for a file or URL, and back",
        ),
        Binding("f5", "look", "look again", tooltip="looks for ports and sessions again"),
        Binding(
            "c", "columns", "columns and units", tooltip="sets columns and units"
        ),
        Binding("d", "describe", "device", tooltip="names device, place and operator"),
        Binding(
            "d", "devices", "devices", tooltip="shows the devices that were measured, and drifts"
        ),
        Binding("escape", "other", "other source", tooltip="goes back to the list of sources"),
    ]  # fmt: skip
    step = StepKind.SOURCE

    def __init__(self, state: WizardState) -> None:
        super().__init__(state)
        self._choices: list[SourceChoice] = [VIRTUAL]
        self._recheck = state.services.given_recheck
        """The calibration to check, or None; if it is chosen, only devices are listed."""
        self._chosen: SourceChoice | None = None
        """The source that is open or being opened."""
        self._started = False
        self._asked = False
        self._offered = (False, False)
        self._unknown_since: float | None = None

    def body(self) -> ComposeResult:
        """List, field for typing, preview."""
        yield Lines(id="question")
        with Horizontal(id="source"):
            with Vertical(id="choices"):
                yield SourceList(id="list", markup=False)
                yield SourceInput(placeholder="file or URL, then enter", id="typed")
            yield Lines(id="preview")

    def on_mount(self) -> None:
        """Show the list; look for ports and sessions once it is drawn."""
        super().on_mount()
        if being_left(self):
            return
        self._list()
        self.query_one(OptionList).focus()
        if self.state.source is None:
            self._ask()
            if self.state.choice is not None:
                self._open(self.state.choice)
        self.call_after_refresh(self._be_seen)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002 (Textual's signature)
        """Enable the keys to choose, or those for an open source."""
        if action in ("open", "type", "look", "devices"):
            return self.state.source is None
        if action == "other":
            asked = self.state.services.given_recheck
            return self.state.source is not None or self._recheck != asked
        if action == "describe":
            return self.state.source is not None
        if action == "columns":
            return self._columns_known
        return self._ready if action == "start" else True

    @property
    def _ready(self) -> bool:
        """Whether samples arrive with known columns and units."""
        snapshot = self.state.snapshot if self.state.source is not None else None
        return snapshot is not None and startable(snapshot.stream)

    @property
    def _columns_known(self) -> bool:
        """Whether there are columns to choose from."""
        snapshot = self.state.snapshot if self.state.source is not None else None
        return snapshot is not None and bool(snapshot.stream.columns)

    def _be_seen(self) -> None:
        """Start slow work after the first paint."""
        self.post_message(self.Seen())
        if self.state.choice is None:
            self.action_look()

    @work(exclusive=True, group="look")
    async def action_look(self) -> None:
        """Look for ports, for devices to check and for sessions; say what cannot be listed."""
        services, found, problem = self.state.services, [VIRTUAL], ""
        for look in (services.ports, services.calibrations, services.earlier):
            try:
                found += await in_thread(look)
            except (ImucalError, OSError) as error:  # the other sources remain
                problem = f"▲ not all sources are listed: {error}"
        self._choices = sorted(found, key=_rank)
        self._list()
        if problem and self._chosen is None:
            recheck = self._recheck is not None
            self.lines("preview").draw(
                lambda width, _: [
                    *wrapped(problem, width, "warn", "  "),
                    *welcome_rows(width, recheck),
                ]
            )

    @property
    def _listed(self) -> list[SourceChoice]:
        """The sources found; for a recheck only devices, of which the virtual IMU is always one."""
        kinds = tuple(SourceKind) if self._recheck is None else _DEVICES
        return [one for one in self._choices if one.kind in kinds]

    def _list(self) -> None:
        place, listed = self.query_one(OptionList), self._listed
        keep = place.highlighted or 0
        place.set_options([Option(_prompt(choice)) for choice in listed])
        place.highlighted = min(keep, len(listed) - 1)

    def action_open(self) -> None:
        """Open the selected source, or the typed one; once, however often the key is pressed."""
        if self._chosen is not None:
            return
        if self.query_one(Input).has_focus:
            self._open_typed()
        else:
            self._take(self._listed[self.query_one(OptionList).highlighted or 0])

    def _take(self, choice: SourceChoice) -> None:
        """Open a source, or ask for the source of a recheck."""
        if choice.kind is not SourceKind.RECHECK:
            self._open(choice)
            return
        self.state.services.recheck_with(Path(choice.target))
        self._recheck = choice
        self._list()
        self._ask()
        self.refresh_bindings()

    @property
    def steps_to_come(self) -> Collection[str]:
        """Those of a recheck if one was chosen."""
        return super().steps_to_come if self._recheck is None else OF_A_RECHECK

    def _ask(self) -> None:
        """Ask for the source, beside what the procedure does."""
        recheck = self._recheck
        if recheck is None:
            self._say(_QUESTION)
        else:
            self._say(f"{recheck.title}: {_QUESTION[0].lower()}{_QUESTION[1:]}")
        self.show_steps()
        self.lines("preview").draw(lambda width, _: welcome_rows(width, recheck is not None))

    def _open_typed(self) -> None:
        typed = self.query_one(Input).value.strip()
        port = _PORT.match(typed) or is_port(Path(typed))
        kind = SourceKind.PORT if port else SourceKind.FILE
        if typed:
            self._open(SourceChoice(kind, typed, typed))

    def action_type(self) -> None:
        """Move to the field for a file or URL, and back."""
        self.focus_next()

    @on(OptionList.OptionSelected)
    def _clicked(self) -> None:
        if self.state.source is None:
            self.action_open()

    def _open(self, choice: SourceChoice) -> None:
        self._chosen = choice
        self._say(f"Opening {choice.title or choice.target} …")
        self._use(choice)

    @work(group="open")
    async def _use(self, choice: SourceChoice) -> None:
        """Open a source in a thread, and read it."""
        try:
            source = await in_thread(lambda: self.state.services.open_source(choice))
            self.state.use(source)
        except ImucalError as error:
            self._chosen = None
            self._say(f"▲ {choice.title or choice.target} cannot be opened", "bad")
            problem = str(error)
            if "sessions" in error.settings:
                problem = f"{problem}: imucal-wizard --sessions DIR"
            self.lines("preview").draw(lambda width, _: wrapped(f"▲ {problem}", width, "bad", "  "))
            if choice is self.state.choice:
                self._offer_again(choice)
            given = choice is self.state.choice and choice.kind in _RECORDED
            self.post_message(Failed(error, always=given))
            return
        self.query_one(OptionList).focus()
        self.refresh_bindings()

    def _offer_again(self, choice: SourceChoice) -> None:
        """Select the source of the command line, so that Enter tries it again and no other."""
        if choice not in self._choices:
            self._choices = [*self._choices, choice]
        self._list()
        self.query_one(OptionList).highlighted = self._listed.index(choice)

    def action_other(self) -> None:
        """Close this source, or give up the recheck, and choose another."""
        self.state.drop()
        self.state.services.recheck_with(None)
        self._chosen, self._recheck = None, self.state.services.given_recheck
        self._started = self._asked = False
        self._unknown_since = None
        self._ask()
        self.refresh_bindings()
        self.action_look()

    def action_columns(self) -> None:
        """Ask for columns and units."""
        source = self.state.source
        if source is None or not source.snapshot().stream.columns:
            return
        from imucal_wizard.tui.screens.columns import ColumnsScreen

        self.app.push_screen(ColumnsScreen(lambda: source.snapshot().stream), self._set_up)

    def _set_up(self, setup: "StreamSetup | None") -> None:
        if setup is not None and self.state.source is not None:
            self.state.source.set_setup(setup)

    def described(self) -> None:
        """Show another name of the device."""
        self.draw_preview()

    def action_devices(self) -> None:
        """Show the devices with their histories."""
        from imucal_wizard.tui.screens.devices import DevicesScreen

        self.app.push_screen(DevicesScreen(self.state.services))

    def action_start(self) -> None:
        """Start the procedure, once samples have arrived."""
        if self._ready:
            self.state.order("start")

    def take(self, snapshot: "Snapshot") -> None:
        """Show the preview; a recording and an unattended run start by themselves."""
        super().take(snapshot)
        stream, offered = snapshot.stream, (self._ready, self._columns_known)
        chosen = self._chosen
        name = chosen.title or chosen.target if chosen else stream.source
        self._say(*state_span(stream, name))
        self.draw_preview()
        if offered != self._offered:
            self._offered = offered
            self.refresh_bindings()
        if stream.needs and can_be_entered(stream):
            self._ask_in_time(stream)
        alone = self.state.settings.auto or (
            self._chosen is not None and self._chosen.kind in _RECORDED
        )
        if alone and not self._started and stream.rate > 0 and stream.accelerometer is not None:
            self._started = True
            self.action_start()

    def draw_preview(self) -> None:
        """Show the newest samples, below the device that they come from."""
        snapshot, known = self.state.snapshot, self.state.services.description
        if snapshot is not None:
            self.lines("preview").draw(
                lambda width, _: preview_rows(snapshot.stream, width, known.named)
            )

    def _ask_in_time(self, stream: "StreamStatus") -> None:
        """Open the questions once no header can be expected to answer them."""
        now = time.monotonic()
        self._unknown_since = now if self._unknown_since is None else self._unknown_since
        waited = now - self._unknown_since >= self.state.settings.header_patience
        if waited and not self._asked and stream.columns:
            self._asked = True
            self.action_columns()

    def _say(self, text: str, style: str = "strong") -> None:
        self.lines("question").draw(lambda width, _: wrapped(text, width, style), (text, style))


def _rank(choice: SourceChoice) -> int:
    """Place in the list: an interrupted session comes before rechecks and finished sessions."""
    return 1 if choice.unfinished else _PLACES[choice.kind]


def _prompt(choice: SourceChoice) -> Content:
    """A choice in two rows, never read as markup."""
    title = Content(clean(choice.title or choice.target)).stylize("bold")
    return title + Content("\n  " + clean(choice.detail)) if choice.detail else title
