"""What the screens ask of a source of samples, and what the app is given to work with."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Protocol, runtime_checkable

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.bench.benches import Benches
    from imucal_wizard.devices.setup import StreamSetup
    from imucal_wizard.fitting.methods import MethodRow
    from imucal_wizard.live.snapshot import Snapshot
    from imucal_wizard.procedure.collected import Collected
    from imucal_wizard.solver.result import FitReport


class Source(Protocol):
    """A stream with its procedure, running in a thread of its own."""

    live: bool
    """Whether it is a device, which can be asked for new poses."""

    @property
    def finished(self) -> bool:
        """Whether nothing more will come."""

    def start(self) -> None:
        """Begin to read."""

    def stop(self) -> None:
        """Stop reading; back within 100 ms."""

    def snapshot(self) -> "Snapshot":
        """The newest picture of everything."""

    def command(self, name: str, argument: str = "") -> None:
        """Hand a command to the procedure."""

    def collected(self) -> "Collected":
        """What has been measured so far."""

    def set_setup(self, setup: "StreamSetup") -> None:
        """Read the stream in this way from its first byte on."""


@runtime_checkable
class Hand(Protocol):
    """The virtual hand that moves the virtual device."""

    following: bool
    """Whether it does everything by itself."""

    @property
    def trembling(self) -> bool:
        """Whether the device is held and not laid down."""

    def turn(self, axis: str, degrees: float) -> None:
        """Turn the device about one of its axes."""

    def snap_to(self, target: str) -> None:
        """Bring a pose on top."""

    def tremble(self, on: bool) -> None:
        """Hold the device in the hand, or lay it down."""

    def pass_steel(self) -> None:
        """Let something of steel pass by: the field is disturbed for a moment."""


class SourceKind(StrEnum):
    """Where samples can come from."""

    VIRTUAL = "virtual"
    PORT = "port"
    FILE = "file"
    SESSION = "session"


@dataclass(frozen=True)
class SourceChoice:
    """What the operator chose to read from.

    Attributes:
        kind: a virtual device, a port or URL, a recording, an earlier session.
        target: device name, URL or path; "" for the virtual device.
        title: in words.
        detail: one more line in words.
    """

    kind: SourceKind
    target: str = ""
    title: str = ""
    detail: str = ""


@dataclass(frozen=True)
class Saved:
    """Where a calibration was written, and what to say of it when the app has closed."""

    path: Path
    says: tuple[str, ...] = ()


def _none() -> Sequence[SourceChoice]:
    return ()


def _benches(report: "FitReport", before: "Benches | None") -> "Benches":
    from imucal_wizard.bench.benches import Benches

    return Benches(report, before=before)


def _nobody() -> None:
    """Nobody waits to be told."""


@dataclass(frozen=True)
class Services:
    """Everything the app cannot do itself, given to it, so that tests give something simpler.

    Attributes:
        open_source: makes the source chosen; not started yet. Runs in a thread.
        fit: fits what was collected. Runs in a thread.
        save: writes the result, with the effects that the bench has added. Runs in a thread.
        ports: what is plugged in. Runs in a thread.
        earlier: sessions that can be taken up again, newest first. Runs in a thread.
        compare: fits by every method of every sensor. Runs in a thread.
        benches: makes the benches of a fit, with the models of the benches before, if there were
            any. Runs in a thread.
        loaded: told once when everything that the app will need has been imported.
    """

    open_source: Callable[[SourceChoice], Source]
    fit: "Callable[[Collected, Snapshot], FitReport]"
    save: "Callable[[FitReport, Benches | None], Saved]"
    compare: "Callable[[FitReport, Collected, Snapshot], Sequence[MethodRow]]"
    ports: Callable[[], Sequence[SourceChoice]] = _none
    earlier: Callable[[], Sequence[SourceChoice]] = _none
    benches: "Callable[[FitReport, Benches | None], Benches]" = _benches
    loaded: Callable[[], None] = _nobody
