"""What is said of a gyroscope that shows how the Earth turns."""

import numpy as np

from benchmarks.gyroscope_bound import DEVICES, GRAVITY, RATE, Session, fitted
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import entries_of
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.survey import diagnose_benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.estimate.result import FitReport

QUIET = next(one for one in DEVICES if "18 poses, 0.002" in one.name)


def test_the_earth_leaves_the_model_complete_and_is_told() -> None:
    """It is no suspect: every fit allows for it, and the error contains it."""
    holds, rotations = Session(QUIET, 3).recorded(np.random.default_rng(4))
    known = fit_accelerometer(holds, GRAVITY, "m/s^2")
    sensors = {"accelerometer": known, "gyroscope": fitted(holds, rotations, known)}
    rates = dict.fromkeys(sensors, RATE)
    report = FitReport(STANDARD_GRAVITY, rates, tuple(holds), tuple(rotations), sensors)
    benches = Benches(report)
    said = diagnose_benches(benches, {}, automatic=False)[1]
    assert said.verdict is Verdict.COMPLETE
    assert "by which the Earth turns during the rotations; the fit allows for it." in said.says
    assert not said.found
    assert "earth-rate" not in {one.term for one in said.suspects}
    bench = said.bench
    assert bench is not None
    listed = {one.term: one.lacking for one in entries_of(bench, bench.look())}
    assert listed["earth-rate"] == "every fit of these data allows for it"
