"""Slow noise that long holds show within them, and what it means from hold to hold."""

import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import complement
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.accelerometer import accelerometer_experiment
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.hold_magnitudes import fit_by_method
from imucal_wizard.estimate.lack_of_fit import lack_without
from imucal_wizard.estimate.recording import FitOptions, fit_holds
from imucal_wizard.estimate.repeatability import within_freedom
from imucal_wizard.estimate.slow_kernels import about_the_mean, averaged, flicker_between
from imucal_wizard.estimate.slow_rests import flicker_in_holds
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.report.measured import hold_means, wrong_measurements
from tests.estimate.long_holds import SIGMA, holds_of
from tests.estimate.truth import EIGHTEEN


def shown(holds: list[Hold], up: FloatArray) -> float:
    """B that holds show, in units of the white noise of their means."""
    found = flicker_in_holds(holds, up, np.full(len(up), SIGMA**2))
    assert found is not None
    assert found.most > found.variance >= 0.0
    return math.sqrt(found.variance) / SIGMA


def test_long_holds_show_how_large_flicker_noise_is() -> None:
    """Eighteen of a minute, three sizes: most within one and a half of the errors said."""
    rng, inside = np.random.default_rng(3), 0
    for true in (1.5, 3.0, 6.0) * 4:
        holds = holds_of(EIGHTEEN, 60.0, rng, true)
        found = flicker_in_holds(holds, EIGHTEEN, np.full(18, SIGMA**2))
        assert found is not None
        doubt = math.sqrt(2.0 / found.freedom) * found.variance
        inside += abs(found.variance - (true * SIGMA) ** 2) < 1.5 * doubt
        assert found.variance < 3.0 * (true * SIGMA) ** 2
    assert inside >= 7  # 87 % of twelve are ten; as few as six once in a thousand


def test_white_noise_shows_no_flicker_noise() -> None:
    """By chance in one of twenty recordings."""
    rng = np.random.default_rng(4)
    found = [shown(holds_of(EIGHTEEN, 20.0, rng), EIGHTEEN) for _ in range(20)]
    assert sum(one > 0.0 for one in found) <= 4


def test_few_samples_in_long_holds_tell_nothing() -> None:
    """Of one sample per second there are parts of two lengths, for three unknown sizes."""
    holds = holds_of(EIGHTEEN, 20.0, np.random.default_rng(6), 5.0)
    for lengths in (1, 2):
        few = [
            replace(hold, allan_covariances=hold.allan_covariances[:lengths])
            for hold in holds
            if hold.allan_covariances is not None
        ]
        assert len(few) == len(holds)
        assert flicker_in_holds(few, EIGHTEEN, np.full(18, SIGMA**2)) is None


def test_one_hold_of_a_third_of_a_minute_is_no_long_rest() -> None:
    """The first rest of most sessions lasts as long; three degrees of freedom tell no noise."""
    holds = holds_of(EIGHTEEN, 20.0, np.random.default_rng(7), 5.0)
    one = [holds[0], *(replace(hold, allan_covariances=None) for hold in holds[1:])]
    assert flicker_in_holds(one, EIGHTEEN, np.full(18, SIGMA**2)) is None


def test_short_holds_do_not_tell_flicker_noise_from_other_slow_noise() -> None:
    """Six seconds are less than a decade of the shortest parts that are compared."""
    holds = holds_of(EIGHTEEN, 6.0, np.random.default_rng(5), 5.0)
    assert all(hold.allan_covariances is None for hold in holds)
    assert flicker_in_holds(holds, EIGHTEEN, np.full(18, SIGMA**2)) is None


def test_a_drift_is_no_flicker_noise() -> None:
    """A bias that drifts by ten times the noise in each hold is extrapolated by nobody."""
    rng = np.random.default_rng(6)
    found = [shown(holds_of(EIGHTEEN, 60.0, rng, drift=10.0), EIGHTEEN) for _ in range(5)]
    assert sum(one > 1.0 for one in found) <= 1


def test_a_support_that_gives_way_is_no_noise_along_gravity() -> None:
    """It turns gravity's direction: the readings across it change, those along it do not."""
    rng = np.random.default_rng(7)
    assert shown(holds_of(EIGHTEEN, 60.0, rng, turning=8.0), EIGHTEEN) < 1.0
    both = shown(holds_of(EIGHTEEN, 60.0, rng, instability=4.0, turning=20.0), EIGHTEEN)
    assert both == pytest.approx(4.0, rel=0.4)


def test_slow_noise_that_ends_within_the_holds_is_not_extrapolated() -> None:
    """Noise three times as large up to averages of 4 s, and beyond them that of white noise."""
    holds = holds_of(EIGHTEEN, 60.0, np.random.default_rng(13))
    ending = np.where(np.arange(6) < 3, 1.0, 9.0)[:, None, None]
    swaying = []
    for hold in holds:
        assert hold.allan_covariances is not None
        swaying.append(replace(hold, allan_covariances=ending * hold.allan_covariances))
    assert shown(swaying, EIGHTEEN) == 0.0


