"""What the commands write for scripts, and recordings that they read."""

import json
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.cli import main as cli
from imucal_wizard.core.readings import Readings


def saved(readings: Readings, path: Path, rate_unit: str = "rad/s") -> Path:
    """A recording of both inertial sensors, and the magnetometer if there is one, as CSV.

    Args:
        readings: in m/s², rad/s and µT.
        path: where it is written.
        rate_unit: what the header says of the gyroscope.
    """
    units = (
        ("a", "m/s^2", readings.accelerometer),
        ("g", rate_unit, readings.gyroscope),
        ("m", "uT", readings.magnetometer),
    )
    found = [(name, unit, one.values) for name, unit, one in units if one is not None]
    names = [f"{name}{axis}[{unit}]" for name, unit, _ in found for axis in "xyz"]
    table = np.column_stack([readings.accelerometer.time, *(values for *_, values in found)])
    header = ",".join(["t[s]", *names])
    np.savetxt(path, table, fmt="%.7f", delimiter=",", header=header, comments="")
    return path


def fit_json(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, object]:
    """What ``fit --no-verdict --json -`` writes: one document, and exit status 0."""
    assert cli.main(["fit", *arguments, "--no-verdict", "--json", "-"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert isinstance(document, dict)
    return document
