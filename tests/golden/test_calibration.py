"""A calibration file with an effect, saved by an earlier version, still reads and corrects."""

import json

import numpy as np
import pytest

from imucal_wizard.api import load
from tests.golden.cases import DATA, EXPECTED


@pytest.mark.parametrize("sensor", ["accelerometer", "gyroscope"])
def test_an_earlier_calibration_file_corrects_readings_as_it_did(sensor: str) -> None:
    expected = json.loads((EXPECTED / "calibration.json").read_text())[sensor]
    saved = load(DATA / "calibration.json").sensors[sensor]
    corrected = saved.apply(np.array(expected["readings"]))
    np.testing.assert_allclose(corrected, expected["corrected"], rtol=1e-8, atol=1e-8)
