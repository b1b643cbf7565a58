"""The keys of a step that the machine in the domain carries out."""

from typing import TYPE_CHECKING, ClassVar

from textual.binding import Binding, BindingType
from textual.events import Key

from imucal_wizard.live.snapshot import Snapshot
from imucal_wizard.procedure.plan import standard
from imucal_wizard.procedure.state import Status, StepKind
from imucal_wizard.procedure.wording import TITLES
from imucal_wizard.tui.screens.live_screen import LiveScreen
from imucal_wizard.tui.screens.skip_screen import SkipScreen
from imucal_wizard.tui.widgets.key_footer import KeyFooter, Keys

if TYPE_CHECKING:
    from imucal_wizard.tui.hand_keys import HandKeys

HAND_KEYS: Keys = (
    ("←→", "turn about z"),
    ("↑↓", "about y"),
    ("a d", "about x"),
    ("space", "snap"),
    ("T", "tremble"),
    ("H", "hand does it"),
)
HAND_STOPS = "hand stops"
"""What H does while the hand follows the wizard."""


class KeyedScreen(LiveScreen):
    """Undo, skip, repeat, back; the ways out that are open now; the virtual hand."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("u", "order('undo')", "undo"),
        Binding("s", "skip", "skip"),
        Binding("r", "order('repeat')", "repeat"),
        Binding("b", "order('back')", "back"),
    ]
    keys: ClassVar[Keys] = (
        ("?", "help"),
        ("u", "undo last"),
        ("s", "skip step"),
        ("r", "repeat step"),
        ("b", "back"),
        ("m", "sound"),
        ("q", "quit"),
    )
    hand_keys: ClassVar[Keys] = HAND_KEYS

    def footer(self) -> None:
        """The keys, and those of the virtual hand where there is one, and whether it is at work."""
        hand, keys = self.wizard.hand_keys, self.hand_keys
        if hand is not None and hand.following:
            keys = tuple((key, HAND_STOPS if key == "H" else word) for key, word in keys)
        self.query_one(KeyFooter).offer(self.keys, keys if hand is not None else ())

    def action_order(self, name: str, argument: str = "") -> None:
        """Hand a command to the machine."""
        self.wizard.order(name, argument)

    def action_skip(self) -> None:
        """State what skipping costs; skip when that is accepted."""
        step = standard().step(StepKind(self.step))

        def answered(skip: bool | None) -> None:
            if skip:
                self.wizard.order("skip")

        self.wizard.push_screen(SkipScreen(TITLES[step.kind], step.skipped), answered)

    def on_key(self, event: Key) -> None:
        """Ways out that are open now have keys of their own; so has the virtual hand."""
        snapshot = self.wizard.snapshot
        for offer in snapshot.status.offers if snapshot else ():
            if offer.key == (event.character or event.key):
                self.wizard.order(offer.command)
                event.stop()
                return
        hand: HandKeys | None = self.wizard.hand_keys
        if hand is not None and hand.press(event.key, snapshot.status if snapshot else None):
            self.footer()
            event.stop()

    def announced(self, snapshot: Snapshot) -> tuple[str, str]:
        """What is read from two metres, and its style; a lost line before all else."""
        if not snapshot.stream.connected and not snapshot.finished:
            return "NOT CONNECTED", "bad"
        return self.headline(snapshot.status)

    def headline(self, status: Status) -> tuple[str, str]:
        """The instruction."""
        return status.instruction or self.wizard.waiting_words, "strong"
