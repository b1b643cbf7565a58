"""What the first screen waits for, and what waits for the first screen."""

import subprocess
import sys

HEAVY = ("numpy", "scipy", "serial", "sqlite3", "msgspec")


def test_nothing_heavy_is_imported_before_the_first_screen() -> None:
    names = "imucal_wizard.cli.wizard, imucal_wizard.tui.run, imucal_wizard.cli.main"
    code = f"import sys, {names}; print(*(m for m in {HEAVY} if m in sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, timeout=60
    )
    assert done.stdout.split() == []
