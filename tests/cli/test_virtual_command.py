"""``imucal-wizard virtual``: a second process that speaks on a real port."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from imucal_wizard.acquire.transport import Transport
from imucal_wizard.cli.main import main
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.reader import Pump, Reader
from tests.waiting import PATIENCE, received, wait_for

pytestmark = pytest.mark.skipif(not hasattr(os, "openpty"), reason="no pseudo-terminals here")


@contextmanager
def _virtual(*options: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """The command and the path that it prints."""
    pipe = subprocess.PIPE
    command = [sys.executable, "-m", "imucal_wizard", "virtual", *options]
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as process:
        try:
            assert process.stdout is not None
            yield process, process.stdout.readline().strip()
        finally:
            process.kill()


def _type(process: subprocess.Popen[str], line: str) -> None:
    assert process.stdin is not None
    process.stdin.write(line + "\n")
    process.stdin.flush()


def test_the_same_seed_gives_the_same_bytes_on_the_port() -> None:
    runs = []
    for _ in range(2):
        with _virtual("--seed", "4", "--speed", "50", "--magnetometer") as (_, path):
            transport = Transport(path)
            transport.open()
            runs.append(received(transport.read, 20_000)[:20_000])
            transport.close()
    assert runs[0] == runs[1]
    assert runs[0].startswith(b"t[s],ax[m/s^2]")
    assert b"mx[uT]" in runs[0].splitlines()[0]


def test_a_wizard_on_the_port_sees_the_poses_that_are_typed_in_the_other_terminal() -> None:
    with _virtual("--seed", "4", "--speed", "20") as (process, path):
        reader = Reader(Pump(Transport(path)), Engine())
        reader.start()
        try:
            for pose, axis, sign in (("-x", 0, -1.0), ("+y", 1, 1.0)):
                _type(process, pose)
                wait_for(
                    lambda axis=axis, sign=sign: (  # type: ignore[misc]  # bound to this round
                        (reader.snapshot().status.up or (0.0, 0.0, 0.0))[axis] * sign > 0.99
                    )
                )
            stream = reader.snapshot().stream
            assert (stream.lost, stream.malformed) == (0, 0)
        finally:
            reader.stop()
        _type(process, "quit")
        assert process.wait(PATIENCE) == 0


def test_a_line_that_is_not_understood_is_named_and_changes_nothing() -> None:
    with _virtual() as (process, _):
        assert process.stderr is not None
        for line, says in (
            ("jump high", "jump high"),
            ("rest inf", "a rest of inf s is impossible"),
            ("turn x nan", "a turn of nan° is impossible"),
        ):
            _type(process, line)
            assert says in process.stderr.readline()
        _type(process, "quit")
        assert process.wait(PATIENCE) == 0


@pytest.mark.parametrize("reading", [False, True])
def test_ctrl_c_ends_it_cleanly(reading: bool) -> None:
    with _virtual() as (process, path):
        transport = Transport(path)
        if reading:
            transport.open()
            received(transport.read, 100)
        process.send_signal(signal.SIGINT)
        process.send_signal(signal.SIGINT)  # an impatient operator
        assert process.stderr is not None
        assert process.stderr.read() == ""
        assert process.wait(PATIENCE) == 0
        transport.close()


def test_an_effect_that_does_not_exist_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["virtual", "--hidden", "wobble:1:x"]) == 2
    assert "wobble" in capsys.readouterr().err
