"""``imucal-wizard recheck`` on recordings of a device that has changed, or not."""

import json
import re
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest

import imucal_wizard as iw
from imucal_wizard.cli import main as cli
from imucal_wizard.core.description import Description
from imucal_wizard.core.quantities import quantity
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.diagnose.calibrated_sensor import RecheckData
from imucal_wizard.diagnose.change import DetectionPower
from imucal_wizard.diagnose.recheck import RecheckVerdict
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import RECHECK_STEPS, Procedure
from imucal_wizard.model.rows.source import Parameters
from imucal_wizard.report.calibrated_device import (
    CalibratedDevice,
    RecheckSettings,
    recheck_collected,
    recheck_readings,
    unreadable_recheck,
)
from imucal_wizard.report.calibration_file import read_calibration
from imucal_wizard.report.recheck_text import kept_recheck, recheck_document
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.session_replay import begin_session
from imucal_wizard.sessions import Session
from imucal_wizard.sessions.catalogue import Catalogue
from imucal_wizard.sessions.stored_readings import session_readings
from imucal_wizard.simulate.recording import simulate_recording
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.services import WizardServices
from imucal_wizard.tui.sources import SourceChoice, SourceKind

OWN_EFFECT = """
import numpy as np
from imucal_wizard.model.effect import Effect, EffectParameter

class Own(Effect):
    name, sensors, kind = "my-square", ("accelerometer",), "orientation"
    title, equation = "a square of my own", "K x_x^2"

    def parameters(self, sensor):
        return (EffectParameter("x", "mm/s²", 20.0),)

    def columns(self, sensor, c, variant=None):
        made = np.zeros((len(c), 3, 1))
        made[:, 0, 0] = 1e-3 * (c.force[:, 0] / c.gravity) ** 2
        return made
"""
Run = Callable[..., tuple[int, dict[str, Any]]]
MILLI_G, DEGREE = 9.80665e-3, np.pi / 180.0


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A calibration and a later recording of the same device: six faces."""
    made = tmp_path_factory.mktemp("recheck")
    simulate_recording(made / "calibrated.csv", seed=11)
    saved = ["--no-verdict", "--save", str(made / "cal.json")]
    assert cli.main(["fit", str(made / "calibrated.csv"), *saved]) == 0
    simulate_recording(made / "today.csv", seed=11, poses="6", hold=2.5, rotations=0)
    return made


@pytest.fixture(scope="module")
def with_field(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording with a magnetometer, and its calibration beside it."""
    made = tmp_path_factory.mktemp("field")
    simulate_recording(
        made / "a.csv", seed=11, rate=25.0, poses="6", rotations=1, hold=3.0, magnetometer=True
    )
    options = ["--no-verdict", "--force", "--save", str(made / "cal.json")]
    assert cli.main(["fit", str(made / "a.csv"), *options]) == 0
    return made


@pytest.fixture
def run(folder: Path, capsys: pytest.CaptureFixture[str]) -> Run:
    """The exit status and the document of a recheck, of ``today.csv`` if no file is given."""

    def rechecked(*options: str, file: Path | None = None) -> tuple[int, dict[str, Any]]:
        recording = folder / "today.csv" if file is None else file
        words = ["recheck", str(folder / "cal.json"), str(recording), *options, "--json", "-"]
        status = cli.main(words)
        return status, json.loads(capsys.readouterr().out)

    return rechecked


def changed(folder: Path, place: Path, column: str, more: float = 0.0, times: float = 1.0) -> Path:
    """The recording of today with one column changed."""
    lines = (folder / "today.csv").read_text().splitlines()[1:]
    names = [name.partition("[")[0] for name in lines[0].split(",")]
    table = np.array([line.split(",") for line in lines[1:]], float)
    table[:, names.index(column)] = times * table[:, names.index(column)] + more
    np.savetxt(place, table, delimiter=",", header=lines[0], comments="", fmt="%.7f")
    return place


