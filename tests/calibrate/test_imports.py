"""A fit starts as fast as NumPy does."""

import subprocess
import sys


def test_a_fit_needs_numpy_and_nothing_heavier() -> None:
    """SciPy's optimisers alone take longer to import than a whole recording takes to fit."""
    code = (
        "import sys, imucal_wizard.estimate.recording, imucal_wizard.estimate.gauge; "
        "print([name for name in sys.modules if name in ('scipy', 'textual', 'serial', 'rich')])"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == "[]"