def test_flicker_noise_from_hold_to_hold_is_all_but_what_holds_contain() -> None:
    """A hold's own part and what is added are the kernel about the mean of the session."""
    spans = np.column_stack([66.0 * np.arange(18), 66.0 * np.arange(18) + 60.0])
    root = flicker_between(spans)
    rest = about_the_mean(spans, averaged) - root @ root.T
    # but for the mean of all holds, which is that of the session within the noise of one of them
    others = complement(np.ones((18, 1)))
    own = others.T @ rest @ others
    assert own == pytest.approx(np.diag(np.diag(own)), abs=0.01)
    # what blocks of a hold tell of its mean, by the same kernel
    blocks = np.column_stack([0.5 * np.arange(120), 0.5 * np.arange(1, 121)])
    phase = 2.0 * np.pi * np.outer([1.0, 2.0], blocks.mean(axis=1)) / 60.0
    waves = np.concatenate([np.cos(phase), np.sin(phase)]) * np.sqrt(2.0 / 120.0)
    within = np.trace(waves @ averaged(blocks) @ waves.T) / (4.0 * 120.0)
    assert np.diag(own) == pytest.approx(within, rel=0.15)


def lacks(holds: list[Hold]) -> bool:
    """Whether a fit of these holds leaves more than measured noise."""
    table = fit(accelerometer_experiment(holds, STANDARD_GRAVITY, "m/s^2")).rows
    assert table is not None
    return not lack_without(table, np.zeros(0, np.int64)).within_noise


@pytest.mark.parametrize("seconds", [20.0, 60.0])
def test_flicker_noise_in_long_holds_is_no_lack_of_fit(seconds: float) -> None:
    """Three times the white noise of a hold's mean, which no pose repeats."""
    rng = np.random.default_rng(8)
    found = [lacks(holds_of(EIGHTEEN, seconds, rng, 3.0)) for _ in range(10)]
    assert sum(found) <= 1


@pytest.mark.parametrize("instability", [0.0, 3.0])
def test_flicker_noise_does_not_absorb_structure(instability: float) -> None:
    """An error without a name, at six times all noise of a hold's mean, beside it."""
    rng = np.random.default_rng(9)
    for _ in range(5):
        error = 6.0 * math.hypot(1.0, 1.3 * instability) * rng.standard_normal((18, 3))
        assert lacks(holds_of(EIGHTEEN, 60.0, rng, instability, error=error))


def test_the_doubt_about_slow_noise_is_in_the_test_of_lack_of_fit() -> None:
    """One rest of two minutes shows it: fewer degrees of freedom than those of the short holds."""
    rng = np.random.default_rng(10)
    rest = holds_of(EIGHTEEN[:1], 120.0, rng, 6.0)
    holds = [*rest, *_later(holds_of(EIGHTEEN[1:], 8.0, rng, 1.6), rest[0].end)]
    with_slow = fit(accelerometer_experiment(holds, STANDARD_GRAVITY, "m/s^2")).rows
    alone = [replace(hold, allan_covariances=None) for hold in holds]
    without = fit(accelerometer_experiment(alone, STANDARD_GRAVITY, "m/s^2")).rows
    assert with_slow is not None
    assert without is not None
    assert within_freedom(without) == 8.0 * 18
    assert 5.0 < within_freedom(with_slow) < 0.8 * 8.0 * 18


def _later(holds: list[Hold], seconds: float) -> list[Hold]:
    """The same holds after so many seconds."""
    return [replace(one, start=one.start + seconds, end=one.end + seconds) for one in holds]


def test_a_method_of_the_papers_has_the_floor_of_the_same_noise() -> None:
    """Least squares over the same holds: 5 % apart by the weights."""
    holds = holds_of(EIGHTEEN, 60.0, np.random.default_rng(11), 3.0)
    usual = fit(accelerometer_experiment(holds, STANDARD_GRAVITY, "m/s^2"))
    other = fit_by_method(holds, STANDARD_GRAVITY, "m/s^2", "two-step")
    assert other.floor_fitted == pytest.approx(usual.floor_fitted, rel=0.05)


def test_the_calibration_file_keeps_what_long_holds_show() -> None:
    """A fit of the holds of the file weighs them as the first fit did; nonsense is refused."""
    holds = holds_of(EIGHTEEN, 20.0, np.random.default_rng(12), 3.0)
    units, rates = {"accelerometer": "m/s^2"}, {"accelerometer": 25.0}
    report = fit_holds(holds, (), rates, units, FitOptions(), (), ())
    kept = hold_means(report)
    again = fit(accelerometer_experiment([one.hold() for one in kept], STANDARD_GRAVITY, "m/s^2"))
    assert again.floor == report.sensors["accelerometer"].floor
    assert wrong_measurements(kept, [], [], []) == ""
    wrong = msgspec.structs.replace(kept[0], allan_covariances=[[[-1.0, 0.0], [0.0, 1.0]]])
    assert wrong_measurements([wrong], [], [], [])


def test_slow_noise_tilts_gravity_as_the_gyroscope_sees_it() -> None:
    """A bias that wanders across gravity turns its direction: the reference has that variance."""
    holds = holds_of(EIGHTEEN, 60.0, np.random.default_rng(14), 4.0)
    found = fit(accelerometer_experiment(holds, STANDARD_GRAVITY, "m/s^2"))
    assert found.reference is not None
    assert found.rows is not None
    tilt = STANDARD_GRAVITY**2 * found.reference.variance
    assert (tilt > found.rows.slow).all()
    assert float(found.rows.slow.mean()) > 4.0 * SIGMA**2
