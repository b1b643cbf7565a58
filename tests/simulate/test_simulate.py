"""Simulated recordings: the contract's CSV, the poses asked for, and nothing of the truth."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.simulate.actions import direction
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.imu import LinePrinter
from imucal_wizard.simulate.noise import RandomStream, generator
from imucal_wizard.simulate.recording import recording_script, simulate_recording
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.scripts import RECORDING_POSE_SETS, pose_names
from imucal_wizard.simulate.sensor import SensorModel
from tests.simulate.sensors import ideal, truth


def _table(path: Path) -> FloatArray:
    return np.loadtxt(path, delimiter=",", skiprows=2)


def _rests(rates: FloatArray, quiet: float, shortest: int) -> list[slice]:
    """Stretches in which nothing turns, by the true rate of an ideal sensor."""
    still = np.concatenate([[False], np.abs(rates).max(1) <= quiet, [False]])
    edges = np.flatnonzero(np.diff(still.astype(int)))
    pairs = zip(edges[::2], edges[1::2], strict=True)
    return [slice(a, b) for a, b in pairs if b - a >= shortest]


def test_a_recording_is_the_csv_of_the_contract(tmp_path: Path) -> None:
    """Comments, a header with units, evenly spaced times, enough decimals."""
    path = tmp_path / "out.csv"
    simulate_recording(path, poses="6", rotations=1, rate=50.0)
    lines = path.read_text().splitlines()
    assert lines[0].startswith("# ")
    assert lines[1] == (
        "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s],temp[degC]"
    )
    assert len(lines[2].split(",")[1].split(".")[1]) >= 5
    table = _table(path)
    np.testing.assert_allclose(table[:, 0], np.arange(len(table)) / 50.0, atol=1e-6)


@pytest.mark.parametrize("poses", RECORDING_POSE_SETS)
def test_every_pose_of_the_set_is_held(tmp_path: Path, poses: str) -> None:
    """A first rest of 20 s, then each pose once, or again where repeats are asked for."""
    path = tmp_path / "out.csv"
    simulate_recording(path, poses=poses, rotations=0, hold=2.0, model=ideal())
    table = _table(path)
    rests = _rests(table[:, 4:7], 0.0, 150)
    names = pose_names(poses, generator(0, RandomStream.POSES))
    assert rests[0].stop - rests[0].start >= 2000
    assert len(rests) == 1 + len(names)
    for rest, name in zip(rests[1:], names, strict=True):
        up = table[rest, 1:4].mean(0) / STANDARD_GRAVITY
        assert np.degrees(np.arccos(np.clip(up @ direction(name), -1.0, 1.0))) < 8.0


def test_repeats_come_after_all_poses_have_been_held() -> None:
    """26 poses, then the first twelve again."""
    names = pose_names("26+repeats", np.random.default_rng(1))
    assert len(set(names[:26])) == 26
    assert names[26:] == names[:12]


def test_rotations_come_last_and_end_in_rests(tmp_path: Path) -> None:
    """Six turns per axis by default, both senses, below 250 °/s, then still."""
    path = tmp_path / "out.csv"
    simulate_recording(path, poses="6", hold=2.0, model=ideal())
    table = _table(path)
    rests = _rests(table[:, 4:7], 0.0, 400)
    assert len(rests) == 1 + 3 * 7
    assert rests[-1].stop == len(table)
    assert np.degrees(np.abs(table[:, 4:7]).max()) < 250.0
    for axis in range(3):
        assert np.degrees(table[:, 4 + axis].min()) < -100.0
        assert np.degrees(table[:, 4 + axis].max()) > 100.0


def test_a_recording_has_the_numbers_of_the_stream(tmp_path: Path) -> None:
    """The file is what the same seed's hand and sensor put out."""
    path = tmp_path / "out.csv"
    simulate_recording(path, seed=3, poses="6", rotations=0, hold=2.0)
    hand, sensor = VirtualHand(seed=3), SensorModel.drawn(3)
    hand.perform(recording_script("6", generator(3, RandomStream.POSES), hold=2.0, rotations=0))
    data = path.read_bytes().split(b"\n", 2)[2]
    count = data.count(b"\n")
    assert data == LinePrinter(sensor, "\n").lines(VirtualStream(hand, sensor, seed=3).take(count))


