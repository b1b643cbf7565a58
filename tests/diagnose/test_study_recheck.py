"""A small version of ``benchmarks.recheck``: false alarms, and changes that are seen."""

import pytest

from benchmarks.recheck import CHANGES, STUDIES, Device, calibrated, rechecked

SEED = 23
UNCHANGED = 12


@pytest.fixture(scope="module")
def device() -> Device:
    """One device with its calibration, drawn by chance."""
    return calibrated(STUDIES["near"], SEED)


@pytest.mark.study
def test_an_unchanged_device_is_hardly_ever_a_no_go(device: Device) -> None:
    """At one in a hundred, two of 12 are rarer than one in 160."""
    found = [rechecked(STUDIES["near"], device, None, SEED + k)[0] for k in range(UNCHANGED)]
    assert found.count("no-go") <= 1


@pytest.mark.study
@pytest.mark.parametrize("change", list(CHANGES))
def test_every_change_is_seen(device: Device, change: str) -> None:
    """At 99 %, a second one of six that is missed is rarer than one in 600."""
    found = [rechecked(STUDIES["near"], device, change, SEED + k)[0] for k in range(6)]
    assert found.count("no-go") >= 5


@pytest.mark.study
def test_a_temperature_far_from_that_of_the_calibration_is_named(device: Device) -> None:
    """Without a coefficient, ±10 °C leave most rechecks without a verdict, and they say why."""
    found = [rechecked(STUDIES["unknown"], device, None, SEED + k) for k in range(8)]
    unsure = [says for verdict, says in found if verdict == "insufficient"]
    assert len(unsure) >= 2
    assert all("temperature differs" in says for says in unsure)