def test_an_unchanged_device_is_go(run: Run) -> None:
    status, found = run()
    assert status == 0
    assert (found["schema"], found["verdict"]) == ("imucal-wizard/recheck/1", "go")
    assert 40.0 < found["seconds"] < 60.0
    for name, unit in (("accelerometer", "m/s^2"), ("gyroscope", "rad/s")):
        sensor = found["sensors"][name]
        assert sensor["verdict"] == "go"
        assert sensor["unit"] == unit
        assert 0.0 <= sensor["error"] < sensor["limit"]
        assert 0.0 < sensor["floor"] < sensor["limit"]
        assert {one["axis"] for one in sensor["seen"]} == {"x", "y", "z"}
        assert min(one["power"] for one in sensor["seen"]) > 0.99


def test_the_reason_compares_the_error_with_what_noise_makes_and_with_the_limit(
    run: Run, folder: Path, tmp_path: Path
) -> None:
    """Of a GO and of a NO-GO: an error is told from noise only beside what noise makes."""
    for file in (None, changed(folder, tmp_path / "changed.csv", "ay", times=1.005)):
        for sensor in run(file=file)[1]["sensors"].values():
            error, noise, limit = (
                quantity(sensor[name], sensor["unit"]) for name in ("error", "floor", "limit")
            )
            words = f"error {error} (noise alone makes {noise}), limit {limit}"
            assert sensor["says"].startswith(words)


def reordered(folder: Path, place: Path, columns: dict[str, str], kept: str = "axg") -> Path:
    """The recording of today with columns taken from others, ``-`` before what is reversed."""
    lines = (folder / "today.csv").read_text().splitlines()[1:]
    names = [name.partition("[")[0] for name in lines[0].split(",")]
    table = np.array([line.split(",") for line in lines[1:]], float)
    found = table.copy()
    for name, other in columns.items():
        sign = -1.0 if other.startswith("-") else 1.0
        found[:, names.index(name)] = sign * table[:, names.index(other.lstrip("-"))]
    rows = [k for k, name in enumerate(names) if name[0] in f"t{kept}"]
    header = ",".join(lines[0].split(",")[k] for k in rows)
    np.savetxt(place, found[:, rows], delimiter=",", header=header, comments="", fmt="%.7f")
    return place


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ({"ay": "-ay"}, {"accelerometer": "y points the other way"}),
        ({"gx": "gz", "gz": "gx"}, {"gyroscope": "x and z are swapped"}),
        (
            {"ax": "ay", "ay": "-ax", "gx": "gy", "gy": "-gx"},
            dict.fromkeys(
                ("accelerometer", "gyroscope"),
                "x lies along the calibration's +y, y lies along the calibration's −x",
            ),
        ),
    ],
)
def test_other_axes_are_named_and_no_parameter_is_accused(
    run: Run, folder: Path, tmp_path: Path, columns: dict[str, str], said: dict[str, str]
) -> None:
    """A new calibration would not help: the columns or the device's axes have to be corrected."""
    status, found = run(file=reordered(folder, tmp_path / "other.csv", columns))
    assert (status, found["verdict"]) == (1, "no-go")
    for name, one in found["sensors"].items():
        assert one["verdict"] == ("no-go" if name in said else "go")
        assert said.get(name, "") in one["says"]
        assert not one["moved"]
    assert found["says"].startswith(
        "The readings do not have the axes of the calibration. With the axes put right no sensor "
        "disagrees, so no new calibration is needed: correct the columns"
    )
    for name, words in said.items():
        differs = f"{name.capitalize()}: its axes differ from the calibration's: {words}."
        assert differs in found["says"]


def test_of_an_accelerometer_alone_other_axes_are_one_explanation(
    run: Run, folder: Path, tmp_path: Path
) -> None:
    """Its bias may have moved by twice its size as well: both are said."""
    file = reordered(folder, tmp_path / "alone.csv", {"ay": "-ay"}, kept="a")
    found = run(file=file)[1]
    assert found["sensors"]["accelerometer"]["verdict"] == "no-go"
    assert "bias_y has moved" in found["says"]
    assert "agree with the calibration if the accelerometer's y points" in found["says"]


