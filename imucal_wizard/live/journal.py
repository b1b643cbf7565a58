"""What the engine writes down, and what it says when that is no longer possible."""

import json
from collections.abc import Callable, Sequence

from imucal_wizard.devices.setup import StreamSetup
from imucal_wizard.errors import SessionError
from imucal_wizard.procedure.state import Collected, Event
from imucal_wizard.sessions import Session

SETUP = "setup"
"""The command by which a changed setup of the stream is written down."""


class Journal:
    """Writes to a session; a full disk stops the writing and never the measuring.

    Attributes:
        problem: why nothing is written any more, and what to do; "" while all is well.
    """

    def __init__(self, session: Session | None = None) -> None:
        self._session = session
        self._step = ""
        self.problem = ""

    def raw(self, arrival: float, data: bytes) -> None:
        """Bytes, before anything is made of them."""
        self._do(lambda session: session.write_raw(arrival, data))

    def command(self, sample_index: int, name: str, argument: str) -> None:
        """A command, before it is obeyed."""
        self._do(lambda session: session.write_command(sample_index, name, argument))

    def new_setup(self, sample_index: int, setup: StreamSetup) -> None:
        """Another way of reading the stream, before it is used."""
        self.command(sample_index, SETUP, json.dumps(setup.to_json()))

    def resolved(self, setup: StreamSetup) -> None:
        """How the stream is read now that everything about it is known."""
        self._do(lambda session: session.set_meta("setup", setup.to_json()))

    def found(self, collected: Collected, events: Sequence[Event]) -> None:
        """Finished holds and rotations, and what happened."""
        self._do(lambda session: session.write_findings(collected))
        self._do(lambda session: session.write_events(events))

    def step(self, step: str) -> None:
        """The step reached, when it has changed."""
        if step != self._step:
            self._step = step
            self._do(lambda session: session.set_meta("step", step))

    def idle(self) -> None:
        """Nothing came: bring what is written to the disk when it is time."""
        self._do(lambda session: session.commit_when_due())

    def close(self) -> None:
        """Let go of the file."""
        session, self._session = self._session, None
        if session is not None:
            try:
                session.close()
            except SessionError as error:
                self.problem = str(error)

    def _do(self, write: Callable[[Session], None]) -> None:
        if self._session is None:
            return
        try:
            write(self._session)
        except SessionError as error:
            self.problem = f"nothing more is written down: {error}"
            self._session = None
