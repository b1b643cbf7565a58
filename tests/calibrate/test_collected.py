"""What the wizard collected is fitted as a recording is, and its validation is held apart."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.recording import fit_collected
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.measurement.holds import Collected


def test_what_the_wizard_collected_is_fitted_like_the_recording(plain: FitReport) -> None:
    """The same holds and rotations by the other door give the same numbers to the last bit."""
    bare = [replace(hold, pose=None) for hold in plain.holds]
    places = {hold.start: index for index, hold in enumerate(plain.holds)}
    rotations = [
        replace(one, before=bare[places[one.before.start]], after=bare[places[one.after.start]])
        for one in plain.rotations
    ]
    units = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}
    report = fit_collected(Collected(tuple(bare), tuple(rotations)), units, 100.0)
    for name, fit in report.sensors.items():
        assert (fit.matrix == plain.sensors[name].matrix).all()
        assert fit.parameters == plain.sensors[name].parameters


def test_a_rotation_whose_hold_was_taken_back_is_not_used(plain: FitReport) -> None:
    """After an undo a rotation may refer to a hold that is gone."""
    kept = tuple(plain.holds[:10] + plain.holds[11:])
    units = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}
    report = fit_collected(Collected(kept, plain.rotations), units, 100.0)
    lost = [one for one in report.rotations if one.problem]
    assert len(lost) == 2
    assert all("not kept" in (one.problem or "") for one in lost)


def test_validation_holds_are_judged_and_not_fitted(plain: FitReport) -> None:
    """Their error is the result's, not another fit's."""
    units = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}
    fitted, new = plain.holds[:34], plain.holds[34:]
    rotations = tuple(one for one in plain.rotations if one.after.start < new[0].start)
    report = fit_collected(Collected(fitted, rotations, validation=new), units, 100.0)
    fit = report.sensors["accelerometer"]
    means = np.array([hold.accelerometer for hold in new])
    errors = np.linalg.norm((means - fit.bias) @ fit.matrix.T, axis=1) - STANDARD_GRAVITY
    assert fit.validation_rms == pytest.approx(float(np.sqrt(np.mean(errors**2))), rel=1e-12)
    assert fit.validation == pytest.approx(errors, rel=1e-9)
    assert len(fit.residuals) == 34