@pytest.mark.parametrize(
    ("column", "more", "times", "sensor", "parameter", "by"),
    [
        ("ay", 0.0, 1.005, "accelerometer", "sensitivity_y", 0.005),
        ("gx", 0.0, 1.01, "gyroscope", "sensitivity_x", 0.01),
    ],
)
def test_a_change_is_no_go_and_named(
    run: Run,
    folder: Path,
    tmp_path: Path,
    column: str,
    more: float,
    times: float,
    sensor: str,
    parameter: str,
    by: float,
) -> None:
    file = changed(folder, tmp_path / "changed.csv", column, more, times)
    status, found = run(file=file)
    assert (status, found["verdict"]) == (1, "no-go")
    for name, one in found["sensors"].items():
        assert one["verdict"] == ("no-go" if name == sensor else "go")
    moved = found["sensors"][sensor]["moved"]
    assert moved[0]["parameter"] == parameter
    assert moved[0]["by"] == pytest.approx(by, rel=0.1)
    assert moved[0]["p"] < 1e-6
    assert parameter in found["says"]


def test_a_limit_of_the_users_own_decides(run: Run, folder: Path, tmp_path: Path) -> None:
    """3 mg are within the usual drift of a consumer part, and beyond a limit of 1 mg."""
    file = changed(folder, tmp_path / "changed.csv", "az", 3.0 * MILLI_G)
    assert run("--limit", "accelerometer=4mg", file=file)[0] == 0
    mine = ["--limit", "accelerometer=1 mg", "--limit", "gyroscope=0.2deg/s"]
    status, found = run(*mine, file=file)
    assert (status, found["verdict"]) == (1, "no-go")
    assert found["sensors"]["accelerometer"]["limit"] == pytest.approx(MILLI_G)
    assert found["sensors"]["gyroscope"]["limit"] == pytest.approx(0.2 * DEGREE)
    limits = tmp_path / "limits.toml"
    limits.write_text('accelerometer = "4 mg"\n')
    assert run("--limits", str(limits), file=file)[0] == 0


def test_gravity_follows_from_the_latitude(run: Run) -> None:
    """The recording has 9.80665 m/s²; the equator has 0.27 % less."""
    status, document = run("--latitude", "0")
    assert status == 1
    assert document["sensors"]["accelerometer"]["moved"][0]["parameter"].startswith("sensitivity")


def test_a_gyroscope_that_is_zeroed_is_reported(run: Run, folder: Path, tmp_path: Path) -> None:
    file = changed(folder, tmp_path / "changed.csv", "gx", 3.0 * DEGREE)
    status, found = run("--gyro-zeroed", file=file)
    assert (status, found["verdict"]) == (0, "go")
    gyroscope = found["sensors"]["gyroscope"]
    assert gyroscope["verdict"] == "reported"
    assert gyroscope["moved"][0]["by"] == pytest.approx(3.0 * DEGREE, rel=0.05)


def test_axes_that_were_not_seen_are_named(run: Run, folder: Path, tmp_path: Path) -> None:
    """Three poses without an x face up: its scale is not seen, nor is that of two rates."""
    lines = (folder / "today.csv").read_text().splitlines()[1:]
    short = tmp_path / "short.csv"
    short.write_text("\n".join(lines[: 100 * 27]))
    status, found = run(file=short)
    assert (status, found["verdict"]) == (1, "insufficient")
    unseen = {
        name: {(one["parameter"], one["axis"]) for one in sensor["seen"] if one["power"] < 0.99}
        for name, sensor in found["sensors"].items()
    }
    assert unseen["accelerometer"] >= {("bias", "x"), ("scale", "x")}
    assert ("scale", "z") not in unseen["accelerometer"]
    assert unseen["gyroscope"] >= {("scale", "y"), ("scale", "z")}
    assert "bias x" in found["says"]


def test_another_range_and_another_device_are_recognised(
    run: Run, folder: Path, tmp_path: Path
) -> None:
    half = tmp_path / "half.csv"
    source = folder / "today.csv"
    text = source.read_text()
    lines = text.splitlines()[1:]
    table = np.array([line.split(",") for line in lines[1:]], float)
    table[:, 1:4] *= 0.5
    np.savetxt(half, table, delimiter=",", header=lines[0], comments="", fmt="%.7f")
    status, found = run(file=half)
    assert (status, found["verdict"]) == (1, "insufficient")
    assert "2 times wider" in found["says"]
    other = tmp_path / "other.csv"
    simulate_recording(other, seed=12, poses="6", hold=2.5, rotations=0)
    status, found = run(file=other)
    assert (status, found["verdict"]) == (1, "no-go")
    assert found["says"].startswith("Calibrate the device again. Accelerometer: error ")
    assert "is this the device that was calibrated? Gyroscope: error" in found["says"]


