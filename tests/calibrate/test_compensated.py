"""Readings that are corrected already are told from those of an ordinary sensor."""

from collections.abc import Callable

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.estimate.compensated import CONVINCING, Deviation
from imucal_wizard.estimate.recording import fit_readings
from tests.calibrate.sessions import session, true, with_accelerometer, with_gyroscope

DEGREE = np.pi / 180.0


def _noticed(readings: Readings) -> list[str]:
    return [text for text in fit_readings(readings).warnings if "compensat" in text]


def _offset_free(values: FloatArray) -> FloatArray:
    return values - true().accelerometer_bias


def _corrected(values: FloatArray) -> FloatArray:
    return np.asarray((values - true().accelerometer_bias) @ true().accelerometer_matrix.T)


def _roughly_corrected(values: FloatArray) -> FloatArray:
    """Corrected with a bias that has moved by 1 mg and scales by 0.1 % since."""
    return _corrected(values) * [1.001, 0.999, 1.001] + 0.01


def _rate_free(values: FloatArray) -> FloatArray:
    return values - true().gyroscope_bias


def _zeroing(values: FloatArray) -> FloatArray:
    """At rest exactly zero, as a device reads that takes its bias out and shows no noise."""
    free = _rate_free(values)
    return np.where(np.abs(free) < 0.5 * DEGREE, 0.0, free)


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.study) for seed in (1, 2, 3))]
)
def test_nothing_is_noticed_about_an_ordinary_sensor(seed: int) -> None:
    """In m/s² and rad/s or in raw counts."""
    assert _noticed(session(seed)) == []
    assert _noticed(session(seed, counts=True)) == []


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_offset_free, ("accelerometer's bias is nominal", "already compensated", "BNO055")),
        (_corrected, ("bias (at most", "and matrix are nominal", "hardly improves them (0.08")),
        (_roughly_corrected, ("and matrix are nominal", "small correction on top", "never apply")),
    ],
)
def test_a_compensated_accelerometer_is_noticed(
    change: Callable[[FloatArray], FloatArray], words: tuple[str, ...]
) -> None:
    """Its offset alone, or all of it; and what to do depends on what there is to gain."""
    (text,) = _noticed(with_accelerometer(session(), change))
    assert text.startswith("the accelerometer's")
    assert all(word in text for word in words), text


@pytest.mark.parametrize("change", [_rate_free, _zeroing])
def test_a_gyroscope_that_zeroes_itself_is_noticed(
    change: Callable[[FloatArray], FloatArray],
) -> None:
    """Its matrix is not nominal, and that is what remains to be calibrated."""
    (text,) = _noticed(with_gyroscope(session(), change))
    assert text.startswith("the gyroscope's bias is nominal")
    assert "removes it by itself" in text
    assert "use the matrix" in text


def test_offset_free_counts_are_noticed_without_a_nominal_scale() -> None:
    """The bias is judged as an input; nobody knows what the scale of counts should be."""
    truth = true(counts=True)
    readings = with_accelerometer(session(counts=True), lambda y: y - truth.accelerometer_bias)
    (text,) = _noticed(readings)
    assert "accelerometer's bias is nominal" in text


def _deviation(size: FloatArray, error: float) -> Deviation:
    return Deviation(size, error**2 * np.eye(3), np.full(3, 0.02), np.full(3, 0.3))


def test_poor_data_notice_nothing() -> None:
    """A bias of zero that is known to 30 mg only is no news."""
    assert _deviation(np.zeros(3), 1e-3).nominal
    assert not _deviation(np.zeros(3), 0.3).nominal


@pytest.mark.study
def test_false_alarms_are_as_rare_as_stated() -> None:
    """An ordinary sensor seems compensated less often than once in a hundred."""
    rng = np.random.default_rng(0)
    alarms = sum(_deviation(0.3 * rng.standard_normal(3), 2e-3).nominal for _ in range(20_000))
    assert 0 < alarms < 20_000 / CONVINCING


def test_compensated_ones_are_found() -> None:
    """With what is left behind drawn as it is thought to be, nine in ten are told."""
    rng = np.random.default_rng(1)
    found = sum(_deviation(0.02 * rng.standard_normal(3), 2e-3).nominal for _ in range(2000))
    assert found > 1800
