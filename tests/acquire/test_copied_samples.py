"""A block of samples that follows twice is left out; noise makes none by chance."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.copied_samples import Copy, copies
from imucal_wizard.acquire.files.recording_files import read_files


def flickering(count: int, seed: int, step: float) -> np.ndarray:
    """Readings of six axes with a noise of one, in steps of a converter."""
    values = np.random.default_rng(seed).normal(size=(count, 6))
    return np.asarray(np.round(values / step) * step)


@pytest.mark.parametrize("step", [0.01, 1.0, 3.0])
def test_a_block_that_follows_twice_is_found(step: float) -> None:
    """However coarse the converter is, if enough samples of the block change."""
    values = flickering(4000, 1, step)
    twice = np.concatenate([values[:2000], values[1800:]])
    (found,) = copies(twice)
    assert found.size == 200
    # noise may continue or shorten what equals by a sample
    assert abs(found.first - 2000) <= 2


@pytest.mark.parametrize("step", [0.01, 3.0, 4.0])
def test_noise_makes_no_copy(step: float) -> None:
    """Also where nearly all samples read the same."""
    assert not any(copies(flickering(2000, seed, step)) for seed in range(50))


def test_a_block_that_occurs_again_later_is_no_copy() -> None:
    """A machine may repeat a motion; a buffer that came twice is next to itself."""
    values = flickering(3000, 2, 0.01)
    assert copies(np.concatenate([values[:2000], values[100:300], values[2000:]])) == []
    assert copies(np.concatenate([values[:2000], values[1900:]])) == [Copy(2000, 100)]


def test_a_pattern_that_goes_on_is_what_the_device_sends() -> None:
    """As a machine without noise does, or a test of the wiring."""
    assert copies(np.tile(flickering(50, 4, 0.01), (6, 1))) == []


def test_a_recording_says_which_samples_are_left_out(tmp_path: Path) -> None:
    """With their times, and what is not known for it."""
    values = flickering(1000, 3, 0.01) + np.array([0.0, 0.0, 9.8, 0.0, 0.0, 0.0])
    twice = np.concatenate([values[:600], values[400:]])
    path = tmp_path / "twice.csv"
    table = np.column_stack([np.arange(len(twice)) / 100.0, twice])
    header = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s]"
    np.savetxt(path, table, delimiter=",", header=header, comments="", fmt="%.4f")
    readings = read_files([path])
    assert len(readings.accelerometer) == len(readings.gyroscope or ()) == 1000
    (said,) = [text for text in readings.warnings if "copy" in text]
    assert said.startswith("200 samples from 6.0 to 8.0 s after the beginning are an exact copy")
    assert not [text for text in readings.warnings if "missing" in text]
