"""Recordings made up for the tests, as a device would write them."""

from pathlib import Path

import numpy as np

from imucal_wizard.core.readings import FloatArray

HEADER = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s],temp[degC]"


def samples(count: int = 400, rate: float = 100.0, gravity: float = 9.80665) -> FloatArray:
    """Rows of time, specific force, angular rate and temperature of a device at rest, z up."""
    rng = np.random.default_rng(1)
    values = rng.normal(0.0, 0.003, (count, 8))
    values[:, 0] = np.arange(count) / rate
    values[:, 1:4] *= gravity / 9.80665
    values[:, 3] += gravity
    values[:, 7] = 25.0
    return values


def write(path: Path, values: FloatArray, header: str = HEADER, separator: str = ",") -> Path:
    """Write rows as text with six decimals, under a header unless it is empty."""
    lines = [separator.join(f"{value:.6f}" for value in row) for row in values]
    path.write_text("\n".join(([header] if header else []) + lines) + "\n", encoding="utf-8")
    return path


def written(tmp_path: Path, count: int = 400) -> tuple[Path, list[str]]:
    """A recording of a device at rest, and its lines."""
    path = write(tmp_path / "a.csv", samples(count))
    return path, path.read_text().splitlines()
