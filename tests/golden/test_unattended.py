"""The unattended run saves the recorded calibration."""

import json
import os
import sys
from pathlib import Path

import pytest

from tests.golden.cases import EXPECTED
from tests.golden.figures import differences, figures

ARGUMENTS = ["--auto", "--speed", "1000", "--quit", "--mute", "--seed", "3", "--rotations", "2"]


@pytest.mark.study
@pytest.mark.skipif(not hasattr(os, "openpty"), reason="needs pseudo-terminals")
def test_the_unattended_run_saves_the_recorded_calibration(tmp_path: Path) -> None:
    from tests.terminal.terminal import Terminal

    place = tmp_path / "calibration.json"
    command = [sys.executable, "-m", "imucal_wizard", *ARGUMENTS]
    command += ["--sessions", str(tmp_path / "sessions"), "--save", str(place)]
    with Terminal(command) as terminal:
        while terminal.status() is None:
            terminal.pump(0.1)
        assert terminal.wait() == 0
    expected = json.loads((EXPECTED / "unattended.json").read_text())
    found = figures(json.loads(place.read_text()))
    assert not differences(expected, found), "\n" + "\n".join(differences(expected, found))
