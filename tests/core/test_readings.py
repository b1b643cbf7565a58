"""Series of samples."""

import numpy as np
import pytest

from imucal_wizard.core.readings import Series


def _series(time: np.ndarray) -> Series:
    return Series(time, np.zeros((len(time), 3)), "m/s^2")


@pytest.mark.parametrize(
    "rate", [60.0, 75.0, 98.0, 104.2, 225.0, 416.0, 666.0, 833.0, 860.0, 990.0]
)
def test_the_rate_of_times_in_whole_milliseconds_is_the_mean_one(rate: float) -> None:
    """A minute in ticks of 1 ms knows it to a tick in a minute."""
    time = np.floor(1000.0 * np.arange(int(60.0 * rate)) / rate) / 1000.0
    assert _series(time).rate == pytest.approx(rate, rel=1e-4)


@pytest.mark.parametrize("ticks", [1e-6, 1e-3])
@pytest.mark.parametrize("share", [0.03, 0.3])
def test_missing_samples_do_not_lower_the_rate(ticks: float, share: float) -> None:
    rng = np.random.default_rng(0)
    time = np.round(np.arange(6000) / 100.0 / ticks) * ticks
    lost = rng.choice(5999, int(share * 6000), replace=False) + 1
    kept = np.delete(time, np.union1d(lost, np.arange(3000, 3200)))
    assert _series(kept).rate == pytest.approx(100.0, rel=1e-6)
