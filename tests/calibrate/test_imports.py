"""A fit starts as fast as NumPy does."""

import subprocess
import sys
from pathlib import Path

from imucal_wizard.simulate.recording import simulate_recording

HEAVY = ("scipy", "textual", "serial", "rich", "msgspec", "sqlite3", "numpy.ma")
"""Modules that take longer to import than a recording takes to fit, or nearly so."""


def test_a_fit_needs_numpy_and_nothing_heavier(tmp_path: Path) -> None:
    """Fit and verdict of a text recording; medians and sorted values would import numpy.ma."""
    path = tmp_path / "recording.csv"
    simulate_recording(path, seed=1)
    code = (
        "import sys; from imucal_wizard.cli.main import main; "
        f"main(['fit', {str(path)!r}]); "
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stdout.splitlines()[-1] == "[]"
