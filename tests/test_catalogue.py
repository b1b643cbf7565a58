"""The catalogue of devices and sessions: it lists what the files beside it say."""

import datetime as dt
import os
import subprocess
import sys
from pathlib import Path

import msgspec
import numpy as np
import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.report.calibration_file import AsFound, Calibration, Device, Value
from imucal_wizard.report.history_text import session_state
from imucal_wizard.sessions import Session
from imucal_wizard.sessions.catalogue import CATALOGUE_NAME, Catalogue
from imucal_wizard.sessions.history import PastParameter
from tests.report.devices import calibration

GO = {"schema": "imucal-wizard/recheck/1", "verdict": "go", "seconds": 40.0, "sensors": {}}


def measured(day: int, device: Device | None, **about: object) -> Calibration:
    """A calibration of that day of 2031, with readings of its own."""
    made = calibration(turns=4, felt=False)
    when = dt.datetime(2031, 1, 1, 9, tzinfo=dt.UTC) + dt.timedelta(days=day)
    holds = [msgspec.structs.replace(one, start=one.start + day) for one in made.hold_means]
    sensor = msgspec.structs.replace(
        made["accelerometer"],
        parameters={"bias_x": Value(0.1 + 0.01 * day, "m/s^2", 0.002, carried=True)},
        parameter_covariance=[[4e-6]],
    )
    made = msgspec.structs.replace(made, sensors={**made.sensors, "accelerometer": sensor})
    known = {"created": when.isoformat(), "measured": when.isoformat(), "hold_means": holds}
    return msgspec.structs.replace(made, device=device, **(known | about))


def filled(folder: Path) -> Path:
    """A folder with two devices, three calibrations, a recheck and two sessions."""
    outside = folder.parent / "outside"
    outside.mkdir()
    with Catalogue(folder) as catalogue:
        for day, name in ((0, "arm"), (30, "arm"), (40, "leg")):
            device = Device(name, f"SN-{name}", "Arduino")
            place = {"gravity": "standard", "name": "bench 3"}
            made = measured(day, device, place=place, operator="A. B.", temperature=(20.0, 25.0))
            catalogue.add_calibration(made.save(outside / f"{day}.json"))
        catalogue.add_recheck({"name": "arm", "serial": None}, GO | {"created": "2031-02-20"})
    for name, known in (("a", {"device": "arm"}), ("b", None)):
        about = {"created": 2e9, "source": "port", "step": "poses", "description": known}
        with Session.create(folder / f"{name}.imucal", about) as session:
            session.write_pieces([(3.0, b"x")])
            session.write_pieces([(9.0, b"x")])
    return folder


def everything(folder: Path) -> str:
    """All that the catalogue says."""
    with Catalogue(folder) as catalogue:
        devices = catalogue.devices()
        contents: list[object] = [devices, catalogue.sessions()]
        for device in devices:
            history = catalogue.history(device.serial or device.name)
            contents.append(history.rechecks[0].document if history.rechecks else None)
            for one in history.calibrations:
                sensors = {
                    name: (sensor.parameters, sensor.covariance, sensor.error, sensor.model)
                    for name, sensor in one.sensors.items()
                }
                contents.append((one.path, one.measured, one.temperature, one.place, sensors))
        return repr(contents)


def test_a_device_has_its_calibrations_rechecks_and_sessions(tmp_path: Path) -> None:
    folder = filled(tmp_path / "sessions")
    with Catalogue(folder) as catalogue:
        listed = [(d.name, d.calibrations, d.rechecks, d.sessions) for d in catalogue.devices()]
        assert listed == [("arm", 2, 1, 1), ("leg", 1, 0, 0)]
        history = catalogue.history("ARM")
        assert catalogue.history("sn-arm").device == history.device
        first, second = history.calibrations
        assert (second.measured - first.measured) / 86400.0 == 30.0
        assert (first.place, first.operator, first.temperature) == ("bench 3", "A. B.", (20, 25))
        accelerometer = first.sensors["accelerometer"]
        assert accelerometer.parameters["bias_x"] == PastParameter(
            0.1, 0.002, "m/s^2", determined=True
        )
        assert accelerometer.covariance == [[4e-6]]
        assert accelerometer.error == measured(0, None)["accelerometer"].error_as_left
        assert [one.verdict for one in history.rechecks] == ["go"]
        assert [one.path.name for one in history.sessions] == ["a.imucal"]
        assert [(s.path.name, s.seconds) for s in catalogue.sessions()] == [
            ("b.imucal", 6.0),
            ("a.imucal", 6.0),
        ]
        assert catalogue.notes == ()


