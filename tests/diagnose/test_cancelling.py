"""Effects that undo one another are not named: the shape that they make together is told."""

from dataclasses import replace

import numpy as np

from benchmarks.hand_motion import Device, placed, recorded
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.survey import diagnose_benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.recording import fit_readings


def test_a_bow_in_time_is_no_drift_beside_a_warm_up() -> None:
    """Both of some hundred mg made a bow of 2.5 mg, and each was called missing."""
    rng, device = np.random.default_rng(25_982), Device(noise=0.14)
    motion = placed(device, rng, hold=4.0, turns=4)
    bow = 0.1 * (motion.time / motion.time[-1] - 0.5) ** 2
    force = motion.force + np.outer(bow, [0.0, 1.0, 0.0])
    readings = recorded(replace(motion, force=force), device, rng)
    benches = Benches(fit_readings(readings), readings)
    first = diagnose_benches(benches, {}, automatic=True)[0]
    assert first.verdict is not Verdict.COMPLETE
    assert not first.opinion.terms
    assert "follows the time" in first.says
