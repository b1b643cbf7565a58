"""``imucal-wizard bench`` as a person and a script meet it."""

import json
from contextlib import redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from imucal_wizard.api import load
from imucal_wizard.cli import main as cli
from imucal_wizard.model.effects.second_order import SecondOrder
from imucal_wizard.report.calibration_file import read_calibration
from imucal_wizard.simulate.recording import simulate_recording
from tests.cli.flat import flat_recording
from tests.model.restless import restless

pytestmark = pytest.mark.usefixtures("rough_sizes_throughout")

KEYS = {
    "model",
    "degrees_of_freedom",
    "ladder",
    "suspects",
    "explanations",
    "verdict",
    "disturbed_holds",
    "next_poses",
}
RUNG = {"model", "added", "rms_fitted", "rms_held_out", "floor", "floor_fitted"}
SUSPECT = {"term", "p", "size", "standard_error", "unit", "rms_after", "rms_held_out_after"}


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """18 poses of an accelerometer that hides a second-order term on x; no gyroscope."""
    folder = tmp_path_factory.mktemp("hidden")
    whole, path = folder / "whole.csv", folder / "accelerometer.csv"
    simulate_recording(whole, hidden=["second-order:5:x"], seed=4, rotations=0)
    lines = [line.split(",") for line in whole.read_text().splitlines() if line[0] != "#"]
    columns = [lines[0].index(name) for name in lines[0] if not name.startswith("g")]
    path.write_text("\n".join(",".join(line[k] for k in columns) for line in lines) + "\n")
    return path


@pytest.fixture(scope="module")
def plain(recording: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], str]:
    """What ``bench`` writes and prints of it without options."""
    path = tmp_path_factory.mktemp("plain") / "bench.json"
    with redirect_stdout(StringIO()) as printed:
        assert cli.main(["bench", str(recording), "--json", str(path)]) == 0
    return json.loads(path.read_text())["sensors"]["accelerometer"], printed.getvalue()


def bench_json(
    capsys: pytest.CaptureFixture[str], *arguments: str, status: int = 0
) -> dict[str, Any]:
    """The sensors of the one document that ``bench --json -`` writes."""
    assert cli.main(["bench", *arguments, "--json", "-"]) == status
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "imucal-wizard/bench/1"
    sensors = document["sensors"]
    assert isinstance(sensors, dict)
    return sensors


