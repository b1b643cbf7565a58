"""Sessions of the wizard with an operator who takes things back, skips and validates."""

import functools
import tempfile
from collections.abc import Mapping
from pathlib import Path

from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import Procedure, standard
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.session_replay import begin_session
from imucal_wizard.sessions import SessionInfo
from imucal_wizard.sessions.catalogue import Catalogue
from imucal_wizard.simulate.recording import simulate_recording

Orders = Mapping[float, tuple[str, ...]]
"""What is ordered when this share of the recording has arrived; ``goto result`` is one order."""
ARRIVING = 8000.0
"""Bytes per second."""


@functools.cache
def printed() -> bytes:
    """What the device printed: a rest, 18 poses, a turn about each axis."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.csv"
        simulate_recording(path, rate=25.0, rotations=1, hold=3.0)
        return path.read_bytes()


def listed(folder: Path) -> list[SessionInfo]:
    """The sessions of a folder, newest first."""
    with Catalogue(folder) as catalogue:
        return catalogue.sessions()


def procedure() -> Procedure:
    """Settle, 18 poses, rotations, result, validation: what is printed serves all of it."""
    whole = standard(1, settle_seconds=5.0)
    steps = tuple(step for step in whole.steps if step.kind is not StepKind.UP_DOWN)
    return Procedure(steps)


def sat(
    path: Path,
    orders: Orders | None = None,
    *,
    share: float = 1.0,
    start: bool = True,
    gravity: float = STANDARD_GRAVITY,
    setup: StreamSetup | None = None,
    data: bytes | None = None,
) -> Engine:
    """A sitting, as far as a share of the recording; the engine as it was left, session closed."""
    due = tuple(sorted((orders or {}).items()))
    engine, file = _sitting(due, share, start, gravity, setup, data)
    path.write_bytes(file)
    return engine


@functools.cache
def _sitting(
    orders: tuple[tuple[float, tuple[str, ...]], ...],
    share: float,
    start: bool,
    gravity: float,
    setup: StreamSetup | None,
    data: bytes | None,
) -> tuple[Engine, bytes]:
    """The engine, and the session's file."""
    data = printed() if data is None else data
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.imucal"
        engine = begin_session(path, setup, ProcedureSettings(procedure(), gravity))
        if start:
            engine.command("start")
        due, size, end = list(orders), 2000, int(share * len(data))
        for first in range(0, end, size):
            while due and due[0][0] * len(data) <= first:
                for order in due.pop(0)[1]:
                    engine.command(*order.split(" ", 1))
            engine.receive(data[first : min(first + size, end)], first / ARRIVING)
        engine.close()
        return engine, path.read_bytes()