def test_a_missing_or_damaged_catalogue_is_made_again_from_the_files(tmp_path: Path) -> None:
    """Every page and single bits, at random: nothing is lost, and no changed number is believed."""
    folder = filled(tmp_path / "sessions")
    whole, path = everything(folder), folder / CATALOGUE_NAME
    path.unlink()
    assert everything(folder) == whole
    good, random = path.read_bytes(), np.random.default_rng(3)
    for trial in range(12):
        data = bytearray(good)
        place = int(random.integers(len(data)))
        if trial % 4 == 0:
            data[place : place + 512] = random.bytes(min(512, len(data) - place))
        elif trial % 4 == 1:
            del data[place:]
        else:
            data[place] ^= 1 << int(random.integers(8))
        path.write_bytes(data)
        assert everything(folder) == whole
    path.write_text("no database at all, but long enough to be taken for one")
    with Catalogue(folder) as catalogue:
        assert [("was damaged" in note) for note in catalogue.notes] == [True]
    with Catalogue(folder) as catalogue:
        assert catalogue.notes == ()


def test_a_catalogue_that_is_damaged_while_it_is_open_is_made_again(tmp_path: Path) -> None:
    folder = filled(tmp_path / "sessions")
    whole, path = everything(folder), folder / CATALOGUE_NAME
    with Catalogue(folder) as catalogue:
        data = bytearray(path.read_bytes())
        data[24:28] = b"\xff" * 4  # the count of changes: what SQLite holds in memory is outdated
        data[4096:] = bytes(len(data) - 4096)
        path.write_bytes(data)
        assert [one.name for one in catalogue.devices()] == ["arm", "leg"]
        assert [("was damaged" in note) for note in catalogue.notes] == [True]
    assert everything(folder) == whole


def test_a_file_that_is_deleted_changed_or_damaged_is_listed_as_it_is(tmp_path: Path) -> None:
    folder = filled(tmp_path / "sessions")
    everything(folder)
    first, second, _ = sorted(folder.glob("*.calibration.json"))
    first.unlink()
    second.write_bytes(second.read_bytes()[:-300])
    (folder / "other.json").write_text('{"schema": "imucal-wizard/fit/1"}')
    with Catalogue(folder) as catalogue:
        (note,) = catalogue.notes
        assert second.name in note
        assert "is damaged" in note
        assert catalogue.history("arm").calibrations == ()
        assert len(catalogue.history("arm").rechecks) == 1


def test_a_measurement_that_was_saved_twice_counts_once(tmp_path: Path) -> None:
    """A second model of the same holds is no second measurement."""
    device = Device("arm")
    with Catalogue(tmp_path / "sessions") as catalogue:
        for hour in (1, 2):
            saved = measured(5, device, created=f"2031-03-01T0{hour}:00:00+00:00")
            catalogue.add_calibration(saved.save(tmp_path / "a.json"))
        (kept,) = catalogue.history("arm").calibrations
        assert kept.saved == dt.datetime(2031, 3, 1, 2, tzinfo=dt.UTC).timestamp()
        again = catalogue.add_calibration(tmp_path / "a.json")
        assert again == kept.path


def test_rechecks_and_sessions_of_one_second_are_in_the_order_in_which_they_were_kept(
    tmp_path: Path,
) -> None:
    """The second file has the number 2, the tenth 10."""
    folder, seconds = tmp_path / "sessions", list(range(10))
    for name in ("a", "a-2", "a-10"):
        about = {"created": 2e9, "step": "verdict"}
        Session.create(folder / f"{name}.imucal", about).close()
    with Catalogue(folder) as catalogue:
        for number in seconds:
            document = GO | {"created": "2031-02-20", "seconds": number, "session": "a-10.imucal"}
            verdict = {"verdict": "no-go" if number == seconds[-1] else "go"}
            catalogue.add_recheck({"name": "arm"}, document | verdict)
        past = catalogue.history("arm").rechecks
        assert [one.document["seconds"] for one in past] == seconds
        newest, *_, oldest = catalogue.sessions()
    assert (newest.path.name, session_state(newest)) == ("a-10.imucal", "NO-GO")
    assert (oldest.path.name, session_state(oldest)) == ("a.imucal", "not kept")


