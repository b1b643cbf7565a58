"""A gyroscope that a rate table has calibrated is checked on a rate table."""

import json
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path

import msgspec
import numpy as np
import pytest

from benchmarks.q_cases import BNO055
from benchmarks.rate_table import table_recording
from imucal_wizard.core.errors import RecordingError, UsageError
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.recording import FitOptions, fit_readings
from imucal_wizard.estimate.table_steps import KnownRates
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.terms import Term
from imucal_wizard.report.calibrated_device import (
    CalibratedDevice,
    RecheckSettings,
    recheck_readings,
)
from imucal_wizard.report.calibration_file import Calibration, read_calibration
from imucal_wizard.report.calibration_record import from_report
from imucal_wizard.report.proof import Proof, own
from tests.report.devices import calibration

RATES_DEG = (60.0, 150.0)
RATES = KnownRates(tuple(np.radians(RATES_DEG).tolist()))
NOW = datetime(2026, 2, 1, tzinfo=UTC)
SETTINGS = RecheckSettings(NOW, table=RATES)


def recorded(seed: int, *, scale: float = 1.0, bias: float = 0.0) -> Readings:
    """The gyroscope on the table, its y axis changed."""
    series = table_recording(BNO055, seed, RATES_DEG, 4.0, white=True)[0].gyroscope
    assert series is not None
    changed = series.values * [1.0, scale, 1.0] + [0.0, bias, 0.0]
    none = Series(np.zeros(0), np.zeros((0, 3)), "m/s^2")
    return Readings(none, replace(series, values=changed))


@pytest.fixture(scope="module")
def calibrated() -> Calibration:
    """By the table alone."""
    report = fit_readings(recorded(5), FitOptions(rates=RATES.rates))
    return from_report(report, "a table", "2026-01-01T00:00:00+00:00")


def test_the_file_alone_gives_the_errors_of_a_table_with_a_drift(tmp_path: Path) -> None:
    """Time counts from the first sample, as in the fit, and the temperature is kept."""
    readings = recorded(5)
    assert readings.gyroscope is not None
    time = readings.gyroscope.time
    felt = np.radians(0.05) * (time - time[0])[:, None] / 60.0 * [1.0, 0.0, 0.0]
    warm = Series(time, (20.0 + time / 60.0)[:, None], "degC")
    drifting = replace(readings.gyroscope, values=readings.gyroscope.values + felt)
    readings = replace(readings, gyroscope=drifting, temperature=warm)
    report = fit_readings(readings, FitOptions(rates=RATES.rates))
    experiment = report.sensors["gyroscope"].experiment
    assert experiment is not None
    for name in ("bias-drift", "bias-temperature"):
        found = fit(experiment, (Term(effect(name)),))
        sensors = {**report.sensors, "gyroscope": found}
        made = from_report(replace(report, sensors=sensors), "a table", "2026-01-01")
        made = read_calibration(made.save(tmp_path / "c.json", force=True))
        error = Proof(made).errors(own(made), frame=False)["gyroscope"]
        assert error == pytest.approx(found.rms_fitted, rel=1e-6)
        # a file of an earlier version is still read, unless nothing tells what its effect means
        bare = [
            msgspec.structs.replace(one, time=None, temperature=None) for one in made.table_means
        ]
        saved = msgspec.structs.replace(made, table_means=bare).save(
            tmp_path / "o.json", force=True
        )
        if name == "bias-drift":
            assert read_calibration(saved).table_means == bare
        else:
            with pytest.raises(RecordingError, match=r"earlier version.* Fit the recording again"):
                read_calibration(saved)


@pytest.mark.parametrize(
    ("scale", "bias", "verdict", "moved"),
    [
        (1.0, 0.0, "go", None),
        (1.01, 0.0, "no-go", "sensitivity_y"),
        (1.0, np.radians(0.5), "no-go", "bias_y"),
    ],
)
def test_a_change_is_seen_in_another_recording_of_the_table(
    calibrated: Calibration, scale: float, bias: float, verdict: str, moved: str | None
) -> None:
    """Other mountings and other noise."""
    found = recheck_readings(
        CalibratedDevice(calibrated, SETTINGS), recorded(6, scale=scale, bias=bias)
    )
    assert found.verdict == verdict
    gyroscope = found.sensors["gyroscope"]
    assert min(one.power for one in gyroscope.seen) > 0.99
    assert [one.parameter for one in gyroscope.moved[:1]] == [moved] * (moved is not None)


@pytest.mark.parametrize(
    ("key", "value", "says"),
    [
        ("covariance", [[1.0, 0.0], [0.0, 1.0]], "does not have a valid covariance"),
        ("scatter", [1.0, 1.0], "does not have three variances"),
        ("seconds", [], "not one duration for each reading"),
    ],
)
def test_an_edited_step_of_the_table_is_refused(
    calibrated: Calibration, key: str, value: object, says: str, tmp_path: Path
) -> None:
    path = calibrated.save(tmp_path / "my.json")
    assert read_calibration(path).table_means
    loose = json.loads(path.read_text())
    loose["table_means"][1][key] = value
    path.write_text(json.dumps(loose))
    with pytest.raises(RecordingError, match=says):
        read_calibration(path)


def test_what_gravity_and_what_the_table_cannot_show_is_refused(
    calibrated: Calibration,
) -> None:
    with pytest.raises(UsageError, match="record it on the table"):
        CalibratedDevice(calibrated, RecheckSettings(NOW))
    with pytest.raises(UsageError, match="by holds and rotations"):
        CalibratedDevice(calibration(turns=6), SETTINGS)
