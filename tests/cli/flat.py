"""A recording that carries nothing."""

from pathlib import Path

import numpy as np


def flat_recording(folder: Path) -> Path:
    """Ten seconds flat on a table are one still position."""
    time = np.arange(0.0, 10.0, 0.01)
    rng = np.random.default_rng(0)
    rows = np.column_stack([time, rng.normal((0.0, 0.0, 9.8), 0.01, (len(time), 3))])
    path = folder / "flat.csv"
    np.savetxt(path, rows, delimiter=",", header="t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]", comments="")
    return path
