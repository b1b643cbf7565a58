"""A fit starts as fast as NumPy does."""

import subprocess
import sys
from pathlib import Path

from imucal_wizard.simulate.recording import simulate_recording

HEAVY = (
    *("scipy", "textual", "serial", "rich", "msgspec", "sqlite3"),
    *("numpy.ma", "numpy.random"),
)
"""Modules that take longer to import than a recording takes to fit, or nearly so."""
BENCH = "imucal_wizard.diagnose.bench"
PER_COUNT = {"a": 1e-3, "g": 1e-4}


def in_counts(path: Path) -> None:
    """Write the readings of a recording as counts, with an offset as unsigned ones have it."""
    head, *lines = [line for line in path.read_text().splitlines() if not line.startswith("#")]
    fields = head.split(",")
    sizes = [PER_COUNT.get(field[0]) for field in fields]
    written = [",".join(f"{one[:2]}[count]" if one[0] in PER_COUNT else one for one in fields)]
    for line in lines:
        each = zip(line.split(","), sizes, strict=True)
        written.append(
            ",".join(v if q is None else str(32768 + round(float(v) / q)) for v, q in each)
        )
    path.write_text("\n".join(written) + "\n")


def test_a_fit_needs_numpy_and_nothing_heavier(tmp_path: Path) -> None:
    """Of text recordings, one in counts; medians and sorted values would import numpy.ma.

    Without a verdict it needs no bench either.
    """
    path, field = tmp_path / "recording.csv", tmp_path / "field.csv"
    simulate_recording(path, seed=1)
    in_counts(path)
    simulate_recording(field, seed=2, rate=25.0, poses="8", magnetometer=True)
    code = (
        "import sys; from imucal_wizard.cli.main import main; "
        f"main(['fit', {str(field)!r}, '--no-verdict']); "
        f"main(['fit', {str(path)!r}, '--no-verdict']); print({BENCH!r} in sys.modules); "
        f"main(['fit', {str(path)!r}]); print({BENCH!r} in sys.modules); "
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    lines = result.stdout.splitlines()
    assert lines[-1] == "[]"
    assert [one for one in lines if one in ("True", "False")] == ["False", "True"]
