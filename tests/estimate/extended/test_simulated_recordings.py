"""Effects hidden by the simulator, from the recording's file to the fit."""

from pathlib import Path

import numpy as np

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.terms import Term
from imucal_wizard.simulate.recording import simulate_recording
from tests.estimate.extended.turns import still_rms


def test_a_hidden_g_sensitivity_is_found_and_explains_the_closure(tmp_path: Path) -> None:
    """Its coefficient within the standard errors, the others zero within theirs."""
    path = tmp_path / "hidden.csv"
    simulate_recording(path, hidden=["gyroscope/g-sensitivity:0.15:xy"], seed=5, rate=50.0)
    readings = read_files([path])
    report = fit_readings(readings)
    gyroscope = report.sensors["gyroscope"].experiment
    assert gyroscope is not None
    plain, found = (
        fit(gyroscope),
        fit(gyroscope, (Term(effect("g-sensitivity")),)),
    )
    truth = np.zeros(9)
    truth[1] = 0.15
    assert (np.abs(found.sizes[0] - truth) < 4.0 * found.size_errors[0]).all()
    assert found.sizes[0][1] > 10.0 * found.size_errors[0][1]
    assert found.rms_held_out is not None
    assert plain.rms_held_out is not None
    assert found.rms_held_out < 0.6 * plain.rms_held_out
    assert still_rms(found) < 0.5 * still_rms(plain)


def test_a_hidden_second_order_term_is_found_and_lowers_the_held_out_error(tmp_path: Path) -> None:
    """26 poses and repeats show 6 mg/g² on one axis."""
    path = tmp_path / "hidden.csv"
    simulate_recording(
        path,
        hidden=["second-order:6:y"],
        seed=3,
        rate=50.0,
        poses="26+repeats",
        rotations=0,
        hold=5.0,
    )
    readings = read_files([path])
    measured = fit_readings(readings).sensors["accelerometer"].experiment
    assert measured is not None
    plain, found = fit(measured), fit(measured, (Term(effect("second-order")),))
    assert (np.abs(found.sizes[0] - [0.0, 6.0, 0.0]) < 4.0 * found.size_errors[0]).all()
    assert found.sizes[0][1] > 6.0 * found.size_errors[0][1]
    assert found.rms_held_out is not None
    assert plain.rms_held_out is not None
    assert found.rms_held_out < 0.7 * plain.rms_held_out