def test_a_device_is_known_by_its_serial_number_else_by_its_name(tmp_path: Path) -> None:
    with Catalogue(tmp_path / "sessions") as catalogue:
        for day, device in enumerate(
            [Device("old name", "1"), Device("new name", "1"), Device("old name"), Device("twin"),
             Device("one", "2"), Device("one", "3"), Device(None, "4")]
        ):  # fmt: skip
            catalogue.add_calibration(measured(day, device).save(tmp_path / "a.json"))
        listed = {(one.name, one.serial, one.calibrations) for one in catalogue.devices()}
        assert listed == {
            ("old name", "1", 3), ("twin", "", 1), ("one", "2", 1), ("one", "3", 1), ("4", "4", 1)
        }  # fmt: skip
        assert catalogue.history("new name").device.serial == "1"
        with pytest.raises(UsageError, match="2 devices have the name 'one'"):
            catalogue.history("one")
        with pytest.raises(UsageError, match=r"here; known: .*one 3, one 2") as refused:
            catalogue.history("nobody")
        assert "there is no device 'nobody'" in str(refused.value)
        with pytest.raises(UsageError, match="names no device"):
            catalogue.add_calibration(measured(9, None).save(tmp_path / "a.json"))


def test_as_found_is_the_error_by_the_calibration_before(tmp_path: Path) -> None:
    made = measured(1, Device("arm"))
    sensor = msgspec.structs.replace(
        made["accelerometer"], as_found=AsFound(0.07, "before.json", "2030-12-01"), rms_before=0.3
    )
    sensors = {"accelerometer": sensor, "gyroscope": made["gyroscope"]}
    path = msgspec.structs.replace(made, sensors=sensors).save(tmp_path / "a.json")
    with Catalogue(tmp_path / "sessions") as catalogue:
        catalogue.add_calibration(path)
        (found,) = catalogue.history("arm").calibrations
        accelerometer = found.sensors["accelerometer"]
        assert (accelerometer.as_found, accelerometer.as_found_by) == (0.07, "before.json")
        assert found.sensors["gyroscope"].as_found_by == ""


_WRITER = """
import sys
from pathlib import Path
from imucal_wizard.sessions.catalogue import Catalogue
folder, name = Path(sys.argv[1]), sys.argv[2]
for number in range(4):
    with Catalogue(folder) as catalogue:
        document = {"schema": "imucal-wizard/recheck/1", "verdict": "go", "number": number}
        catalogue.add_recheck({"name": name}, document)
"""


def test_programs_that_write_at_once_lose_nothing(tmp_path: Path) -> None:
    """Results of the same second have names of their own."""
    folder = tmp_path / "sessions"
    programs = [
        subprocess.Popen([sys.executable, "-c", _WRITER, str(folder), name]) for name in "ab"
    ]
    assert [one.wait() for one in programs] == [0, 0]
    with Catalogue(folder) as catalogue:
        assert catalogue.notes == ()
        for name in "ab":
            rechecks = catalogue.history(name).rechecks
            assert sorted(one.document["number"] for one in rechecks) == list(range(4))


def test_names_with_control_characters_are_shown_without_them(tmp_path: Path) -> None:
    folder = tmp_path / "sessions"
    with Catalogue(folder) as catalogue:
        device = Device("arm\x1b]0;x\x07\n\u202e", None)
        catalogue.add_calibration(measured(0, device, operator="\x1b[2J").save(tmp_path / "a.json"))
        weird = os.fsdecode(b"a\x1b[31m\n\xff.imucal")
        Session.create(
            folder / weird, {"source": "\udcff\x1b[5m", "description": {"device": "\x9b1m"}}
        ).close()
    with Catalogue(folder) as catalogue:
        names = [one.name for one in catalogue.devices()]
        assert all(name.isprintable() for name in names)
        assert catalogue.sessions()[0].path == folder / weird
        assert catalogue.history("arm ]0;x").calibrations[0].operator == "[2J"