def test_a_seed_is_a_recording(tmp_path: Path) -> None:
    """The same seed writes the same bytes, another one other bytes."""
    paths = [tmp_path / name for name in "abc"]
    for path, seed in zip(paths, (1, 1, 2), strict=True):
        simulate_recording(path, seed=seed, poses="6", rotations=0, hold=2.0)
    assert paths[0].read_bytes() == paths[1].read_bytes() != paths[2].read_bytes()


def test_a_hand_with_a_seed_of_its_own_repeats_its_motion(tmp_path: Path) -> None:
    """Sessions that differ by nothing but the noise."""
    paths = [tmp_path / name for name in "abcd"]
    kinds = (ideal(), 1), (ideal(), 2), (None, 1), (None, 2)
    for path, (model, seed) in zip(paths, kinds, strict=True):
        model = model or SensorModel.drawn(1)
        simulate_recording(
            path, seed=seed, hand_seed=5, poses="6", rotations=1, hold=2.0, rate=25.0, model=model
        )
    assert paths[0].read_bytes() == paths[1].read_bytes()
    assert paths[2].read_bytes() != paths[3].read_bytes()


def test_the_truth_corrects_the_recording(tmp_path: Path) -> None:
    """With the true parameters every rest is one g long within the noise."""
    path = tmp_path / "out.csv"
    simulate_recording(path, seed=8, poses="6", rotations=0, hold=5.0)
    table, t = _table(path), truth(8)
    rate = (table[:, 4:7] - t.gyroscope_bias) @ t.gyroscope_matrix.T
    smooth = np.array([rate[i : i + 25].mean(0) for i in range(0, len(rate) - 25, 25)])
    rests = _rests(smooth, 0.003, 10)
    assert len(rests) == 7
    for rest in rests:
        mean = table[25 * rest.start + 25 : 25 * rest.stop - 25, 1:4].mean(0)
        felt = t.accelerometer_matrix @ (mean - t.accelerometer_bias)
        assert np.linalg.norm(felt) == pytest.approx(STANDARD_GRAVITY, abs=0.004)


def test_nothing_in_the_file_tells_the_hidden_effect(tmp_path: Path) -> None:
    """Comments and header are the same with and without."""
    plain, hidden = tmp_path / "plain.csv", tmp_path / "hidden.csv"
    simulate_recording(plain, poses="6", rotations=0, hold=2.0)
    simulate_recording(hidden, poses="6", rotations=0, hold=2.0, hidden=["second-order:30:z"])
    first, second = plain.read_text().splitlines(), hidden.read_text().splitlines()
    assert first[:2] == second[:2]
    assert first[2:] != second[2:]


def test_wrong_wishes_are_refused_with_the_reason(tmp_path: Path) -> None:
    """Unknown sets of poses, and places that cannot be written to."""
    with pytest.raises(UsageError, match="choose one of 6, 8, 18, 26"):
        simulate_recording(tmp_path / "out.csv", poses="12")
    with pytest.raises(UsageError, match="cannot be written"):
        simulate_recording(tmp_path / "no" / "out.csv", poses="6", rotations=0)


def test_any_whole_number_is_a_seed_and_no_rate_is_refused_with_the_reason(tmp_path: Path) -> None:
    """Negative seeds draw sensors of their own; rates must be those of an IMU."""
    negative, zero = SensorModel.drawn(-1), SensorModel.drawn(0)
    assert not np.array_equal(negative.accelerometer.bias, zero.accelerometer.bias)
    for rate in (0.0, -5.0, float("nan"), float("inf"), 1e9):
        with pytest.raises(UsageError, match="samples per second"):
            simulate_recording(tmp_path / "out.csv", poses="6", rotations=0, rate=rate)