@pytest.mark.parametrize(
    ("edit", "says"),
    [
        (lambda one: one["sensors"]["accelerometer"]["bias"].__setitem__(0, 1.0), "bias_x"),
        (lambda one: one.__setitem__("schema", "imucal-wizard/calibration/0"), "schema"),
        (lambda one: one["hold_means"][3]["accelerometer"].__setitem__(1, 0.0), "instead of"),
    ],
)
def test_a_file_edited_by_hand_or_of_another_version_is_refused(
    folder: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    edit: Callable[[dict[str, Any]], None],
    says: str,
) -> None:
    loose = json.loads((folder / "cal.json").read_text())
    edit(loose)
    place = tmp_path / "edited.json"
    place.write_text(json.dumps(loose))
    assert cli.main(["recheck", str(place), str(folder / "today.csv")]) == 2
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1


def test_an_effect_of_ones_own_is_named_where_its_file_is_missing(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    loose = json.loads((folder / "cal.json").read_text())
    effect: dict[str, Any] = {"term": "my-square", "sensor": "accelerometer", "equation": "K x_x^2"}
    effect |= {"parameters": ["x"], "sizes": [0.0], "unit": "mm/s²"}
    loose["sensors"]["accelerometer"]["effects"] = [effect]
    place, own = tmp_path / "my.json", tmp_path / "own.py"
    place.write_text(json.dumps(loose))
    own.write_text(OWN_EFFECT)
    says = "has the effect 'my-square', which is none of this program"
    for command in (["recheck", str(place), str(folder / "today.csv")], ["report", str(place)]):
        assert cli.main(command) == 2
        assert says in capsys.readouterr().err
    words = ["recheck", str(place), str(folder / "today.csv"), "--effects", str(own)]
    assert cli.main(words) == 0


@pytest.mark.parametrize("command", ["export --to c-header", "report"])
def test_other_commands_refuse_an_edited_file_too(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], command: str
) -> None:
    loose = json.loads((folder / "cal.json").read_text())
    loose["sensors"]["gyroscope"]["matrix"][0][0] *= 1.001
    place = tmp_path / "edited.json"
    place.write_text(json.dumps(loose))
    name, *options = command.split()
    assert cli.main([name, str(place), *options]) == 2
    assert "the gyroscope's sensitivity_x is" in capsys.readouterr().err
    assert sorted(tmp_path.iterdir()) == [place]


def test_an_old_calibration_says_that_its_age_hides_changes(run: Run) -> None:
    """After two years 1.4 mg of ageing, one standard deviation: no pose shows 5 mg surely."""
    status, found = run("--date", f"{datetime.now(UTC).year + 2}-12-31")
    assert (status, found["verdict"]) == (1, "insufficient")
    assert "months old, and ageing hides changes" in found["says"]
    assert run("--limit", "accelerometer=6mg", "--date", "2099-01-01")[1]["verdict"] != "no-go"


def test_a_check_before_the_calibration_is_said_to_be_one(run: Run) -> None:
    says = "The calibration is later than this check"
    assert says in run("--date", "2020-01-01")[1]["says"]
    assert says not in run("--date", f"{datetime.now(UTC):%Y-%m-%d}")[1]["says"]


