"""What is said of a gyroscope that shows how the Earth turns."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.gyroscope_bound import DEVICES, GRAVITY, RATE, Session, WrongRate, fitted
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.bench import entries_of
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.survey import diagnose_benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.estimate.result import FitReport

pytestmark = pytest.mark.usefixtures("no_sizes_throughout")

QUIET = next(one for one in DEVICES if "18 poses, 0.002" in one.name)


class Creeping(Session):
    """A device that something turns about a direction of the room, like the Earth but faster."""

    times = 8.0

    def _earth(self, rng: np.random.Generator) -> tuple[FloatArray, list[FloatArray]]:
        still, turning = super()._earth(rng)
        return self.times * still, [self.times * one for one in turning]


class Pulled(WrongRate):
    """A g-sensitivity, rad/s per g: gravity along each axis changes the rate of all."""

    each = np.radians(0.02) * np.array([[0.7, -0.9, 0.4], [1.1, 0.5, -0.8], [-0.6, 1.0, 0.9]])

    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """See ``WrongRate``."""
        del time, rate
        return np.asarray(up @ self.each.T)


def diagnosed(session: Session, wrong: WrongRate | None = None) -> Diagnosis:
    """What is said of the gyroscope."""
    holds, rotations = session.recorded(np.random.default_rng(4), wrong)
    known = fit_accelerometer(holds, GRAVITY, "m/s^2")
    sensors = {"accelerometer": known, "gyroscope": fitted(holds, rotations, known)}
    rates = dict.fromkeys(sensors, RATE)
    report = FitReport(STANDARD_GRAVITY, rates, tuple(holds), tuple(rotations), sensors)
    return diagnose_benches(Benches(report), {}, automatic=False)[1]


def test_what_turns_the_device_faster_than_the_earth_is_not_the_earth() -> None:
    assert "Earth" not in diagnosed(Creeping(QUIET, 3)).says


def test_the_earth_leaves_the_model_complete_and_is_told() -> None:
    """It is no suspect: every fit allows for it, and the error contains it."""
    said = diagnosed(Session(QUIET, 3))
    assert said.verdict is Verdict.COMPLETE
    assert "by which the Earth turns during the rotations; the fit allows for it." in said.says
    assert not said.found
    assert "earth-rate" not in {one.term for one in said.suspects}
    bench = said.bench
    assert bench is not None
    listed = {one.term: one.lacking for one in entries_of(bench, bench.look())}
    assert listed["earth-rate"] == "every fit of these data allows for it"


def test_a_gyroscope_in_coarse_steps_reads_the_earth_wrongly_and_that_is_no_effect() -> None:
    """Inside a step it reads nothing of the Earth's rate, and at the edge of one several times it.

    Rests that differ by more than their noise are no sign of an effect that follows gravity.
    """
    coarse = replace(QUIET, rate=(0.03, 0.03, 0.03), step=0.25)
    said = [diagnosed(Session(coarse, seed)) for seed in range(3, 6)]
    assert [one.verdict for one in said] == [Verdict.COMPLETE] * len(said)


@pytest.mark.parametrize("steps", [16.0, 32.0])
def test_steps_of_many_times_the_noise_are_no_pattern(steps: float) -> None:
    """Rests that all read one number show no noise, and say nothing of that of the rotations."""
    coarse = replace(QUIET, rate=(0.03, 0.03, 0.03), step=0.03 * steps, earth=False)
    said = [diagnosed(Session(coarse, seed)) for seed in range(9, 11)]
    assert [one.verdict for one in said] == [Verdict.COMPLETE] * len(said)


@pytest.mark.parametrize("step", [0.04, 0.12])
def test_a_g_sensitivity_of_less_than_a_step_is_found_in_the_rotations(step: float) -> None:
    """At rest the steps hide it, or show it several times too large; in motion they average out."""
    coarse = replace(QUIET, rate=3 * (step / 4.0,), step=step)
    said = diagnosed(Session(coarse, 3), Pulled())
    assert said.verdict is Verdict.MISSING
    assert said.explanations[0] == ("g-sensitivity",)
