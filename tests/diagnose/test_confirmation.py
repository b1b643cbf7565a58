"""What data held out confirm: errors of all rows that judge a model, in units of their noise."""

import re
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.gyroscope_bound import DEVICES, Session
from benchmarks.wrong_names import answered
from imucal_wizard.core.quantities import quantity
from imucal_wizard.diagnose import posterior
from imucal_wizard.diagnose.bench import Bench, BenchFindings, entries_of
from imucal_wizard.diagnose.hypotheses import DISTURBED
from imucal_wizard.diagnose.next_poses import disturbed_parts
from imucal_wizard.diagnose.survey import add_by_itself
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.gyroscope_fit import gyroscope_minimum
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.model.catalogue import effect
from imucal_wizard.model.terms import Term
from imucal_wizard.report.bench_text import suspect_details
from tests.estimate.extended.turns import (
    DEGREE,
    G,
    Noise,
    course,
    measured,
    recorded,
    twenty_turns,
)

G_SENSITIVITY = Term(effect("g-sensitivity"))
OF_X_BY_Y = 0.012 * np.eye(9)[1]
LATE = 577.0
"""Moment of a step, s: eleven rotations come before it, nine after."""
NOISY_REFERENCE = Noise(sample=0.05 * DEGREE, wander=0.002 * DEGREE, force=0.03)


@pytest.fixture(scope="module")
def named() -> tuple[Bench, BenchFindings]:
    """A gyroscope that feels gravity, beside an accelerometer that errs by 3 mg in each hold."""
    rng = np.random.default_rng(6)
    made = course(twenty_turns())
    found = Bench("gyroscope", measured(made, (G_SENSITIVITY,), OF_X_BY_Y, NOISY_REFERENCE, rng))
    findings = add_by_itself(found)
    assert findings.opinion.families == ("g-sensitivity",)
    return found, findings


@pytest.fixture(scope="module")
def bench(named: tuple[Bench, BenchFindings]) -> Bench:
    """With the effect added."""
    return named[0]


def test_rests_confirm_what_hardly_moves_a_rotation(bench: Bench) -> None:
    """The closures, whose noise is that of the accelerometer, become larger by chance."""
    below, above = bench.ladder
    assert below.rms_held_out is not None
    assert above.rms_held_out is not None
    assert above.rms_held_out > below.rms_held_out
    assert above.added == "g-sensitivity"
    assert above.confirmed


def test_the_reason_tells_the_errors_that_fall(bench: Bench) -> None:
    """In units of the noise, since those in degrees do not, as the reason says."""
    (found,) = bench.found
    assert found.decided_by == "directions and rotations left out"
    words = r"the error held out falls from 2\.\d\d times the noise to 1\.\d\d times the noise"
    errors = (quantity(one.rms_held_out, "rad") for one in bench.ladder)
    alone = f" (rotations alone: {' to '.join(errors)})"
    assert re.fullmatch(words + re.escape(alone), found.reason)


def test_a_suspect_tells_which_error_would_not_fall(named: tuple[Bench, BenchFindings]) -> None:
    """Beside its mark, which belongs to the error in the column: that of the rotations."""
    entry = next(one for one in entries_of(*named) if one.term == "g-sensitivity")
    assert entry.rises
    words = (
        r"▲ the error on rotations left out would not fall, that on directions and rotations "
        r"would: from 2\.\d\d times the noise to 1\.\d\d times the noise$"
    )
    assert re.search(words, suspect_details(entry, named[1].fit, 80))


def test_a_suspect_that_is_disturbed_is_the_hold_or_the_rotation_of_its_number(
    named: tuple[Bench, BenchFindings],
) -> None:
    table = named[1].fit.rows
    assert table is not None
    entry = next(one for one in entries_of(*named) if one.term == DISTURBED)
    assert entry.suspect is not None
    for moving, words in ((True, "rotation 8"), (False, "hold 8")):
        item = table.item[(table.index == 7) & (table.moving == moving)][0]
        accused = replace(entry, suspect=replace(entry.suspect, hold=int(item)))
        assert suspect_details(accused, named[1].fit, 80).startswith(words)


