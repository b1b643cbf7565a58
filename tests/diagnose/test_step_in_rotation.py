"""The moment of a step: of the gyroscope inside a rotation or a rest, of the accelerometer too."""

from dataclasses import replace

import numpy as np
import pytest

from imucal_wizard.core.notices import Notice, NoticeKind
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.grade import graded
from imucal_wizard.diagnose.survey import diagnosis_of
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.recording import fit_readings
from tests.diagnose.recordings import fitted

pytestmark = pytest.mark.usefixtures("no_sizes_throughout")


@pytest.mark.parametrize("resting", [0.0, 0.4])
def test_a_bias_that_steps_inside_a_rotation_or_a_rest_leaves_only_noise(resting: float) -> None:
    """The moment is fitted inside, not put half way between two holds."""
    report, readings = fitted(rotations=2)
    gyroscope, start = readings.gyroscope, readings.accelerometer.time[0]
    assert gyroscope is not None
    rotation = report.rotations[20]
    first, last = rotation.before.end - start, rotation.after.start - start
    moment = first + 0.9 * (last - first)
    if resting:
        moment = last + resting * (rotation.after.end - rotation.after.start)
    bias = np.outer(gyroscope.time - start >= moment, np.radians([0.3, 0.0, 0.0]))
    stepped = replace(readings, gyroscope=replace(gyroscope, values=gyroscope.values + bias))
    bench = Benches(fit_readings(stepped), stepped).bench("gyroscope")
    assert bench is not None
    found = bench.look()
    assert found.opinion.verdict is Verdict.MISSING
    assert found.suspects[0].term == "bias-step"
    bench.add("bias-step", near=0.5 * (first + last))
    (term,) = bench.fit.terms
    assert term.variant == pytest.approx(moment, abs=0.15)
    assert bench.fit.rms_fitted < 1.5 * (bench.fit.floor_fitted or 0.0)


def test_rotations_tell_when_the_accelerometer_steps_where_its_holds_do_not_feel_it() -> None:
    """A step of a level axis is in no magnitude of gravity, but it tilts the gyroscope's up."""
    report, readings = fitted(rotations=2)
    accelerometer, start = readings.accelerometer, readings.accelerometer.time[0]
    holds, axis = report.holds, 2
    level = [abs(hold.accelerometer[axis]) < 1.0 for hold in holds]
    row = next(k for k in range(10, len(holds) - 10) if level[k] and level[k + 1])
    step = np.where(np.arange(3) == axis, 0.03, 0.0)
    values = accelerometer.values + np.outer(accelerometer.time >= holds[row].start - 0.2, step)
    stepped = replace(readings, accelerometer=replace(accelerometer, values=values))
    bench = Benches(fit_readings(stepped), stepped).accelerometer
    bench.add("bias-step", near=holds[row + 1].end - start)
    (term,) = bench.fit.terms
    assert term.variant is not None
    assert holds[row - 1].end - start < term.variant < holds[row].end - start


def test_rests_that_are_left_out_make_no_complete_model() -> None:
    """What is left repeats; the rests that are left out say that the sensor does not."""
    report, readings = fitted(rotations=2)
    rests = "in 9 rests the gyroscope's mean is up to 9.0 °/s off: its bias jumped or drifted"
    notice = Notice(rests, NoticeKind.RESTS_LEFT_OUT, "gyroscope")
    told = replace(report, warnings=(*report.warnings, notice))
    benches = Benches(told, readings)
    bench = benches.bench("gyroscope")
    assert bench is not None
    said = diagnosis_of(benches, bench)
    assert said.verdict is Verdict.NOT_REPEATABLE
    assert "its bias jumped or drifted. In the holds alone the error is" in said.says
    assert "complete" not in said.says
    grade = graded(told, {"gyroscope": said})["gyroscope"]
    assert grade.why == "it reads another mean in rests that are left out"
