"""Samples measured in another field than the place's own: left out, and nothing else is."""

import numpy as np
import pytest

from benchmarks.magnetometer import MOTIONS, Noise, recording
from imucal_wizard.estimate.magnetometer.fit import MagnetometerFit, fit_magnetometer
from imucal_wizard.estimate.methods import MethodNames
from tests.estimate.field_truth import (
    CORRECTION,
    recorded,
    six_circles,
    true_parameters,
    tumbling,
)

METHODS = tuple(MethodNames("magnetometer"))

TRUE = true_parameters()


def assert_true(found: MagnetometerFit) -> None:
    """Every parameter is within four standard errors of the truth."""
    for parameter in found.fit.parameters:
        off = abs(parameter.value - TRUE[parameter.name])
        assert off < 4.0 * (parameter.standard_error or 0.0)


def test_a_passing_steel_object_is_left_out_with_its_time() -> None:
    """Ten µT for three seconds: found, named, left out, and the result is the undisturbed one."""
    rng = np.random.default_rng(6)
    directions = six_circles(rng)
    time = np.arange(len(directions)) / 80.0
    bump = 100.0 * np.exp(-(((time - 40.0) / 1.0) ** 2))
    extra = bump[:, None] * np.array([0.6, -0.6, 0.5])
    found = fit_magnetometer(recorded(directions, rng, extra=extra).series)
    assert len(found.left_out) >= 1
    assert any(run.start < 40.0 < run.end for run in found.left_out)
    assert all(run.start > 36.0 and run.end < 44.5 for run in found.left_out)
    assert any("the field was disturbed" in text for text in found.fit.warnings)
    assert_true(found)


def test_poses_of_uneven_noise_keep_their_samples_and_weigh_by_their_own_noise() -> None:
    """Each of 18 poses has another noise; in this recording poses of many times it are most."""
    rng = np.random.default_rng([18106, 592])
    motion = MOTIONS["18 poses of 3 s"]
    _, stretch, level, _, series = recording(motion, Noise(uneven=0.7), 1.0, rng)
    found = fit_magnetometer(series)
    assert found.kept.all()
    assert_true(found)
    group = found.data.group_of
    each = np.array([found.data.noise[group[stretch == pose][120]] for pose in range(18)])
    true = np.array([level[stretch == pose][0] for pose in range(18)]) ** 2 / 240.0
    assert np.abs(np.log(each / true)).max() < np.log(1.7)


def test_single_wild_samples_are_left_out() -> None:
    """Five per cent of the samples far off: counted, and without effect."""
    rng = np.random.default_rng(7)
    directions = six_circles(rng)
    extra = np.zeros((len(directions), 3))
    wild = rng.random(len(directions)) < 0.05
    extra[wild] = 500.0 * rng.standard_normal((int(wild.sum()), 3))
    found = fit_magnetometer(recorded(directions, rng, extra=extra).series)
    assert found.kept[wild].mean() <= 0.15
    assert found.kept[~wild].mean() > 0.99
    assert_true(found)


def test_a_field_that_swings_is_left_out_as_a_stretch() -> None:
    """A loudspeaker for five seconds: its mean is nothing, and half of it lies near the others."""
    rng = np.random.default_rng(37)
    directions = six_circles(rng)
    time = np.arange(len(directions)) / 80.0
    speaker = (time > 20.0) & (time < 25.0)
    extra = 80.0 * np.sin(1.7 * 80.0 * time)[:, None] * np.array([1.0, 0.3, 0.5])
    extra[~speaker] = 0.0
    found = fit_magnetometer(recorded(directions, rng, extra=extra).series)
    assert found.kept[speaker].mean() < 0.1
    assert found.kept[(time < 19.0) | (time > 26.0)].mean() > 0.99
    runs = [run for run in found.left_out if not run.single]
    assert all(run.start > 19.0 and run.end < 26.0 for run in runs)
    assert_true(found)


def test_a_field_that_always_oscillates_is_not_taken_for_sensor_noise() -> None:
    """Nothing can be left out then, and the misfit is what the samples' noise makes: it is said."""
    rng = np.random.default_rng(41)
    directions = six_circles(rng)
    swing = 40.0 * np.sin(1.7 * np.arange(len(directions)))[:, None] * np.array([1.0, 0.3, 0.5])
    loud = fit_magnetometer(recorded(directions, rng, extra=swing).series).fit
    swings = f"as sampled at {80.0 * 1.7 / (2.0 * np.pi):.3g} Hz: is there a loudspeaker"
    assert any(swings in text for text in loud.warnings)
    calm = fit_magnetometer(recorded(directions, rng).series).fit
    assert not any("from one sample to the next" in text for text in calm.warnings)


