"""What sampling loses of a trembling rotation, told from the spectrum of its samples."""

from dataclasses import replace
from typing import cast

import numpy as np
import pytest

from benchmarks.hand_motion import Device, placed, recorded
from benchmarks.tremor import HANDS, compared, found
from imucal_wizard.core.attitude import rotation_samples
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate import gyroscope
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.estimate.rest_spectrum import RestSpectrum
from imucal_wizard.estimate.sampling_loss import SamplingLoss, borne_out, sampling_loss

STEP, FINER = 0.01, 32
NOISE = 1e-8
"""Variance × time of a sample's noise, rad²/s."""


def _at_rest(half: float, noise: float) -> RestSpectrum:
    """White noise, but around f/2."""
    return RestSpectrum(np.full(3, noise), np.full(3, half), np.full(3, noise))


CALM = _at_rest(NOISE, NOISE)


def _shaken(fall: float, rng: np.random.Generator, peak: float = 0.0) -> FloatArray:
    """Three seconds of rates whose power falls as 1/ν^fall, at 3,200 samples/s, shape (n, 3).

    From 5 Hz on, or around a peak at so many Hz, 5 Hz wide.
    """
    count = 300 * FINER
    frequency = np.fft.rfftfreq(count, STEP / FINER)[1:]
    size = np.minimum(1.0, (5.0 / frequency) ** (fall / 2.0))
    if peak:
        size = np.minimum(1.0, (peak / frequency) ** (fall / 2.0 - 1.0))
        size /= np.hypot(1.0, (frequency - peak) / 5.0)
    spectrum = size[:, None] * (rng.standard_normal((2, len(frequency), 3)).T @ [1.0, 1j]).T
    rate = np.fft.irfft(np.concatenate([np.zeros((1, 3)), spectrum]), count, axis=0)
    ends = np.minimum(1.0, 10.0 * np.minimum(np.arange(count), count - np.arange(count)) / count)
    return np.asarray(rate * ends[:, None])


def test_a_tremor_s_peak_below_half_the_sampling_rate_hides_no_loss() -> None:
    """From 28 Hz the power falls far faster up to f/2 than from there to f, 100 Hz.

    The variance is between the true one and twice that; by the fall below f/2 it is a quarter.
    """
    rng = np.random.default_rng(13)
    whole = [_shaken(3.0, rng, peak=28.0) for _ in range(60)]
    off = [STEP * (one[::FINER].sum(axis=0) - one.sum(axis=0) / FINER) for one in whole]
    samples = rotation_samples([STEP * np.arange(300.0)] * 60, [one[::FINER] for one in whole])
    loss = sampling_loss(samples, samples.reading, _at_rest(0.0, 0.0), 0.0).aliased.mean()
    assert 1.0 < 3.0 * loss / np.mean(np.square(off)) < 2.0


def test_a_hand_at_rest_shows_no_filter() -> None:
    """Power that falls to half from f/4 to f/2 is a filter's, but in a hand without a level."""
    rng, time = np.random.default_rng(14), STEP * np.arange(300.0)
    rates = [1e3 * _shaken(2.5, rng)[::FINER] for _ in range(20)]
    samples = rotation_samples([time] * 20, rates)
    ends = np.full(3, 0.5 * NOISE), np.full(3, NOISE)
    falling = RestSpectrum(np.full(3, NOISE), *ends, count=1000.0)

    def lost(at_rest: RestSpectrum, *, held: bool = False) -> float:
        loss = sampling_loss(samples, samples.reading, at_rest, NOISE, held=held)
        return float(loss.aliased.mean())

    whole = lost(CALM)
    assert lost(falling, held=True) == pytest.approx(whole, rel=0.05)
    assert lost(falling) < 0.3 * whole
    assert lost(replace(falling, level=True), held=True) < 0.3 * whole


@pytest.mark.parametrize("fall", [2.5, 4.0])
def test_it_is_what_the_sum_of_samples_lacks(fall: float) -> None:
    """Sixty rotations, three axes, sums over 300 of 9,600 samples: the variance to a third."""
    rng = np.random.default_rng(1)
    whole = [_shaken(fall, rng) for _ in range(60)]
    sampled = [one[::FINER] for one in whole]
    off = [STEP * (few.sum(axis=0) - all_of_it.sum(axis=0) / FINER)
           for few, all_of_it in zip(sampled, whole, strict=True)]  # fmt: skip
    time = STEP * np.arange(300.0)
    samples = rotation_samples([time] * 60, sampled)
    loss = sampling_loss(samples, samples.reading, _at_rest(0.0, 0.0), 0.0).aliased.mean()
    assert 3.0 * loss == pytest.approx(np.mean(np.square(off)), rel=0.35)


