"""``diff``: calibrations against each other and against a reference."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from scipy import stats

from imucal_wizard.cli import main as cli
from imucal_wizard.report.calibration_file import Calibration, Device, Value
from tests.report.devices import calibration


def saved(
    path: Path,
    values: Mapping[str, tuple[float, float | None]],
    unit: str = "m/s^2",
    device: str = "a",
) -> Path:
    """A calibration with these parameters of the accelerometer, 20 degrees of freedom."""
    made: Calibration = calibration(felt=False)
    parameters = {name: Value(v, unit, e) for name, (v, e) in values.items()}
    scales = [1.0 / values.get(f"sensitivity_{axis}", (1.0, 0.0))[0] for axis in "xyz"]
    sensor = msgspec.structs.replace(
        made["accelerometer"],
        matrix=np.diag(scales).tolist(),
        bias=[values.get(f"bias_{axis}", (0.0, 0.0))[0] for axis in "xyz"],
        parameters=parameters,
        degrees_of_freedom=20,
    )
    sensors, about = {"accelerometer": sensor}, Device(name=device)
    measured: dict[str, Any] = {"hold_means": [], "rotation_increments": [], "field_means": []}
    one = msgspec.structs.replace(made, sensors=sensors, device=about, **measured)
    return one.save(path)


def difference(
    capsys: pytest.CaptureFixture[str], *files: Path
) -> tuple[dict[str, dict[str, Any]], list[str]]:
    """What the command says of the accelerometer, and its notes."""
    assert cli.main(["diff", *map(str, files), "--json", "-"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "imucal-wizard/diff/1"
    return document["sensors"]["accelerometer"], document["notes"]


def test_two_calibrations_differ_by_their_errors_together(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = saved(tmp_path / "a.json", {"bias_x": (0.20, 0.003), "bias_y": (0.1, 0.01)})
    second = saved(tmp_path / "b.json", {"bias_x": (0.21, 0.004), "bias_y": (0.1, 0.01)})
    found, notes = difference(capsys, first, second)
    one = found["bias_x"]
    assert (one["values"], one["standard_errors"]) == ([0.20, 0.21], [0.003, 0.004])
    assert one["difference"] == pytest.approx(0.01)
    assert one["standard_error"] == pytest.approx(0.005)
    assert one["per_cent"] == pytest.approx(5.0)
    freedom = 0.005**4 / ((0.003**4 + 0.004**4) / 20)
    assert one["p"] == pytest.approx(2.0 * stats.t.sf(2.0, int(freedom)), rel=1e-6)
    assert found["bias_y"]["p"] == pytest.approx(1.0)
    assert notes == []
    assert cli.main(["diff", str(first), str(second)]) == 0
    said = capsys.readouterr().out
    assert "▸ 0 of 2 parameters differ\n  (p < 0.01; 0.02 expected by chance)" in said
    row = next(line.split() for line in said.splitlines() if "bias_x" in line)
    assert row == ["bias_x", "[mg]", "20.39", "21.41", "1.02", "±", "0.51", "5.0", "0.053"]


def test_two_calibrations_of_the_same_readings_have_errors_in_common(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By one reading that both have, or by the fingerprint of the recording."""
    values = {"bias_x": (0.2, 0.003)}
    files = [saved(tmp_path / f"{name}.json", values) for name in "ab"]
    assert difference(capsys, *files)[1] == []
    field = msgspec.to_builtins(calibration().field_means[:1])
    for same in ({"field_means": field}, {"field_means": [], "fingerprint": "sha256:1"}):
        for path in files:
            path.write_text(json.dumps(json.loads(path.read_text()) | same))
        notes = difference(capsys, *files)[1]
        assert ["share measurements" in note for note in notes] == [True]
        assert cli.main(["diff", *map(str, files)]) == 0
        assert "expected by chance" not in capsys.readouterr().out


