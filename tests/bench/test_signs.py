"""The size that a suspect is said to have is the size that it has once it is added."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.bench.session import Bench
from imucal_wizard.devices.virtual.simulate import simulate_recording
from imucal_wizard.fitting import fit_readings
from imucal_wizard.recordings import RecordingOptions, read
from imucal_wizard.solver.extended.fit import measured_accelerometer


@pytest.mark.parametrize(("hidden", "place"), [("second-order:4:x", 0), ("third-order:-5:y", 1)])
def test_a_suspect_has_the_sign_and_size_of_the_term_added(
    hidden: str, place: int, tmp_path: Path
) -> None:
    path = tmp_path / "recording.csv"
    simulate_recording(path, hidden=[hidden], seed=12, poses="26")
    readings = read([path], RecordingOptions())
    bench = Bench("accelerometer", measured_accelerometer(fit_readings(readings), readings))
    term, size, _ = hidden.split(":")
    suspect = next(one for one in bench.look().suspects if one.term == term)
    assert suspect.trial is not None
    bench.add(term)
    added = bench.fit.sizes[0]
    assert np.sign(added[place]) == np.sign(float(size))
    np.testing.assert_allclose(
        suspect.trial.size[place], added[place], atol=3 * suspect.trial.standard_error[place]
    )