def test_a_noisy_sensor_is_not_said_to_be_beside_a_loudspeaker() -> None:
    """Its noise is white: nothing swings."""
    rng = np.random.default_rng(42)
    directions = six_circles(rng)
    noise = 20.0 * rng.standard_normal((len(directions), 3))
    (said,) = fit_magnetometer(recorded(directions, rng, extra=noise).series).fit.warnings
    assert "noise is large" in said
    assert "loudspeaker" not in said


def test_a_long_rest_on_one_face_does_not_dominate() -> None:
    """Four fifths of the samples on one circle, wild samples between: the rest still counts."""
    rng = np.random.default_rng(36)
    directions = np.concatenate([tumbling(rng, 2400), six_circles(rng, 120.0, faces=(0,))])
    extra = np.zeros((len(directions), 3))
    wild = rng.random(len(directions)) < 0.02
    extra[wild] = 300.0 * rng.standard_normal((int(wild.sum()), 3))
    found = fit_magnetometer(recorded(directions, rng, extra=extra).series)
    assert found.kept[~wild].mean() > 0.99
    assert_true(found)


def test_undisturbed_samples_are_all_kept() -> None:
    """No false alarm in a clean recording, by circles or by tumbling."""
    rng = np.random.default_rng(8)
    for directions in (six_circles(rng), tumbling(rng, 4000)):
        found = fit_magnetometer(recorded(directions, rng).series)
        assert found.kept.all()
        assert found.fit.warnings == ()


@pytest.mark.parametrize("step", [0.01, 0.1, 0.6])
def test_rests_in_coarse_steps_are_no_disturbance(step: float) -> None:
    """Without noise rounding shifts the mean of a rest as a whole; that is no other field."""
    rng = np.random.default_rng(40)
    parts = []
    for circle in np.split(six_circles(rng, wobble=2.0), 6):
        parts += [circle, np.repeat(circle[-1:], 800, axis=0)]
    series = recorded(np.concatenate(parts), rng, noise=0.0, step=10.0 * step).series
    assert fit_magnetometer(series).kept.mean() > 0.98


def test_all_methods_are_judged_on_the_same_undisturbed_samples() -> None:
    """N's methods use everything, as printed; what they then err is measured where all is well."""
    rng = np.random.default_rng(12)
    directions = six_circles(rng)
    extra = np.zeros((len(directions), 3))
    extra[2000:2600] = (150.0, 80.0, -60.0)
    series = recorded(directions, rng, extra=extra).series
    fits = [fit_magnetometer(series, method=name) for name in METHODS]
    assert [found.fit.method for found in fits] == list(METHODS)
    assert len({int(found.kept.sum()) for found in fits}) == 1
    held_out = {found.fit.method: found.fit.rms_held_out or 0.0 for found in fits}
    assert held_out["orthogonal"] == min(held_out.values())
    assert held_out["numeric"] > 1.5 * held_out["orthogonal"]
    assert np.abs(fits[0].fit.matrix - CORRECTION).max() < 0.01


def test_many_disturbances_are_one_warning_that_names_no_cause_for_certain() -> None:
    """An axis that is read late misses wherever the device turns fast, and nothing passed."""
    rng = np.random.default_rng(6)
    directions = six_circles(rng)
    time = np.arange(len(directions)) / 80.0
    extra = np.zeros((len(directions), 3))
    for moment in (15.0, 40.0, 55.0):
        extra += 100.0 * np.exp(-(((time - moment) / 0.7) ** 2))[:, None] * [0.6, -0.6, 0.5]
    found = fit_magnetometer(recorded(directions, rng, extra=extra).series)
    passed = [run for run in found.left_out if not run.single]
    assert len(passed) >= 2
    (told,) = (text for text in found.fit.warnings if "was disturbed" in text)
    assert f"disturbed {len(passed)} times, the longest from" in told
    assert f"{sum(run.samples for run in passed)} samples left out" in told
    assert "the magnetometer's axes are read at different times while the device turns" in told
