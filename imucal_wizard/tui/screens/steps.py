"""The measuring steps: instruction, drawing, stillness, progress, traces."""

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical

from imucal_wizard.core.quantities import number
from imucal_wizard.guide.kinds import TITLES, Act, StepKind
from imucal_wizard.guide.operator_view import IDENTITY, Matrix, Turn, matrix_of, turn_to
from imucal_wizard.guide.plan import consequence
from imucal_wizard.guide.state import Status
from imucal_wizard.run.snapshot import Snapshot
from imucal_wizard.tui.drawing import ARROW_HEADS, cube_rows
from imucal_wizard.tui.panels.step import (
    OFFER_KEYS,
    notice_rows,
    pose_rows,
    reason,
    rotation_rows,
    start_rows,
    still_rows,
    stream_row,
)
from imucal_wizard.tui.panels.traces import trace_rows
from imucal_wizard.tui.screens.base import LiveScreen
from imucal_wizard.tui.screens.dialogs import RepeatDialog, SkipDialog
from imucal_wizard.tui.text import Line, bar, line, wrapped
from imucal_wizard.tui.widgets.big_text import BigText
from imucal_wizard.tui.widgets.lines import Lines

STEP_DEG = 15.0
"""Rotation of the virtual device at each key."""
_SHOWN_SECONDS = 4.0
"""Duration of a rotation in the drawing, and of the rest after it."""
_STYLES = {Act.HOLD: "good", Act.DONE: "good", Act.WAIT: "warn", Act.CONNECT: "bad"}
"""Style of the headline; "strong" for all other acts."""


def _turn(key: str, axis: str, sense: int, shown: str, words: str) -> Binding:
    """A key that turns the virtual device; the first of each pair turns it right-handed.

    The footer and the help show both keys of a pair at the first.
    """
    says = ""
    if shown:
        plus, minus = shown[0], shown[-1]
        says = f"turns the virtual device about its {axis} axis, by +{STEP_DEG:.0f}° ({plus}) or "
        says += f"−{STEP_DEG:.0f}° ({minus})"
    return Binding(
        key, f"hand_turn('{axis}', {sense})", words, show=bool(shown), key_display=shown or None,
        tooltip=says,
    )  # fmt: skip