def test_a_bump_is_lost_in_its_own_rotation() -> None:
    """A rate that stops within a sample in 15 of 60 rotations; the others lose hardly anything.

    45 sums tell their variance to a fifth.
    """
    rng, count = np.random.default_rng(8), 300 * FINER
    time, moment = STEP * np.arange(300.0), np.arange(count) * STEP / FINER
    whole = []
    for row in range(60):
        turn = 0.05 * _shaken(4.0, rng)
        if row < 15:
            stops = rng.uniform(2.0, 2.2)
            turn += (moment < stops)[:, None] * np.sin(np.pi * moment / 2.5)[:, None] ** 2
        whole.append(turn)
    off = np.array([STEP * (one[::FINER].sum(axis=0) - one.sum(axis=0) / FINER) for one in whole])
    samples = rotation_samples([time] * 60, [one[::FINER] for one in whole])
    lost = sampling_loss(samples, samples.reading, _at_rest(0.0, 0.0), 0.0).aliased
    lost = 3.0 * time[-1] * lost
    square = (off**2).sum(axis=1)
    assert lost[:15].mean() == pytest.approx(square[:15].mean(), rel=0.5)
    assert square[15:].mean() < lost[15:].mean() < 1e-6 * square[:15].mean()


def test_noise_of_the_samples_is_no_tremor() -> None:
    """White noise as large as at rest loses nothing, in 20 sets of rotations."""
    rng, time = np.random.default_rng(2), STEP * np.arange(300.0)
    for _ in range(20):
        rates = [np.sqrt(NOISE / STEP) * rng.standard_normal((300, 3)) for _ in range(20)]
        samples = rotation_samples([time] * 20, rates)
        lost = sampling_loss(samples, samples.reading, CALM, NOISE)
        assert lost.aliased.mean() + lost.white.mean() < 0.1 * NOISE


def test_a_noisy_rest_within_a_rotation_is_noise_of_that_rotation() -> None:
    """Four seconds with five times the noise; a hand's motion adds none."""
    rng, time = np.random.default_rng(7), STEP * np.arange(900.0)
    turn = np.sin(np.pi * np.minimum(time / 2.0, 1.0))[:, None] ** 2
    rates = []
    for row in range(40):
        noise = np.sqrt(NOISE / STEP) * rng.standard_normal((900, 3))
        noise[300:700] *= 5.0 if row < 10 else 1.0
        motion = np.tile(_shaken(2.0, rng)[::FINER], (3, 1)) if row >= 30 else 0.0
        rates.append(noise + turn + 1e-2 * motion)
    samples = rotation_samples([time] * 40, rates)
    white = sampling_loss(samples, samples.reading, CALM, NOISE).white
    more = 24.0 * NOISE * 400.0 / 900.0
    assert (white[:10] > 0.5 * more).sum() >= 8  # it must be clear in each
    assert white[:10].mean() == pytest.approx(more, rel=0.3)
    assert white[10:].mean() < 0.02 * more


def test_a_tremor_at_rest_shows_what_it_aliases_to() -> None:
    """A spectrum that ends below f, with all its power around f/2: no fall from there shows that.

    At rest the tremor is as strong and the noise at low frequencies has hardly grown.
    """
    rng, time = np.random.default_rng(6), STEP * np.arange(300.0)
    rates = []
    for _ in range(20):
        frequency, phase = rng.uniform([40.0, 0.0], [50.0, 2.0 * np.pi], (8, 2)).T
        waves = np.sin(2.0 * np.pi * np.outer(time, frequency) + phase)
        noise = np.sqrt(NOISE / STEP) * rng.standard_normal((300, 3))
        rates.append(noise + 1e-2 * waves.sum(axis=1)[:, None])
    samples = rotation_samples([time] * 20, rates)
    calm = sampling_loss(samples, samples.reading, CALM, NOISE).aliased.mean()
    half = 8.0 * 0.5e-4 / (2.0 * 10.0)
    shaken = _at_rest(0.7 * half, NOISE)
    trembling = sampling_loss(samples, samples.reading, shaken, NOISE).aliased.mean()
    assert calm > 100.0 * NOISE
    assert trembling < NOISE