def test_a_hidden_effect_is_named_added_and_the_error_held_out_falls(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "my.json"
    said = bench_json(capsys, str(recording), "--auto", "--save", str(path))["accelerometer"]
    assert load(path)["accelerometer"].effects[0].term == "second-order"
    assert said["verdict"] in ("complete", "ambiguous")
    assert [one["term"] for one in said["found"]] == ["second-order"]
    assert said["suspects"][0]["term"] == "second-order"
    assert said["suspects_of"] == ["bias", "scale", "non-orthogonality"]
    assert said["model"] == ["bias", "scale", "non-orthogonality", "second-order"]
    first, last = said["ladder"]
    assert first["added"] is None
    assert last["added"] == "second-order"
    assert last["rms_held_out"] < 0.2 * first["rms_held_out"]
    found = said["parameters"]["second-order_x"]
    assert abs(found["value"] - 5.0) < 4.5 * found["standard_error"]
    assert "second-order" in said["says"]
    # the error that may be hidden is that of the model in the file, not of the one before it
    same = tmp_path / "same.json"
    cli.main(["bench", str(recording), "--add", "second-order", "--save", str(same)])
    assert load(path)["accelerometer"].could_be == load(same)["accelerometer"].could_be


def test_a_guess_is_compared_with_the_evidence(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["bench", str(recording), "--guess", "second-order:x:+"]) == 0
    assert [line[0] for line in capsys.readouterr().out.splitlines()] == ["✓", "✓", "✓"]
    assert cli.main(["bench", str(recording), "--guess", "third-order:x", "--json", "-"]) == 0
    first = json.loads(capsys.readouterr().out)["answers"][0]
    assert (first["agreement"], first["guess"]) == ("wrong", "third-order")


@pytest.mark.parametrize("guess", ["second-order:x:5:6", ":x", "no-such-effect", "gyroscope/bias"])
def test_a_guess_of_another_form_is_wrong_usage(
    recording: Path, guess: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["bench", str(recording), "--guess", guess]) == 2
    said = capsys.readouterr().err
    assert "guess" in said or "to judge" in said


def test_the_document_has_every_key_of_its_contract(plain: tuple[dict[str, Any], str]) -> None:
    said, _ = plain
    assert KEYS | {"says"} <= said.keys()
    assert said["ladder"][0].keys() >= RUNG
    for suspect in said["suspects"]:
        assert SUSPECT | {"detectable", "nameable", "told_apart", "like"} <= suspect.keys()
        assert suspect["nameable"] is None or suspect["nameable"] >= suspect["detectable"]
        for what in ("detectable", "nameable"):
            interval = suspect[f"{what}_interval"]
            assert (interval is None) == (suspect[what] is None)
            assert interval is None or interval[0] < suspect[what] < interval[1]
        assert len(suspect["detectable_by_parameter"]) == len(suspect["parameters"])
        assert suspect["seen_from"]
        assert len(suspect["size"]) == len(suspect["standard_error"])
    for key in ("within_holds", "rounding", "repeats"):
        assert said["noise"][key] > 0.0


def test_what_the_verdict_names_is_told_apart_from_what_is_like_it(
    plain: tuple[dict[str, Any], str],
) -> None:
    said, _ = plain
    assert said["verdict"] == "missing"
    by_term = {one["term"]: one for one in said["suspects"]}
    named = by_term["second-order"]
    assert named["like"]
    assert all(by_term[term]["told_apart"] for term in ("second-order", *named["like"]))


def test_without_auto_nothing_is_added(plain: tuple[dict[str, Any], str]) -> None:
    said, _ = plain
    assert said["model"] == ["bias", "scale", "non-orthogonality"]
    assert len(said["ladder"]) == 1


def test_the_base_can_be_climbed_term_by_term(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Bias alone, then scale, then non-orthogonality, then the effect: each helps."""
    climb = ["--base", "bias", "--add", "scale", "--add", "non-orthogonality"]
    said = bench_json(capsys, str(recording), *climb, "--add", "second-order")["accelerometer"]
    errors = [rung["rms_fitted"] for rung in said["ladder"]]
    assert [rung["added"] for rung in said["ladder"]][1:] == [*climb[3::2], "second-order"]
    assert errors == sorted(errors, reverse=True)


def test_the_text_shows_comparison_suspects_and_ladder(plain: tuple[dict[str, Any], str]) -> None:
    _, text = plain
    for word in ("COMPARE", "SUSPECTS", "LADDER", "held out", "noise", "second-order"):
        assert word in text
    assert max(len(line) for line in text.splitlines()) <= 100


def test_an_effect_of_ones_own_is_a_suspect_like_any_other(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    own = tmp_path / "own.py"
    own.write_text(
        "import numpy as np\n"
        "from imucal_wizard.model.effect import Effect, EffectParameter\n"
        "class Own(Effect):\n"
        "    name, sensors, kind = 'my-square', ('accelerometer',), 'orientation'\n"
        "    title, equation = 'a square of my own', 'K x_x^2'\n"
        "    def parameters(self, sensor):\n"
        "        return (EffectParameter('x', 'mm/s²', 20.0),)\n"
        "    def columns(self, sensor, c, variant=None):\n"
        "        made = np.zeros((len(c), 3, 1))\n"
        "        made[:, 0, 0] = 1e-3 * (c.force[:, 0] / c.gravity) ** 2\n"
        "        return made\n"
    )
    options = ["--effects", str(own), "--add", "my-square"]
    said = bench_json(capsys, str(recording), *options)["accelerometer"]
    assert said["model"][-1] == "my-square"
    found = said["parameters"]["my-square_x"]
    assert abs(found["value"] - 5.0 * 9.80665) < 4.5 * found["standard_error"]


def test_too_few_directions_are_insufficient_in_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """No model is carried; the poses needed are listed. There is nothing to save."""
    path = str(flat_recording(tmp_path))
    said = bench_json(capsys, path)["accelerometer"]
    bench_json(capsys, path, "--save", str(tmp_path / "cal.json"), status=1)
    bench_json(capsys, path, "--add", "second-order", status=1)
    assert not (tmp_path / "cal.json").exists()
    assert said["verdict"] == "insufficient"
    assert said["model"] == said["ladder"] == said["suspects"] == []
    assert "six" in said["says"]
    assert len(said["next_poses"]) >= 11


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["--add", "magic"], "magic"),
        (["--add", "g-sensitivity"], "gyroscope/g-sensitivity"),
        (["--add", "gyroscope/g-sensitivity"], "no gyroscope"),
        (["--add", "barometer/drift"], "barometer"),
        (["--base", "bias,magic"], "magic"),
        (["--effects", "no-such-file.py"], "no-such-file.py"),
    ],
)
def test_wrong_usage_is_one_clear_line_and_exit_status_two(
    arguments: list[str], says: str, recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["bench", str(recording), *arguments]) == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.count("\n") == 1
    assert says in captured.err


def test_a_term_that_these_data_cannot_show_is_refused_with_the_reason(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--add", "vibration-rectification", "--json", "-"]
    assert cli.main(["bench", str(recording), *options]) == 1
    captured = capsys.readouterr()
    assert "quiet" in json.loads(captured.out)["error"]
    assert captured.err.count("\n") == 1


def test_a_picture_is_printed_as_text_and_as_data(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["bench", str(recording), "--view", "force-x"]) == 0
    text = capsys.readouterr().out
    assert text.startswith("ACCELEROMETER  holds: |a| − g, mg")
    assert "force along x, g" in text
    assert max(map(len, text.splitlines())) <= 79
    assert cli.main(["bench", str(recording), "--view", "model-x-force-x", "--json", "-"]) == 0
    (view,) = json.loads(capsys.readouterr().out)["views"]
    assert len(view["x"]) == len(view["y"]) == len(view["model"]) == len(view["source"])
    assert view["x"] == sorted(view["x"])


@pytest.mark.parametrize("options", [["--view", "force-x"], ["--guess", "second-order:x"]])
def test_a_calibration_is_saved_beside_a_picture_and_a_guess(
    recording: Path, tmp_path: Path, options: list[str]
) -> None:
    saved = tmp_path / "saved.json"
    words = ["bench", str(recording), *options, "--add", "second-order", "--save", str(saved)]
    assert cli.main(words) == 0
    assert "second-order" in read_calibration(saved)["accelerometer"].model


def test_a_picture_and_a_guess_are_two_outputs(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["bench", str(recording), "--view", "list", "--guess", "second-order:x"]) == 2
    assert "give one of them" in capsys.readouterr().err


def test_the_picture_of_a_suspect_has_the_slope_of_its_size(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["bench", str(recording), "--view", "suspect-second-order", "--json", "-"]) == 0
    (view,) = json.loads(capsys.readouterr().out)["views"]
    assert view["slope"] == pytest.approx(5.0, abs=0.4)


def test_the_names_of_the_pictures_are_listed_also_after_a_wrong_one(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.main(["bench", str(recording), "--view", "list"]) == 0
    assert {"accelerometer", "force-x", "model-z-time", "suspect-hysteresis"} <= set(
        capsys.readouterr().out.split()
    )
    assert cli.main(["bench", str(recording), "--view", "force"]) == 2
    answer = capsys.readouterr().err
    assert "force-x" in answer
    assert "suspect-TERM" in answer
    assert len(answer) < 400


def test_a_guess_of_a_parameter_that_the_effect_lacks_is_refused(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["bench", str(recording), "--guess"]
    assert cli.main([*arguments, "second-order:q"]) == 2
    assert "second-order has no parameter 'q'; it has x, y, z" in capsys.readouterr().err
    assert cli.main([*arguments, "second-order:x:+"]) == 0
    assert capsys.readouterr().out.count("✓ you") == 3


def test_no_axis_is_said_to_stand_out_where_nothing_is_missing(
    recording: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["bench", str(recording), "--add", "second-order", "--guess", "asymmetry:x:+"]
    assert cli.main(arguments) == 0
    printed = capsys.readouterr().out
    assert "nothing is missing" in printed
    assert "stands out" not in printed


def test_a_term_that_cannot_be_fitted_is_refused_in_words(
    recording: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    restless(monkeypatch, SecondOrder)
    assert cli.main(["bench", str(recording), "--add", "second-order", "--json", "-"]) == 1
    said = capsys.readouterr()
    assert json.loads(said.out)["error"] in said.err
    assert "second-order cannot be fitted to these data" in said.err


def test_a_clock_that_jumps_is_told_beside_the_step_of_the_scales(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The times pass 0.6 % slower from the middle on: all rates are wrong by the same share."""
    path = tmp_path / "jump.csv"
    simulate_recording(path, seed=5, rate=50.0)
    lines = path.read_text().splitlines()
    head, rows = lines[:2], [line.split(",") for line in lines[2:]]
    middle = 0.5 * float(rows[-1][0])
    for row in rows:
        late = max(float(row[0]) - middle, 0.0)
        row[0] = f"{float(row[0]) + 0.006 * late:.6f}"
    path.write_text("\n".join([*head, *(",".join(row) for row in rows)]) + "\n")
    said = bench_json(capsys, str(path), "--auto")["gyroscope"]
    assert "scale-step" in [one["term"] for one in said["found"]]
    assert "All three scales change alike: a clock that changes" in said["says"]


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A session with nothing hidden."""
    path = tmp_path_factory.mktemp("honest") / "honest.csv"
    simulate_recording(path, seed=3, rate=50.0)
    return path


def test_an_added_effect_that_noise_alone_may_make_is_said_to_be_one(
    honest: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The likeliest of some forty moments takes up a little noise; no verdict may pass over it."""
    said = bench_json(capsys, str(honest), "--add", "bias-step")["accelerometer"]
    assert "These data do not show bias-step" in said["says"]
    assert "settings." in said["says"]
    assert said["says"].count("Take it out") == 1


def test_axes_that_no_mounting_makes_are_no_good_calibration(
    honest: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "mirrored.csv"
    lines = honest.read_text().splitlines()
    names = [one.partition("[")[0] for one in lines[1].split(",")]
    rows = np.array([line.split(",") for line in lines[2:]], float)
    rows[:, names.index("gz")] *= -1.0
    rest = (",".join(f"{value:.7f}" for value in row) for row in rows)
    path.write_text("\n".join([*lines[:2], *rest]) + "\n")
    assert cli.main(["fit", str(path)]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "No mounting does this" in said
    assert "gyroscope DOUBTFUL" in said
    assert "its axes do not match the accelerometer's" in said