class StepScreen(LiveScreen):
    """The layout of all measuring steps; keys of the step and of the virtual hand."""

    CSS_PATH = "steps.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            "u", "order('undo')", "undo last",
            tooltip="takes back the last hold, rotation or circle",
        ),
        Binding("s", "skip", "skip step", tooltip="skips the step, after stating the consequence"),
        Binding("r", "repeat", "repeat step", tooltip="repeats the step from the start"),
        Binding("b", "order('back')", "back", tooltip="goes back one step"),
        Binding(
            "space", "hand_do", "snap",
            tooltip="brings the virtual device into the wanted pose",
        ),
        Binding(
            "S", "hand_steel", "steel passes",
            tooltip="passes steel by the virtual device, which disturbs the field",
        ),
        Binding(
            "T", "hand_tremble", "tremble",
            tooltip="holds the virtual device in a trembling hand, or lays it down",
        ),
        *(
            Binding(key, f"offer('{command}')", command, show=False)
            for command, key in OFFER_KEYS.items()
        ),
        Binding("H", "hand_follow(True)", "hand does it", tooltip="starts the virtual hand"),
        Binding("H", "hand_follow(False)", "hand stops", tooltip="stops the virtual hand"),
        _turn("left", "z", 1, "←→", "about z"),
        _turn("right", "z", -1, "", ""),
        _turn("up", "y", 1, "↑↓", "about y"),
        _turn("down", "y", -1, "", ""),
        _turn("a", "x", 1, "a d", "about x"),
        _turn("d", "x", -1, "", ""),
    ]  # fmt: skip

    wanted_title: ClassVar[str] = "wanted"
    counted: ClassVar[str] = "poses"
    """What the progress of the step counts."""

    def body(self) -> ComposeResult:
        """Instruction, text and drawings, notice, the step's own rows, traces, stream."""
        yield BigText(id="instruction")
        with Horizontal(id="middle"):
            with Vertical(id="words"):
                for name in ("say", "still", "bars", "hold"):
                    yield Lines(id=name)
            with Horizontal(id="drawings"):
                yield from drawings(self.wanted_title)
        yield Lines(id="notice")
        yield Lines(id="own")
        yield Lines(id="traces")
        yield Lines(id="stream")

    def take(self, snapshot: Snapshot) -> None:
        """Show a snapshot."""
        super().take(snapshot)
        if snapshot.status.step == self.step:
            self.show(snapshot)

    def show(self, snapshot: Snapshot) -> None:
        """Show the step."""
        status, stream = snapshot.status, snapshot.stream
        still = status.still
        self.show_stream(snapshot)
        self.lines("say").draw(lambda width, height: self.say_rows(status, width)[: height or 3])
        self.lines("still").show([reason(status)])
        self.lines("bars").draw(lambda width, height: still_rows(still, width, height))
        self.lines("hold").draw(lambda width, _: [self.hold_row(status, width)])
        self.lines("notice").draw(
            lambda width, height: notice_rows(
                stream.problem, status.offers, status.last_event, width, height
            )
        )
        self.lines("own").draw(lambda width, height: self.own_rows(status, width, height))
        units = stream.accelerometer_unit, stream.gyroscope_unit
        self.lines("traces").draw(
            lambda width, height: trace_rows(snapshot.traces, units, width, height)
        )
        now = attitude_of(snapshot)
        wanted = wanted_attitude(status, now or IDENTITY)
        axis = "" if status.rotation is None else status.rotation.axis
        draw_device(self.lines("now"), now, axis, status.turn)
        self.lines("wanted").display = wanted is not None
        draw_device(self.lines("wanted"), wanted, axis)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Enable the keys of the virtual hand, and those of the offered commands."""
        hand, snapshot = self.state.hand, self.state.snapshot
        if action == "offer":
            offers = snapshot.status.offers if snapshot is not None else ()
            return parameters[0] in [offer.command for offer in offers]
        if action.startswith("hand_") and hand is None:
            return False
        if action == "hand_steel":
            return snapshot is not None and snapshot.status.field is not None
        if action == "hand_follow" and hand is not None:
            return parameters[0] is not hand.following
        return True

    def action_order(self, name: str) -> None:
        """Pass a command to the procedure."""
        self.state.order(name)

    def action_offer(self, command: str) -> None:
        """Carry out an offered command."""
        self.state.order(command)

    def action_skip(self) -> None:
        """State the consequence of skipping; skip after confirmation. A step that is done ends."""
        step, snapshot = StepKind(self.step), self.state.snapshot
        if snapshot is not None and any(one.command == "skip" for one in snapshot.status.offers):
            self.state.order("skip")
            return

        def answered(answer: str | None) -> None:
            if answer:
                self.state.order("skip")

        self.app.push_screen(SkipDialog(TITLES[step], consequence(step)), answered)

    def action_repeat(self) -> None:
        """Repeat the step; state first that what it has measured is lost, if there is any."""
        step, snapshot = StepKind(self.step), self.state.snapshot
        nothing = snapshot is None or not snapshot.status.progress[0]
        if step is StepKind.SETTLE or nothing:
            self.state.order("repeat")
            return

        def answered(answer: str | None) -> None:
            if answer:
                self.state.order("repeat")

        self.app.push_screen(RepeatDialog(TITLES[step]), answered)

    def action_hand_turn(self, axis: str, sense: int) -> None:
        """Turn the virtual device."""
        if self.state.hand is not None:
            self.state.hand.turn(axis, sense * STEP_DEG)
            self.refresh_bindings()

    def action_hand_do(self) -> None:
        """Bring the virtual device into the wanted pose."""
        hand, snapshot = self.state.hand, self.state.snapshot
        if hand is not None and snapshot is not None:
            status = snapshot.status
            target = status.wanted if status.rotation is None else status.rotation.start_pose
            if target:
                hand.snap_to(target)
                self.refresh_bindings()

    def action_hand_tremble(self) -> None:
        """Hold the virtual device in the hand, or lay it down."""
        if self.state.hand is not None:
            self.state.hand.tremble(not self.state.hand.trembling)

    def action_hand_steel(self) -> None:
        """Let something of steel pass the virtual device."""
        if self.state.hand is not None:
            self.state.hand.pass_steel()

    def action_hand_follow(self, on: bool) -> None:
        """Let the virtual hand do what the wizard asks, or stop it."""
        if self.state.hand is not None:
            self.state.hand.following = on
            self.refresh_bindings()

    def announced(self, status: Status) -> tuple[str, str]:
        """The headline and its style."""
        return status.instruction, _STYLES.get(status.act, "strong")

    def show_stream(self, snapshot: Snapshot) -> None:
        """Show the headline and the row of the stream."""
        self.query_one(BigText).say(*self.announced(snapshot.status))
        stream, status, muted = snapshot.stream, snapshot.status, self.state.sounds.muted
        self.lines("stream").draw(
            lambda width, _: [stream_row(stream, status.noise, status.still.loosened, muted, width)]
        )

    def progress_words(self, status: Status) -> str:
        """How much of the step is taken."""
        done, wanted = status.progress
        return f"{done:.0f} of {wanted:.0f} {self.counted} taken"

    def say_rows(self, status: Status, width: int) -> list[Line]:
        """Progress, the way, the instruction in words, and its reason.

        The way comes first, because not all of the words may fit.
        """
        rows = [line(self.progress_words(status), "accent")]
        rows += wrapped(status.guidance, width, "strong") if status.guidance else []
        rows += wrapped(status.detail, width) if status.detail else []
        return rows + (wrapped(status.reason, width, "quiet") if status.reason else [])

    def hold_row(self, status: Status, width: int) -> Line:
        """Duration of the hold that is asked for, and the duration needed."""
        still = status.still
        held = still.held if status.act is Act.HOLD else 0.0
        return progress_bar(held, still.needed, width, "good" if still.still else "")

    def own_rows(self, status: Status, width: int, height: int) -> list[Line]:  # noqa: ARG002 (each step has its own)
        """The step's own rows."""
        return []


