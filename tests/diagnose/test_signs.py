"""The size that a suspect is said to have is the size that it has once it is added."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.simulate.recording import simulate_recording


@pytest.mark.parametrize(("hidden", "place"), [("second-order:4:x", 0), ("third-order:-5:y", 1)])
def test_a_suspect_has_the_sign_and_size_of_the_term_added(
    hidden: str, place: int, tmp_path: Path
) -> None:
    path = tmp_path / "recording.csv"
    simulate_recording(path, hidden=[hidden], seed=12, poses="26")
    readings = read_files([path], RecordingOptions())
    measured = fit_readings(readings).sensors["accelerometer"].experiment
    assert measured is not None
    bench = Bench("accelerometer", measured)
    term, size, _ = hidden.split(":")
    suspect = next(one for one in bench.look().suspects if one.term == term)
    assert suspect.trial is not None
    bench.add(term)
    added = bench.fit.sizes[0]
    assert np.sign(added[place]) == np.sign(float(size))
    np.testing.assert_allclose(
        suspect.trial.size[place], added[place], atol=3 * suspect.trial.standard_error[place]
    )
