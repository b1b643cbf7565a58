"""The first step: where the samples come from, and whether they make sense."""

import asyncio
import re
import time
from collections.abc import Callable, Sequence
from functools import partial
from typing import TYPE_CHECKING, ClassVar

from textual import on, work
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical
from textual.content import Content
from textual.widgets import Input, OptionList
from textual.widgets.option_list import Option

from imucal_wizard.errors import ImucalError
from imucal_wizard.tui.screens.live_screen import LiveScreen
from imucal_wizard.tui.source import SourceChoice, SourceKind
from imucal_wizard.tui.text import clean, line, wrapped
from imucal_wizard.tui.threads import in_thread
from imucal_wizard.tui.widgets.key_footer import KeyFooter, Keys
from imucal_wizard.tui.widgets.lines import Lines
from imucal_wizard.tui.widgets.preview import Preview

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.devices.setup import StreamSetup
    from imucal_wizard.live.snapshot import Snapshot, StreamStatus

VIRTUAL = SourceChoice(
    SourceKind.VIRTUAL,
    title="virtual IMU",
    detail="a sensor made of software: to practise on, no hardware needed",
)
_PORT = re.compile(r"\w+://|/dev/|COM\d+$", re.IGNORECASE)
"""What is typed like this is a port or a URL; anything else is a file."""
_RECORDED = (SourceKind.FILE, SourceKind.SESSION)
_QUESTION = "Where do the samples come from?   ↑↓ and enter"