class SettleScreen(StepScreen):
    """Measures the noise of the device at rest."""

    step = StepKind.SETTLE

    def progress_words(self, status: Status) -> str:
        """Seconds measured."""
        done, wanted = status.progress
        return f"{done:.0f} of {wanted:.0f} s measured"

    def hold_row(self, status: Status, width: int) -> Line:
        """The progress of the step, which is one hold."""
        return progress_bar(*status.progress, width, "good")


class PoseScreen(StepScreen):
    """Takes poses; every missing pose is accepted."""

    step = StepKind.POSES

    def own_rows(self, status: Status, width: int, height: int) -> list[Line]:
        """The list of poses."""
        return pose_rows(
            status.done, status.missing, status.wanted, status.recognised, width, height
        )


class ValidateScreen(PoseScreen):
    """Takes a few new orientations that the fit has not seen."""

    step = StepKind.VALIDATE


class RecheckScreen(PoseScreen):
    """Takes the poses that show most, in any order."""

    step = StepKind.RECHECK

    def progress_words(self, status: Status) -> str:
        """How many of the changes would be seen."""
        done, wanted = status.progress
        return f"{done:.0f} of {wanted:.0f} checks done"


class UpDownScreen(PoseScreen):
    """Takes the six faces, and shows the start values."""

    step = StepKind.UP_DOWN

    def own_rows(self, status: Status, width: int, height: int) -> list[Line]:  # noqa: ARG002 (the table has one size)
        """The start values of each axis."""
        return start_rows(status.done, status.wanted, status.start_values)


class RotationScreen(StepScreen):
    """Takes rotations about one axis after the other."""

    step = StepKind.ROTATIONS
    wanted_title: ClassVar[str] = "do this"
    counted: ClassVar[str] = "rotations"

    def own_rows(self, status: Status, width: int, height: int) -> list[Line]:  # noqa: ARG002 (always four rows)
        """Angle, rate, done and wanted."""
        rotation = status.rotation
        return [] if rotation is None else rotation_rows(rotation, width, status.act)


class MoreScreen(StepScreen):
    """Takes the poses and rotations that the bench requests."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            "s", "order('skip')", "enough: to the bench",
            tooltip="returns to the bench with the measurements so far",
        ),
        Binding("r", "repeat", "repeat all", tooltip="measures all of them again"),
    ]  # fmt: skip
    step = StepKind.MORE
    counted: ClassVar[str] = "measurements"

    def own_rows(self, status: Status, width: int, height: int) -> list[Line]:
        """The requested poses, or the present rotation."""
        if status.rotation is not None:
            return rotation_rows(status.rotation, width, status.act)
        return pose_rows(
            status.done, status.missing, status.wanted, status.recognised, width, height
        )

    def progress_words(self, status: Status) -> str:
        """How many of the requests are measured."""
        return f"for the bench: {super().progress_words(status)}"


def drawings(wanted: str) -> ComposeResult:
    """Widgets for the device's present and wanted attitude."""
    for name, title in (("now", "now"), ("wanted", wanted)):
        place = Lines(id=name, classes="drawing")
        place.border_title = title
        yield place


def draw_device(
    place: Lines, attitude: Matrix | None, axis: str = "", turn: Turn | None = None
) -> None:
    """Draw the device with this body-to-world rotation; None if not known.

    The arrow of a turn has a head in colour.
    """

    def rows(width: int, height: int) -> list[Line]:
        if attitude is None:
            return [line("")] * (height // 2) + [line("not known yet".center(width), "quiet")]
        return [_arrow_line(row) for row in cube_rows(attitude, width, height, axis, turn)]

    place.draw(rows, (attitude, axis, turn))


def _arrow_line(row: str) -> Line:
    at = next((i for i, sign in enumerate(row) if sign in ARROW_HEADS), len(row))
    return (row[:at], ""), (row[at : at + 1], "accent"), (row[at + 1 :], "")


def attitude_of(snapshot: Snapshot) -> Matrix | None:
    """The device's attitude from the stream, or else from the up direction."""
    if snapshot.attitude is not None:
        return matrix_of(snapshot.attitude.tolist())
    up = snapshot.status.up
    return None if up is None else turn_to(IDENTITY, up).of(IDENTITY)


def wanted_attitude(status: Status, now: Matrix) -> Matrix | None:
    """The attitude that is asked for; a rotation is shown over and over."""
    if status.act is Act.ROTATE and status.turn is not None:
        share = min(1.0, 2.0 * (status.elapsed / _SHOWN_SECONDS % 1.0))
        return status.turn.of(now, share)
    if status.turn is not None:
        return status.turn.of(now)
    if status.aim is not None:
        return turn_to(now, status.aim).of(now)
    return now if status.act in (Act.HOLD, Act.LIFT) else None


def progress_bar(done: float, wanted: float, width: int, style: str) -> Line:
    """Seconds done and needed, with a bar."""
    words = f" {done:.1f} of {number(wanted, 2)} s"
    share = done / wanted if wanted > 0 else 0.0
    return ("HOLD    ", "strong"), (bar(share, max(10, width - 9 - len(words))), style), (words, "")