def test_readings_in_another_unit_are_refused(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [str(folder / "cal.json"), str(folder / "today.csv")]
    assert cli.main(["recheck", *files, "--accel-unit", "count"]) == 2
    assert "calibrated in m/s^2" in capsys.readouterr().err.splitlines()[-1]


def named(folder: Path, place: Path, device: dict[str, str]) -> Path:
    """The calibration with a device."""
    loose = json.loads((folder / "cal.json").read_text()) | {"device": device}
    place.write_text(json.dumps(loose))
    return place


@pytest.mark.parametrize(
    ("columns", "times", "verdict", "says"),
    [
        (
            ("ax", "ay", "az"),
            1.0 / 9.80665,
            "insufficient",
            "the accelerations are in g; give g as their unit",
        ),
        (("gx", "gy", "gz"), 0.5, "no-go", "the range set in the device is 2 times wider"),
        (
            ("gx", "gy", "gz"),
            180.0 / np.pi,
            "no-go",
            "the readings are in deg/s and were taken for rad/s",
        ),
        (
            ("gx", "gy", "gz"),
            np.pi / 180.0,
            "no-go",
            "the readings are in rad/s and were taken for deg/s",
        ),
    ],
)
def test_readings_in_a_unit_or_range_that_was_stated_wrongly_are_told_with_what_explains_them(
    run: Run,
    folder: Path,
    tmp_path: Path,
    columns: tuple[str, ...],
    times: float,
    verdict: str,
    says: str,
) -> None:
    """Nothing is right where gravity is misread; rates may be too far off for a fit."""
    lines = (folder / "today.csv").read_text().splitlines()[1:]
    names = [name.partition("[")[0] for name in lines[0].split(",")]
    table = np.array([line.split(",") for line in lines[1:]], float)
    table[:, [names.index(column) for column in columns]] *= times
    file = tmp_path / "wrong.csv"
    np.savetxt(file, table, delimiter=",", header=lines[0], comments="", fmt="%.7f")
    status, found = run(file=file)
    assert (status, found["verdict"]) == (1, verdict)
    assert found["says"].count(says) == 1
    assert "not seen" not in found["says"]
    assert "Calibrate the device again" not in found["says"]
    sensor = "accelerometer" if "ax" in columns else "gyroscope"
    assert found["sensors"][sensor]["moved"] == []
    if verdict == "insufficient":
        assert found["sensors"][sensor]["error"] is None


def test_one_axis_that_reads_a_third_is_a_fault_and_no_other_range(
    run: Run, folder: Path, tmp_path: Path
) -> None:
    found = run(file=changed(folder, tmp_path / "weak.csv", "gx", times=1.0 / 3.0))[1]
    assert found["verdict"] == "no-go"
    assert found["sensors"]["gyroscope"]["moved"]


def test_a_gyroscope_that_is_mounted_anew_has_turned_and_not_another_scale(
    run: Run, folder: Path, tmp_path: Path
) -> None:
    """By 0.01 rad about z."""
    lines = (folder / "today.csv").read_text().splitlines()[1:]
    names = [name.partition("[")[0] for name in lines[0].split(",")]
    table = np.array([line.split(",") for line in lines[1:]], float)
    columns = [names.index(column) for column in ("gx", "gy")]
    turn = np.array([[np.cos(0.01), np.sin(0.01)], [-np.sin(0.01), np.cos(0.01)]])
    table[:, columns] = table[:, columns] @ turn.T
    file = tmp_path / "turned.csv"
    np.savetxt(file, table, delimiter=",", header=lines[0], comments="", fmt="%.7f")
    status, found = run(file=file)
    assert (status, found["verdict"]) == (1, "no-go")
    moved = {one["parameter"]: one["by"] for one in found["sensors"]["gyroscope"]["moved"]}
    assert {*moved} <= {"cross_xy", "cross_yx"}
    assert moved["cross_xy"] == pytest.approx(-0.01, abs=0.001)


def test_clipped_readings_are_no_change_of_the_device(
    run: Run, folder: Path, tmp_path: Path
) -> None:
    lines = (folder / "today.csv").read_text().splitlines()[1:]
    names = [name.partition("[")[0] for name in lines[0].split(",")]
    table = np.array([line.split(",") for line in lines[1:]], float)
    column = names.index("az")
    table[:, column] = np.minimum(table[:, column], 9.0)
    file = tmp_path / "clipped.csv"
    np.savetxt(file, table, delimiter=",", header=lines[0], comments="", fmt="%.7f")
    status, found = run(file=file)
    assert (status, found["verdict"]) == (1, "insufficient")
    assert "the end of its range" in found["says"]
    assert found["sensors"]["accelerometer"]["moved"] == []


def test_what_is_no_verdict_on_the_device_is_not_kept_in_its_history(
    folder: Path, tmp_path: Path
) -> None:
    place = named(folder, tmp_path / "named.json", {"name": "IMU 7"})
    known = CalibratedDevice(read_calibration(place), RecheckSettings(datetime.now(UTC)))
    found = unreadable_recheck(known, "the device was never at rest")
    document, kept = recheck_document(found, place.name), tmp_path / "kept"
    for checked, says in (
        (Description("IMU 7"), "not kept in the history of IMU 7: nothing could be judged"),
        (
            Description("virtual IMU", "seed 0"),
            "not kept in the history of IMU 7: another device was checked, virtual IMU, seed 0",
        ),
    ):
        assert kept_recheck(known, found, document, kept, checked) == [says]
    unnamed = CalibratedDevice(read_calibration(folder / "cal.json"), known.settings)
    (said,) = kept_recheck(unnamed, found, document, kept)
    assert said == "not kept in a history: the calibration names no device"
    assert not kept.exists()


def test_the_limit_changes_as_little_as_the_age_of_the_calibration(folder: Path) -> None:
    """A session that is opened again an hour later shows the figures of its first verdict."""
    made, readings = read_calibration(folder / "cal.json"), iw.read(folder / "today.csv").readings
    limits = []
    for minutes in (60, 61, 62):
        now = datetime.now(UTC) + timedelta(minutes=minutes)
        known = CalibratedDevice(made, RecheckSettings(now))
        for name, one in known.sensors.items():  # so far off that drift makes the limit
            known.sensors[name] = replace(one, temperature=(one.temperature or 25.0) + 4.0)
        limits.append(recheck_readings(known, readings).sensors["accelerometer"].limit)
    assert limits[0] > 2.5 * MILLI_G
    assert limits == pytest.approx([limits[0]] * 3, rel=1e-4)


def test_the_limit_does_not_depend_on_the_unit_of_the_readings(folder: Path) -> None:
    """Variances of gains and of biases in counts of 24 bits differ by many powers of ten."""
    known = CalibratedDevice(
        read_calibration(folder / "cal.json"), RecheckSettings(datetime.now(UTC))
    ).sensors["accelerometer"]
    per_count = 4.0 * STANDARD_GRAVITY / 2**24
    step = np.repeat([per_count, 1.0 / per_count], [9, 3])
    plain = known.calibration
    counts = replace(
        known,
        calibration=Parameters(plain.matrix * per_count, plain.bias / per_count, plain.sizes),
        unit="count",
        covariance=known.covariance * np.outer(step, step),
    )
    errors = [
        DetectionPower(one, 0.0 * one.covariance, STANDARD_GRAVITY, 0.01).errors(one.covariance)
        for one in (known, counts)
    ]
    assert errors[1] == pytest.approx(errors[0], rel=1e-6)


def test_an_accelerometer_that_has_changed_accuses_no_magnetometer(
    with_field: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The up direction is then wrong, and with it the dip."""
    path, saved, now = with_field / "a.csv", with_field / "cal.json", tmp_path / "now.csv"
    rows = [line.split(",") for line in path.read_text().splitlines()]
    for row in rows:
        if row[0][0].isdigit():
            row[1] = f"{float(row[1]) + 0.5:.6f}"
    now.write_text("\n".join(map(",".join, rows)))
    capsys.readouterr()
    assert cli.main(["recheck", str(saved), str(now), "--json", "-"]) == 1
    sensors = json.loads(capsys.readouterr().out)["sensors"]
    assert sensors["accelerometer"]["verdict"] == "no-go"
    assert sensors["magnetometer"]["verdict"] == "go"
    assert sensors["magnetometer"]["says"].startswith("magnitude varies by")


@pytest.mark.parametrize(
    ("columns", "iron", "seconds", "says"),
    [
        ("y x z", 0.0, 60.0, "its axes differ from the calibration's: x and y are swapped"),
        ("x y -z", 0.0, 60.0, "its axes differ from the calibration's: z points the other way"),
        ("x y -z", 0.0, 26.0, "vary by"),
        ("x y z", 50.0, 60.0, "vary by"),
        ("x y z", -30.0, 26.0, "vary by"),
        ("x y z", 50.0, 26.0, "vary by"),
    ],
)
def test_other_axes_of_a_magnetometer_are_told_only_where_they_make_it_a_go(
    with_field: Path, tmp_path: Path, columns: str, iron: float, seconds: float, says: str
) -> None:
    """The first 26 s show the field on too few axes, and agree with other axes by chance.

    A hard iron moved by tens of µT is then no axis that points the other way.
    """
    lines = (with_field / "a.csv").read_text().splitlines()[1:]
    names = [name.partition("[")[0] for name in lines[0].split(",")]
    table = np.array([line.split(",") for line in lines[1:]], float)
    table = table[table[:, 0] < seconds]
    found = table.copy()
    for name, other in zip("xyz", columns.split(), strict=True):
        sign = -1.0 if other.startswith("-") else 1.0
        found[:, names.index(f"m{name}")] = sign * table[:, names.index(f"m{other[-1]}")]
    found[:, names.index("mx")] += iron
    now = tmp_path / "now.csv"
    np.savetxt(now, found, delimiter=",", header=lines[0], comments="", fmt="%.7f")
    known = CalibratedDevice(
        read_calibration(with_field / "cal.json"), RecheckSettings(datetime.now(UTC))
    )
    magnetometer = recheck_readings(known, iw.read(now).readings).sensors["magnetometer"]
    assert magnetometer.verdict is RecheckVerdict.NO_GO
    assert says in magnetometer.says


@pytest.mark.parametrize(
    ("sensor", "term", "unit"),
    [
        ("accelerometer", "bias-temperature", "mg/°C"),
        ("accelerometer", "my-square", "mm/s²"),
        ("magnetometer", "bias-temperature", "µT/°C"),
        ("magnetometer", "current", "µT/A"),
    ],
)
def test_a_field_is_judged_beside_effects_of_more_than_the_reading(
    with_field: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], sensor: str,
    term: str, unit: str,
) -> None:  # fmt: skip
    loose = json.loads((with_field / "cal.json").read_text())
    names = ["x"] if term == "my-square" else ["x", "y", "z"]
    effect: dict[str, Any] = {"term": term, "sensor": sensor, "equation": "", "unit": unit}
    effect |= {"parameters": names, "sizes": [0.0] * len(names), "reference_temperature": 25.0}
    loose["sensors"][sensor]["effects"] = [effect]
    place, own = tmp_path / "more.json", tmp_path / "own.py"
    place.write_text(json.dumps(loose))
    own.write_text(OWN_EFFECT)
    judged = []
    for file in (with_field / "cal.json", place):
        capsys.readouterr()
        words = ["recheck", str(file), str(with_field / "a.csv"), "--effects", str(own)]
        assert cli.main([*words, "--json", "-"]) == 1
        judged.append(json.loads(capsys.readouterr().out)["sensors"]["magnetometer"])
    assert judged[1] == judged[0]
    assert judged[0]["verdict"] == "go"


def test_a_magnetometer_without_readings_is_said_to_be_unchecked(folder: Path) -> None:
    plain = read_calibration(folder / "cal.json")
    field = msgspec.structs.replace(plain["accelerometer"], unit="uT", bias_unit="uT")
    whole = msgspec.structs.replace(plain, sensors={**plain.sensors, "magnetometer": field})
    units, measured = {"accelerometer": "m/s^2"}, RecheckData((), (), 0.0)
    for made, count in ((plain, 0), (whole, 1)):
        known = CalibratedDevice(made, RecheckSettings(datetime.now(UTC)))
        says = known.recheck(measured, units).says
        assert says.count("The magnetometer was not checked") == count


def test_the_virtual_imu_is_another_device(folder: Path, tmp_path: Path) -> None:
    place = named(folder, tmp_path / "named.json", {"name": "IMU 7", "serial": "77"})
    services = WizardServices(WizardOptions(sessions=tmp_path / "kept", recheck=place))
    source = services.open_source(SourceChoice(SourceKind.VIRTUAL))
    source.start()
    source.stop()
    assert services.sources.known is not None
    assert not services.sources.known.is_of(services.description)


def test_the_verdict_is_kept_in_the_history_of_the_device(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = named(folder, tmp_path / "named.json", {"name": "IMU 7"})
    words = [str(place), str(folder / "today.csv"), "--sessions", str(tmp_path / "kept")]
    assert cli.main(["recheck", *words]) == 0
    capsys.readouterr()
    with Catalogue(tmp_path / "kept") as catalogue:
        (past,) = catalogue.history("IMU 7").rechecks
    assert (past.verdict, past.calibration) == ("go", "named.json")
    assert past.document["schema"] == "imucal-wizard/recheck/1"


def test_a_verdict_is_given_where_the_history_cannot_be_written(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = named(folder, tmp_path / "named.json", {"name": "IMU 7"})
    (tmp_path / "blocked").write_text("in the way")
    words = [str(place), str(folder / "today.csv"), "--sessions", str(tmp_path / "blocked" / "in")]
    assert cli.main(["recheck", *words]) == 0
    said = capsys.readouterr()
    assert said.out.startswith("GO")
    assert "not kept in the history of IMU 7: " in said.err
    assert "cannot be written" in said.err


def test_a_session_is_judged_by_the_holds_that_the_wizard_kept(
    run: Run, folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The figures of the verdict's screen; the history keeps them once."""
    calibration = read_calibration(folder / "cal.json")
    known = CalibratedDevice(calibration, RecheckSettings(datetime.now(UTC)))
    path = tmp_path / "kept" / "a.imucal"
    path.parent.mkdir()
    settings = ProcedureSettings(Procedure(RECHECK_STEPS))
    engine = begin_session(path, None, settings, planner=known.next_pose)
    engine.command("start")
    lines = (folder / "today.csv").read_bytes().splitlines(keepends=True)
    for first in range(0, len(lines), 25):
        engine.receive(b"".join(lines[first : first + 25]), 0.01 * first)
    engine.close()
    snapshot, kept = engine.snapshot(), engine.collected()
    assert snapshot.status.step is StepKind.VERDICT
    readings = session_readings(path, kept.holds)
    args = kept, snapshot.stream, snapshot.status.elapsed, readings
    on_screen = recheck_collected(known, *args).sensors
    place = named(folder, tmp_path / "named.json", {"name": "IMU 7"})
    command = ["recheck", str(place), str(path), "--sessions", str(path.parent)]
    for _ in range(2):
        assert cli.main([*command, "--json", "-"]) == 0
        found = json.loads(capsys.readouterr().out)
        assert found["session"] == path.name
        for name, one in on_screen.items():  # but for the age of the calibration, in seconds
            assert found["sensors"][name]["error"] == pytest.approx(one.error, rel=1e-9)
    assert run("--all-samples", file=path)[1]["sensors"] != found["sensors"]
    with Catalogue(path.parent) as catalogue:
        (past,) = catalogue.history("IMU 7").rechecks
        (session,) = catalogue.sessions()
    assert (past.session, session.recheck, session.finished) == (path.name, "go", True)


def test_a_session_of_another_device_is_refused(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = named(folder, tmp_path / "named.json", {"name": "IMU 7", "serial": "5F3A"})
    path = tmp_path / "a.imucal"
    Session.create(path, {"source": "port", "description": {"serial": "77AB"}}).close()
    assert cli.main(["recheck", str(place), str(path)]) == 2
    assert "of the device 5F3A, and these readings are of 77AB" in capsys.readouterr().err


def test_the_text_says_what_has_moved_since_when(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = changed(folder, tmp_path / "changed.csv", "ax", 5.0 * MILLI_G)
    assert cli.main(["recheck", str(folder / "cal.json"), str(file)]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith("NO-GO")
    (moved,) = (line for line in lines if "bias_x" in line and "mg (" in line)
    found = re.search(r"([\d.]+) ± ([\d.]+) mg \((\d+) σ\) since 20", moved)
    assert found
    by, error, errors = map(float, found.groups())
    assert errors == pytest.approx(by / error, rel=0.05)
    assert max(map(len, lines)) <= 80