def test_other_gravities_are_told_as_the_reason_of_other_sensitivities(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """9.808 and 9.80665 m/s² are 0.014 % apart."""
    first, second = (saved(tmp_path / f"{n}.json", {"bias_x": (0.2, 0.003)}) for n in "ab")
    assert difference(capsys, first, second)[1] == []
    gravity = {"gravity": {"value": 9.808, "unit": "m/s^2"}}
    second.write_text(json.dumps(json.loads(second.read_text()) | gravity))
    (note,) = difference(capsys, first, second)[1]
    assert "9.80665 and 9.80800 m/s²" in note
    assert "0.014 %" in note


def test_a_calibration_without_an_error_is_not_exact(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """As of a parameter that its poses do not determine; a certificate's number is exact."""
    first = saved(tmp_path / "a.json", {"bias_x": (0.20, None)})
    second = saved(tmp_path / "b.json", {"bias_x": (0.21, 0.004)})
    one = difference(capsys, first, second)[0]["bias_x"]
    assert (one["standard_errors"], one["standard_error"], one["p"]) == ([None, 0.004], None, None)


def test_the_scatter_of_ten_sets_stands_beside_the_one_predicted(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    random = np.random.default_rng(7)
    calm, wild = 0.002 * random.standard_normal(10), 0.01 * random.standard_normal(10)
    files = [
        saved(tmp_path / f"{k}.json", {"bias_x": (0.2 + x, 0.002), "bias_y": (0.2 + y, 0.002)})
        for k, (x, y) in enumerate(zip(calm.tolist(), wild.tolist(), strict=True))
    ]
    found, _ = difference(capsys, *files)
    for name, values, usual in (("bias_x", calm, True), ("bias_y", wild, False)):
        one = found[name]
        deviation = np.std(values, ddof=1)
        assert one["mean"] == pytest.approx(0.2 + values.mean())
        assert one["standard_deviation"] == pytest.approx(deviation)
        assert one["predicted_standard_deviation"] == pytest.approx(0.002)
        p = stats.f.sf((deviation / 0.002) ** 2, 9, 200)
        assert one["p"] == pytest.approx(p, rel=1e-3)
        assert (one["p"] > 0.01) == usual
    assert cli.main(["diff", *map(str, files)]) == 0
    said = capsys.readouterr().out
    assert "▸ 1 of 2 parameters scatter more" in said
    assert "predicted" in said


@pytest.mark.parametrize("kind", ["toml", "json"])
def test_a_certificate_is_a_reference(
    kind: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With an expanded uncertainty, in another unit, or a number alone, which is exact."""
    mine = saved(tmp_path / "a.json", {"bias_x": (0.2, 0.003), "bias_y": (0.1, 0.01)})
    g = 9.80665
    table = {"value": 20.0, "uncertainty": 1.0, "k": 2.0, "unit": "mg"}
    path = tmp_path / f"certificate.{kind}"
    if kind == "toml":
        rows = "\n".join(f"{key} = {json.dumps(value)}" for key, value in table.items())
        head = 'name = "no. 17"\n[accelerometer]\nbias_y = 0.1\n[accelerometer.bias_x]\n'
        path.write_text(head + rows)
    else:
        path.write_text(json.dumps({"accelerometer": {"bias_x": table, "bias_y": 0.1}}))
    found, _ = difference(capsys, mine, path)
    assert found["bias_x"]["values"][1] == pytest.approx(0.02 * g)
    assert found["bias_x"]["standard_errors"][1] == pytest.approx(0.0005 * g)
    assert found["bias_y"]["standard_errors"] == [0.01, None]
    assert found["bias_y"]["standard_error"] == pytest.approx(0.01)


def test_other_devices_and_parameters_of_one_file_alone_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    first = saved(tmp_path / "a.json", {"bias_x": (0.2, 0.003), "bias_y": (0.1, 0.01)})
    second = saved(tmp_path / "b.json", {"bias_x": (0.2, 0.003)}, device="b")
    found, notes = difference(capsys, first, second)
    assert list(found) == ["bias_x"]
    assert "different devices: a, b" in notes[0]
    assert "not in every file: bias_y" in notes[1]


def test_a_file_of_an_older_version_is_compared_with_itself(
    capsys: pytest.CaptureFixture[str],
) -> None:
    old = Path(__file__).parents[1] / "golden" / "data" / "calibration.json"
    found, _ = difference(capsys, old, old)
    assert found["bias_x"]["difference"] == 0.0
    assert found["bias_x"]["p"] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("second", "says"),
    [
        (None, "give two files"),
        (
            "[accelerometer]\nbias_x = { value = 3, unit = 'count' }",
            "only calibrations of",
        ),
        ("[accelerometer]\nbias_q = 3", "no parameter in common"),
        ("[acelerometer]\nbias_x = 3", "names no sensor"),
        ("[accelerometer]\nbias_x = 'three'", "no reference"),
        ("[accelerometer]\nbias_x = true", "no reference"),
        ("[accelerometer]\nbias_x = nan", "no reference"),
        ("[accelerometer]\nbias_x = { value = 1.0, standard_error = -1.0 }", "no reference"),
        ("[accelerometer]\nbias_x = { value = 1.0, uncertainty = 1.0, k = 0 }", "no reference"),
        ("[accelerometer]\nbias_x = { value = 1.0, uncertainty = inf }", "no reference"),
        ("][", "neither a calibration nor a reference"),
    ],
)
def test_what_cannot_be_compared_is_told_in_one_line(
    second: str | None, says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [str(saved(tmp_path / "a.json", {"bias_x": (0.2, 0.003)}))]
    if second is not None:
        (tmp_path / "r.toml").write_text(second)
        files.append(str(tmp_path / "r.toml"))
    assert cli.main(["diff", *files]) == 2
    said = capsys.readouterr().err
    assert says in said
    assert said.count("\n") == 1
