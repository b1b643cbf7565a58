"""A keyboard that is dead from the first pose on: nothing needs it, and every refusal rings."""

import sqlite3
import subprocess
from contextlib import closing
from pathlib import Path

import pytest

from imucal_wizard.core.poses import EDGES, FACES
from imucal_wizard.guide.kinds import EventKind
from imucal_wizard.guide.state import Event
from imucal_wizard.tui.sounds import Sounds
from tests.terminal.terminal import Terminal, program

SPEED = 40
REFUSALS = {
    EventKind.HOLD_BROKEN,
    EventKind.ALREADY_DONE,
    EventKind.WRONG_POSE,
    EventKind.ROTATION_REJECTED,
}
BELLS = 2
"""Bells of a refusal at least."""
WITHIN = 3.0
"""Seconds after a refusal in which they ring."""
STARTS = {"x": "+z", "y": "+z", "z": "+x"}
"""A pose in which an axis is level."""


def measured_by_hand() -> list[str]:
    """Lines for the device: all poses and rotations, and on the way one mistake of each kind."""
    lines = ["rest 14"]
    for face in FACES:
        lines += [face, "rest 5"]
        if face == "-x":  # the same once more; an edge; a rest that is too short
            lines += ["turn x 20", "+x", "rest 5", "+x+y", "rest 5", "-z", "rest 0.8"]
    for pose in (*FACES, *EDGES):
        lines += [pose, "rest 5"]
    for axis, start in STARTS.items():
        lines += [start, "rest 5", f"turn {axis} 25", "rest 5"]  # too small an angle
        for degrees in (250, -250):
            lines += [start, "rest 5", f"turn {axis} {degrees}", "rest 5"]
    return lines


def events(session: Path) -> list[Event]:
    """The events of a session, in order."""
    with closing(sqlite3.connect(session)) as connection:
        rows = connection.execute("SELECT time, kind, text FROM event ORDER BY id").fetchall()
    return [Event(EventKind(kind), time, text) for time, kind, text in rows]


def rung(heard: list[Event]) -> list[float]:
    """When the bell rings if the events come at their own times, s."""
    now, bells, later = [0.0], list[float](), list[tuple[float, object]]()
    sounds = Sounds(
        lambda: bells.append(now[0]),
        lambda seconds, again: later.append((now[0] + seconds, again)),
        lambda: now[0],
    )

    def until(time: float) -> None:
        while due := [one for one in later if one[0] <= time]:
            first = min(due, key=lambda one: one[0])
            later.remove(first)
            now[0] = first[0]
            assert callable(first[1])
            first[1]()
        now[0] = time

    for event in heard:
        until(event.time)
        sounds.hear([event])
    until(now[0] + WITHIN)
    return bells


@pytest.mark.study
def test_from_the_first_pose_to_the_verdict_no_key_is_needed_and_every_refusal_rings(
    tmp_path: Path,
) -> None:
    pipe = subprocess.PIPE
    device = program("virtual", "--seed", "4", "--speed", str(SPEED))
    with subprocess.Popen(device, stdin=pipe, stdout=pipe, text=True) as virtual:
        assert virtual.stdin is not None
        assert virtual.stdout is not None
        port = virtual.stdout.readline().strip()
        command = program("--port", port, "--rotations", "1", "--sessions", str(tmp_path))
        with Terminal(command) as terminal:
            terminal.wait_for("is this what you expect")
            terminal.press("\r")
            terminal.dead = True
            # at this speed a busy machine may show no screen of the first step
            terminal.wait_for(lambda text: "▸SETTLE" in text or "▸UP/DOWN" in text)
            print(*measured_by_hand(), sep="\n", file=virtual.stdin, flush=True)
            terminal.wait_for("▸RESULT", 60.0)
            bells = terminal.bells
            terminal.wait_for("limit 2.0 mg", 60.0)
            terminal.wait_for(lambda _: terminal.bells > bells)  # the verdict
        print("quit", file=virtual.stdin, flush=True)
    (session,) = tmp_path.glob("*.imucal")
    heard = events(session)
    refused = [event for event in heard if event.kind in REFUSALS]
    assert {event.kind for event in refused} == REFUSALS
    bells_at = rung(heard)
    for event in refused:
        after = [at for at in bells_at if event.time <= at < event.time + WITHIN]
        assert len(after) >= BELLS, event
    assert terminal.bells > BELLS * len(refused)