class SourceScreen(LiveScreen):
    """A list of sources on the left; what arrives from the chosen one on the right.

    Attributes:
        seen: set once it has been drawn.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "other", "another source"),
        Binding("f5", "look", "look again"),
        Binding("c", "columns", "columns and units"),
    ]
    step = "source"
    keys: ClassVar[Keys] = (
        ("↑↓", "choose"),
        ("enter", "open"),
        ("tab", "type a file or URL"),
        ("F5", "look again"),
        ("?", "help"),
        ("q", "quit"),
    )
    open_keys: ClassVar[Keys] = (
        ("enter", "start calibrating"),
        ("c", "columns and units"),
        ("esc", "other source"),
        ("?", "help"),
        ("q", "quit"),
    )

    asking_keys: ClassVar[Keys] = (
        ("c", "columns and units"),
        ("esc", "other source"),
        ("?", "help"),
        ("q", "quit"),
    )

    def __init__(self) -> None:
        super().__init__()
        self.seen = asyncio.Event()
        self._choices: list[SourceChoice] = [VIRTUAL]
        self._chosen: SourceChoice | None = None
        self._started = False
        self._asked = False
        self._unknown_since: float | None = None

    def body(self) -> ComposeResult:
        """List and preview; a place to type below."""
        yield Lines(id="question")
        with Horizontal(id="source"):
            with Vertical(id="choices"):
                yield OptionList(id="list", markup=False)
                yield Input(placeholder="file or URL, then enter", id="typed")
            yield Preview()

    def begin(self) -> None:
        """Show what is known at once; look for ports and sessions meanwhile."""
        super().begin()
        if self._chosen is not None:
            return
        self.query_one("#question", Lines).show([line(_QUESTION, "strong")])
        self.query_one(Preview).welcome()
        self._list()
        self.query_one(OptionList).focus()
        if self.wizard.choice is not None and self.wizard.source is None:
            self._open(self.wizard.choice)
        self.call_after_refresh(self._be_seen)

    def _be_seen(self) -> None:
        """What takes long begins only now, so that it does not delay the first picture."""
        self.seen.set()
        if self.wizard.choice is None:
            self.action_look()

    @work(exclusive=True, group="look")
    async def action_look(self) -> None:
        """Look for ports and for sessions to go on with."""
        services = self.wizard.services
        found = [VIRTUAL]
        for look in (services.ports, services.earlier):
            found += await in_thread(partial(self._found, look))
        self._choices = found
        self._list()

    @staticmethod
    def _found(look: Callable[[], Sequence[SourceChoice]]) -> list[SourceChoice]:
        try:
            return list(look())
        except (ImucalError, OSError):  # a list that cannot be made leaves the other sources
            return []

    def _list(self) -> None:
        place = self.query_one(OptionList)
        keep = place.highlighted or 0
        place.set_options([Option(_prompt(choice)) for choice in self._choices])
        place.highlighted = min(keep, len(self._choices) - 1)

    @on(OptionList.OptionSelected)
    def _picked(self, event: OptionList.OptionSelected) -> None:
        if self.wizard.source is not None:
            self.action_start()
        elif self._chosen is None or self._chosen is not self.wizard.choice:
            # nobody picks another source by an early enter while the one ordered is being opened
            self._open(self._choices[event.option_index])

    @on(Input.Submitted)
    def _typed(self, event: Input.Submitted) -> None:
        typed = event.value.strip()
        if typed:
            kind = SourceKind.PORT if _PORT.match(typed) else SourceKind.FILE
            self._open(SourceChoice(kind, typed, typed))

    @work(exclusive=True, group="open")
    async def _open(self, choice: SourceChoice) -> None:
        self._chosen = choice
        self._say(f"Opening {choice.title or choice.target} …")
        try:
            source = await in_thread(lambda: self.wizard.services.open_source(choice))
            self.wizard.use_source(source)
        except ImucalError as error:
            self._chosen = None
            self._say(f"▲ {choice.title or choice.target} cannot be opened", "bad")
            self.query_one(Preview).complain(str(error))
            given = choice is self.wizard.choice and choice.kind in _RECORDED
            self.wizard.fail(error, always=given)
            return
        self.query_one(OptionList).focus()
        self.footer()

    def footer(self) -> None:
        """The keys of choosing, or those of looking at a stream, where a start may not do yet."""
        snapshot = self.wizard.snapshot if self.wizard.source else None
        known = snapshot is None or (snapshot.stream.samples and not snapshot.stream.needs)
        looking = self.open_keys if known else self.asking_keys
        self.query_one(KeyFooter).offer(looking if self.wizard.source else self.keys)

    def action_other(self) -> None:
        """Close this source and choose another."""
        self.wizard.drop_source()
        self._chosen = None
        self._started = self._asked = False
        self._unknown_since = None
        self.query_one(Preview).welcome()
        self.query_one("#question", Lines).show([line(_QUESTION, "strong")])
        self.footer()
        self.action_look()

    def action_columns(self) -> None:
        """Say which column is what, in which unit."""
        snapshot = self.wizard.snapshot
        if snapshot is None or not snapshot.stream.columns:
            return
        from imucal_wizard.tui.screens.mapper_screen import MapperScreen

        self.wizard.push_screen(MapperScreen(snapshot.stream), self._set_up)

    def _set_up(self, setup: "StreamSetup | None") -> None:
        if setup is not None and self.wizard.source is not None:
            self.wizard.source.set_setup(setup)

    def action_start(self) -> None:
        """The stream is what it should be: go on; not before anything has arrived."""
        snapshot = self.wizard.snapshot
        if snapshot is not None and snapshot.stream.samples and not snapshot.stream.needs:
            self.wizard.order("start")

    def take(self, snapshot: "Snapshot") -> None:
        """Show what arrives; start by itself where nobody is asked."""
        super().take(snapshot)
        self.query_one(Preview).tell(snapshot.stream)
        stream = snapshot.stream
        self.footer()
        self._ask(stream)
        alone = self.wizard.settings.auto or (
            self._chosen is not None and self._chosen.kind in _RECORDED
        )
        if alone and not self._started and stream.rate > 0 and stream.accelerometer is not None:
            self._started = True
            self.action_start()

    def _ask(self, stream: "StreamStatus") -> None:
        """Say what is wanted now; open the questions by themselves, once, where there are any."""
        name = self._chosen.title or self._chosen.target if self._chosen else stream.source
        if stream.needs:
            self._say(f"▲ not known: {', '.join(stream.needs)}.   c: choose", "warn")
            self._ask_in_time(stream)
        elif stream.samples:
            self._say(f"{name}: is this what you expect?   enter starts")
        else:
            self._say(f"{name}: waiting for samples …   esc: another source")

    def _ask_in_time(self, stream: "StreamStatus") -> None:
        """Open the questions once it is plain that no header will answer them."""
        now = time.monotonic()
        self._unknown_since = now if self._unknown_since is None else self._unknown_since
        waited = now - self._unknown_since >= self.wizard.settings.header_patience
        if waited and not self._asked and stream.columns:
            self._asked = True
            self.action_columns()

    def _say(self, text: str, style: str = "strong") -> None:
        place = self.query_one("#question", Lines)
        place.show(wrapped(text, place.size.width or 78, style))


def _prompt(choice: SourceChoice) -> Content:
    """Two rows; never read as markup."""
    title = Content(clean(choice.title or choice.target)).stylize("bold")
    return title + Content("\n  " + clean(choice.detail)) if choice.detail else title
