"""From the hand that moves the device to the name of the effect and the error that falls.

The virtual hand follows the wizard's procedure with an effect hidden in the sensor, as it does
behind the screens; what the procedure collected goes to the fit and on to the bench.
"""

from pathlib import Path

import pytest

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.survey import add_by_itself, diagnose_benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.recording import fit_collected, fit_readings
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import standard
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.sensor import SensorModel
from imucal_wizard.teach import make_exercise, reveal
from imucal_wizard.teach.guess import Guess, Outcome, judge_guess

pytestmark = pytest.mark.usefixtures("no_sizes_throughout")

LONGEST = 400.0


def led(*hidden: str, rotations: int = 1, seed: int = 3) -> Collected:
    """What the wizard collects from a hand that does what it is asked."""
    hand = VirtualHand(seed=seed)
    stream = VirtualStream(hand, SensorModel.drawn(seed), hidden, seed=seed)
    machine = StateMachine(standard(rotations_per_axis=rotations), rate=100.0, listener=hand.follow)
    machine.command("start")
    while hand.time < LONGEST and machine.status().step is not StepKind.RESULT:
        samples = stream.take(20)
        t = samples.time
        force = Series(t, samples.accelerometer, "m/s^2")
        rate = Series(t, samples.gyroscope, "rad/s")
        machine.feed(Readings(force, rate, None, Series(t, samples.temperature[:, None], "degC")))
    assert machine.status().step is StepKind.RESULT
    return machine.collected()


def benches(*hidden: str) -> Benches:
    units = {"accelerometer": "m/s^2"}
    return Benches(fit_collected(led(*hidden), units, 100.0))


def test_the_wizards_procedure_finds_a_hidden_second_order_term() -> None:
    """Named (or its family, with the plainest member added), its size met, the error down."""
    said = diagnose_benches(benches("second-order:5:x"), {}, automatic=True)[0]
    assert said.verdict in (Verdict.COMPLETE, Verdict.AMBIGUOUS)
    assert said.added == ("second-order",)
    assert said.bench is not None
    first, last = said.bench.ladder
    assert first.rms_held_out is not None
    assert last.rms_held_out is not None
    assert last.rms_held_out < 0.3 * first.rms_held_out
    assert last.floor is not None
    assert last.rms_held_out < 3.0 * last.floor
    (found,) = (one for one in said.bench.fit.parameters if one.name == "second-order_x")
    assert found.standard_error is not None
    assert abs(found.value - 5.0) < 4.5 * found.standard_error


def test_the_wizards_procedure_finds_nothing_where_nothing_is_hidden() -> None:
    """The accelerometer is complete and nothing is added to it."""
    said = diagnose_benches(benches(), {}, automatic=True)[0]
    assert said.verdict is Verdict.COMPLETE
    assert said.added == ()


def test_an_exercise_that_chance_made_is_solved(tmp_path: Path) -> None:
    """The bench's answer is at least of the right family, and the error held out falls."""
    made = make_exercise(tmp_path / "exercise.csv", seed=20)
    readings = read_files([made.recording])
    bench = Benches(fit_readings(readings), readings).accelerometer
    add_by_itself(bench)
    first, last = bench.ladder
    assert first.rms_held_out is not None
    assert last.rms_held_out is not None
    assert last.rms_held_out < 0.5 * first.rms_held_out
    (term,) = bench.fit.terms
    axes = term.effect.parameters("accelerometer")[int(abs(bench.fit.sizes[0]).argmax())].name
    outcome, _ = judge_guess(Guess("accelerometer", term.name, axes), reveal(made.answer, made.key))
    assert outcome in (Outcome.RIGHT, Outcome.FAMILY)