@pytest.mark.parametrize(
    ("off", "accused"),
    [
        (("hold",), ((7,), (), ())),
        (("rotation",), ((), (7,), ())),
        (("hold", "rotation"), ((7,), (7,), ())),
    ],
)
def test_a_hold_is_not_accused_in_place_of_the_rotation_of_its_number(
    off: tuple[str, ...], accused: tuple[tuple[int, ...], tuple[int, ...], tuple[()]]
) -> None:
    """The eighth hold, which no rotation begins or ends with, and the eighth rotation."""
    noise, rng = Noise(sample=0.05 * DEGREE, force=0.001), np.random.default_rng(6)
    holds, rotations = recorded(course(twenty_turns()), (), None, noise, rng, None)
    if "hold" in off:
        assert holds[7].gyroscope is not None
        holds[7] = replace(holds[7], gyroscope=holds[7].gyroscope + 0.1 * DEGREE)
    if "rotation" in off:
        rotations[7] = replace(rotations[7], rate=rotations[7].rate + DEGREE)
    accelerometer = fit_accelerometer(holds, G, "m/s^2")
    data = gyroscope_minimum(holds, rotations, accelerometer, "rad/s").experiment
    bench = Bench("gyroscope", data)
    found = bench.look()
    assert found.opinion.verdict is Verdict.DISTURBED
    assert disturbed_parts(bench.rows, found) == accused


@pytest.mark.parametrize(
    ("tilted", "turned", "accused"),
    [
        ((8,), (), ((8,), ())),
        ((8, 14), (), ((8, 14), ())),
        ((), (5,), ((), (5,))),
        ((), (5, 17), ((), (5, 17))),
        # neighbours that both end or begin in another direction: the device moved in between
        ((), (7, 8), ((8,), ())),
        ((8,), (17,), ((8,), (17,))),
    ],
)
def test_a_hold_that_tilts_two_rotations_is_accused_and_neither_of_them(
    tilted: tuple[int, ...], turned: tuple[int, ...], accused: tuple[tuple[int, ...], ...]
) -> None:
    """Up by 0.3° off in a hold; a motion of about 0.6° that the readings do not show."""
    device = next(one for one in DEVICES if one.name == "18 poses, 12 turns, 1 mg")
    holds, rotations = Session(device, 3).recorded(np.random.default_rng(4))
    for hold in tilted:
        up = holds[hold].accelerometer
        across = np.cross(up, [0.3, 0.5, 0.8])
        off = 0.3 * DEGREE * np.linalg.norm(up) * across / np.linalg.norm(across)
        holds[hold] = replace(holds[hold], accelerometer=up + off)
    for number in turned:
        one = rotations[number]
        off = 0.6 * DEGREE / (one.time[-1] - one.time[0]) * np.array([0.7, -0.5, 0.6])
        rotations[number] = replace(one, rate=one.rate + (-1.0) ** number * off)
    accelerometer = fit_accelerometer(holds, G, "m/s^2")
    data = gyroscope_minimum(holds, rotations, accelerometer, "rad/s").experiment
    bench = Bench("gyroscope", data)
    found = bench.look()
    assert found.opinion.verdict is Verdict.DISTURBED
    assert tuple(map(sorted, disturbed_parts(bench.rows, found)[:2])) == tuple(map(list, accused))


def test_no_earlier_data_need_foresee_a_step() -> None:
    """A step in the last third of a session is confirmed by rotations on both sides of it."""
    step = Term(effect("scale-step"), LATE)
    noise, rng = Noise(sample=0.05 * DEGREE, wander=0.004 * DEGREE), np.random.default_rng(0)
    data = measured(course(twenty_turns()), (step,), np.array([0.0, 6000.0, 0.0]), noise, rng)
    assert Bench("gyroscope", data).add("scale-step", LATE).confirmed


@pytest.mark.parametrize("number", [24, 28, 32])
def test_axes_that_change_are_no_step_of_the_bias_and_no_disturbed_hold(number: int) -> None:
    """One axis tilts once: a bias that steps, or one bad hold, fits 18 poses as well."""
    found = answered("axis that tilts once", 23801, number)
    assert not found.names
    assert found.verdict in (Verdict.UNEXPLAINED, Verdict.NOT_REPEATABLE)


@pytest.mark.parametrize(
    ("name", "number"),
    [("gyroscope axis that tilts slowly", 7), ("gyroscope whose axes change once", 3)],
)
def test_axes_of_a_gyroscope_that_change_are_no_disturbed_rotation(name: str, number: int) -> None:
    """Nor a scale that steps: where no explanation had room for the axes, the rest was one."""
    found = answered(name, 24103, number)
    assert not found.names
    assert found.verdict is Verdict.UNEXPLAINED


def test_what_fits_and_does_not_predict_is_not_named(monkeypatch: pytest.MonkeyPatch) -> None:
    """The step leaves a thousandth of the squares fitted and two fifths of those held out."""
    monkeypatch.setattr(posterior, "axes_changes", lambda *_: [])
    found = answered("axis that tilts once", 23801, 28)
    assert not found.names
    assert found.verdict is Verdict.UNEXPLAINED