def test_the_report_says_what_to_do() -> None:
    """At 25 samples/s of a trembling hand, not of a calm one; the last looks like white noise."""
    rng = np.random.default_rng(3)
    for hand, expected in ((HANDS[1], True), (HANDS[0], False), (HANDS[6], True)):
        warnings = found(hand, 25.0, rng).warnings
        assert any("sample faster or turn more calmly" in one for one in warnings) is expected


def test_closures_show_a_smaller_loss_than_the_spectrum_allows(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """As with a sensor that averages: the noise figure is the error that it makes."""
    monkeypatch.setattr(
        gyroscope, "sampling_loss", lambda *_: SamplingLoss(np.full(26, 1e-6), np.zeros(26))
    )
    fit = found(HANDS[0], 25.0, np.random.default_rng(4)).fit
    assert fit is not None
    assert fit.floor == pytest.approx(fit.rms_held_out, rel=0.3)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_closures_bear_out_the_share_of_the_loss_that_they_contain(share: float) -> None:
    """A thousand rows of uneven noise, of which sampling may lose most; they know it to 5 %.

    It is the most that they allow, by 1.6 standard errors.
    """
    rng = np.random.default_rng(9)
    rest, lost = rng.uniform(0.5, 1.5, 1000), rng.uniform(5.0, 15.0, 1000)
    squares = (rest + share * lost) * rng.chisquare(1, 1000)
    most = borne_out(squares / (rest + lost), lost / (rest + lost), 1000.0)
    assert share - 0.02 < most < share + 0.1


def test_a_misfit_does_not_enlarge_the_loss() -> None:
    """Rows ten times as large as the noise leave the loss as the spectrum shows it."""
    assert borne_out(np.full(100, 100.0), np.full(100, 5.0 / 6.0), 88.0) == 1.0


def test_closures_that_are_small_by_chance_change_nothing() -> None:
    """In one of a hundred sets the test takes chance for a smaller loss."""
    sets = np.random.default_rng(10).chisquare(1, (300, 60))
    lost = np.full(60, 5.0 / 6.0)
    assert sum(borne_out(one, lost, 60.0) < 1.0 for one in sets) <= 8


def test_a_chain_of_rotations_in_a_hand_collects_the_noise_of_its_holds() -> None:
    """Through a hold in a hand the rates are integrated, with the variance of white noise.

    A part in each closure, from the beginning to the mean and from the mean to the end; what the
    closures share beside it is the tilt of the mean, which cancels in the chain.
    """
    rng, device = np.random.default_rng(12), Device()
    motion = placed(device, rng, tremor=5.0, turns=1)
    fit = fit_readings(recorded(motion, device, rng)).sensors["gyroscope"]
    experiment = cast("GyroscopeExperiment", fit.experiment)
    rest, one = experiment.noise_at_rest, experiment.closure
    both = experiment.rotations
    joined = sorted({*both.before.tolist()} & {*both.after.tolist()})
    assert rest.held
    assert rest.carried[joined].all()
    lost = experiment.lost.aliased + experiment.lost.white
    walked = (one.walk.min(axis=1) + lost) * both.seconds
    inside = float((one.noise - walked).sum())
    outer = [k for k in [*both.before.tolist(), *both.after.tolist()] if k not in joined]
    # at the ends of the chain the noise from the mean on is a third, and that of a tilt
    inside -= float((1.5 * rest.end[outer]).sum())
    seconds = np.array([hold.end - hold.start for hold in experiment.holds])[joined]
    # where the tilt of a mean is smaller than that part, the part is limited to it
    assert inside == pytest.approx(float((rest.per_second.mean() * seconds).sum()), rel=1e-2)


@pytest.mark.study
def test_the_noise_figure_contains_it() -> None:
    """Four sessions at 50 samples/s: within a third; without it it is 2 and 22 times too small."""
    for hand in HANDS[1:3]:
        row = compared(hand, 50.0, 4, 5)
        assert row.said == pytest.approx(row.held_out, rel=0.33)
