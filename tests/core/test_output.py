"""What commands write to a terminal."""

import io
import os

import pytest

from imucal_wizard.core.output import note

TEXT = "imucal-wizard: the port /dev/serial/by-id/usb-a-long-name-00 cannot be opened\nnext line"


class Terminal(io.StringIO):
    """A terminal of 30 columns."""

    def isatty(self) -> bool:
        """Yes."""
        return True

    def fileno(self) -> int:
        """Any."""
        return 2


def test_a_terminal_breaks_messages_between_words(monkeypatch: pytest.MonkeyPatch) -> None:
    """A word that is longer than a line stays whole, so that it can be copied."""
    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    monkeypatch.setattr(os, "get_terminal_size", lambda _: os.terminal_size((30, 24)))
    note(TEXT)
    rows = terminal.getvalue().splitlines()
    assert rows == [
        "imucal-wizard: the port",
        "/dev/serial/by-id/usb-a-long-name-00",
        "cannot be opened",
        "next line",
    ]


def test_a_file_or_pipe_gets_each_message_on_its_line(capsys: pytest.CaptureFixture[str]) -> None:
    note(TEXT)
    assert capsys.readouterr().err == TEXT + "\n"
