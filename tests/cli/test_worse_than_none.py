"""A calibration that is worse than none: not usable, not saved, exit status 1, one sentence."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import imucal_wizard as iw
from benchmarks.hand_motion import Device, G, placed, recorded
from imucal_wizard.cli.main import main
from imucal_wizard.core.errors import DataError
from tests.cli.documents import saved


@pytest.fixture(scope="module")
def spoilt(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session in whose holds something pushed the device by 60 mg in any direction."""
    rng = np.random.default_rng(1)
    device = Device(rate=50.0)
    motion = placed(device, rng, hold=2.0, first=2.5)
    numbers = np.cumsum(np.diff(motion.resting, prepend=0.0) > 0.0)
    pushes = 0.06 * G * rng.standard_normal((int(numbers.max()) + 1, 3))
    readings = recorded(replace(motion, force=motion.force + pushes[numbers]), device, rng)
    return saved(readings, tmp_path_factory.mktemp("spoilt") / "spoilt.csv")


def test_fit_says_so_and_saves_what_is_usable(
    spoilt: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "cal.json"
    assert main(["fit", str(spoilt), "--no-verdict", "--json", "-", "--save", str(place)]) == 1
    out, err = capsys.readouterr()
    document = json.loads(out)
    one = document["sensors"]["accelerometer"]
    assert one["rms_held_out"] > one["rms_before"]
    assert one["usable"] is False
    worse = "the accelerometer's calibration may be worse than none"
    assert sum(text.startswith(worse) for text in document["warnings"]) == 1
    assert err.count(worse) == 1
    if document["sensors"]["gyroscope"]["usable"]:
        assert "without the accelerometer" in err
        assert set(json.loads(place.read_text())["sensors"]) == {"gyroscope"}
    else:
        assert "not saved" in err
        assert not place.exists()


def test_force_saves_it(spoilt: Path, tmp_path: Path) -> None:
    place = tmp_path / "cal.json"
    assert main(["fit", str(spoilt), "--no-verdict", "--save", str(place), "--force"]) == 0
    assert "accelerometer" in json.loads(place.read_text())["sensors"]


def test_python_refuses_to_save_it(spoilt: Path, tmp_path: Path) -> None:
    whole = iw.calibrate(iw.read(spoilt)).calibration
    assert "worse than none" in whole.unusable["accelerometer"]
    from msgspec.structs import replace as changed

    alone = changed(whole, sensors={"accelerometer": whole["accelerometer"]})
    with pytest.raises(DataError, match="worse than none"):
        alone.save(tmp_path / "cal.json")
    assert not (tmp_path / "cal.json").exists()
    alone.save(tmp_path / "cal.json", force=True)
    assert iw.load(tmp_path / "cal.json")["accelerometer"].usable is False


def test_a_sensor_that_is_not_calibrated_is_named_where_the_others_are_saved(
    spoilt: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its gyroscope does not answer; a script must not take the file for complete."""
    path, place = tmp_path / "dead.csv", tmp_path / "cal.json"
    header, *lines = spoilt.read_text().splitlines()
    dead = (",".join([*line.split(",")[:4], "0.01", "0.02", "0.01"]) for line in lines)
    path.write_text("\n".join([header, *dead]) + "\n")
    options = ["--no-verdict", "--force", "--save", str(place)]
    assert main(["fit", str(path), *options]) == 1
    assert "not saved, because not calibrated: the gyroscope" in capsys.readouterr().out
    assert set(json.loads(place.read_text())["sensors"]) == {"accelerometer"}
