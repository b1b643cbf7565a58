"""One fit: every command, screen and file tells the same figures of the same data and model."""

import functools
import json
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from rich.console import Console
from scipy.signal import butter, sosfilt

import imucal_wizard as iw
from imucal_wizard.api import Recording
from imucal_wizard.cli.fit import parser
from imucal_wizard.cli.main import main
from imucal_wizard.cli.outcome import recording_of
from imucal_wizard.core.output import encode_json
from imucal_wizard.core.quantities import quantity, readable
from imucal_wizard.core.readings import Readings
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.grade import graded
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.recording import FitOptions
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.report.calibration_file import Calibration, Sensor
from imucal_wizard.report.proof import Proof, nominal
from imucal_wizard.run.review import fit_stream
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.panels.report import fit_summary
from imucal_wizard.tui.services import WizardServices
from tests.cli.kept_sessions import printed, sat
from tests.golden.cases import ALIKE_COMMANDS, CASES, EXPECTED, TOLD_ALIKE, located
from tests.golden.figures import differences, figures

FIGURES = ("rms_fitted", "rms_held_out", "floor", "floor_fitted")
JUDGED = ("verdict", "usable", "could_be", "grade", "limit")
"""What a calibration without a diagnosis does not say."""


@dataclass(frozen=True)
class Outputs:
    """What the commands and the Python interface give for one recording.

    Attributes:
        name: of the recording.
        recording: as it was read.
        report: the fit behind it.
        readings: its samples, where they are at hand.
        first: the calibration by the Python interface, without a diagnosis.
        sensors: the same with the verdicts.
        diagnosis: what the data say of each sensor.
        files: arguments of the commands.
        documents: the JSON of each command.
        statuses: the exit status of each command.
        texts: what each command prints.
        file: the calibration that ``fit`` has saved.
    """

    name: str
    recording: Recording
    report: FitReport
    readings: Readings | None
    first: dict[str, Sensor]
    sensors: dict[str, Sensor]
    diagnosis: dict[str, Diagnosis]
    files: tuple[str, ...]
    documents: dict[str, dict[str, Any]]
    statuses: dict[str, int]
    texts: dict[str, str]
    file: Calibration


SHORT = ("second-order", "six-faces", "xsens")
"""Recordings that take a few seconds each; the others run with the studies."""
RECORDINGS = [
    pytest.param(name, marks=() if name in SHORT else pytest.mark.study) for name in TOLD_ALIKE
]


@pytest.fixture(scope="module", params=RECORDINGS)
def outputs(
    request: pytest.FixtureRequest,
    tmp_path_factory: pytest.TempPathFactory,
    no_sizes_throughout: None,  # no recorded figure is a size
) -> Outputs:
    """What the Python interface and the commands tell; real recordings only where they are."""
    del no_sizes_throughout
    case, folder = CASES[request.param], tmp_path_factory.mktemp("outputs")
    words = (*(str(located(file)) for file in case.files), *case.reading.split())
    recording = recording_of(parser().parse_args(words))
    # read once, and fitted once with the same options: to read and replay the longest takes seconds
    recording.fit = functools.cache(recording.fit)  # type: ignore[method-assign]
    fit = iw.calibrate(recording)
    first, diagnosis = fit.calibration.sensors, iw.diagnose(fit)
    documents, statuses, texts, saved = {}, {}, {}, folder / "saved.json"
    for command in ALIKE_COMMANDS:
        path = folder / f"{command}.json"
        saving = ["--save", str(saved)] if command == "fit" else []
        with redirect_stdout(StringIO()) as printed, read_as(recording):
            statuses[command] = main([command, *words, *saving, "--json", str(path)])
        documents[command] = json.loads(path.read_text())
        texts[command] = printed.getvalue()
    sensors = fit.judged(diagnosis).sensors
    return Outputs(
        request.param, recording, fit.report, fit.benches.readings, first, sensors, diagnosis,
        words, documents, statuses, texts, iw.load(saved),
    )  # fmt: skip


@contextmanager
def read_as(recording: Recording) -> Iterator[None]:
    """Let commands find this recording in any file."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("imucal_wizard.api.Recording", lambda *_, **__: recording)
        yield


def record(sensor: Sensor, *, judged: bool = True) -> dict[str, Any]:
    """A calibration as a JSON document has it."""
    document: dict[str, Any] = json.loads(encode_json(sensor))
    return document if judged else {k: v for k, v in document.items() if k not in JUDGED}


def screen(outputs: Outputs) -> str:
    """What the result's screen shows."""
    console = Console(width=200, force_terminal=False)
    with console.capture() as caught:
        console.print(
            fit_summary(
                outputs.report, outputs.diagnosis, graded(outputs.report, outputs.diagnosis)
            )
        )
    return caught.get()


def test_the_figures_are_the_recorded_ones(outputs: Outputs) -> None:
    """Those of ``tests/golden``, of the commands that are recorded."""
    expected = json.loads((EXPECTED / f"{outputs.name}.json").read_text())
    for command in CASES[outputs.name].commands:
        if command in ALIKE_COMMANDS:
            found = figures(outputs.documents[command])
            assert outputs.statuses[command] == expected[command]["exit"]
            wrong = differences(expected[command], found)
            assert not wrong, f"{command}:\n" + "\n".join(wrong)


def test_fit_and_the_saved_file_tell_what_python_tells(outputs: Outputs) -> None:
    found = outputs.documents["fit"]["sensors"]
    assert found == {name: record(sensor) for name, sensor in outputs.sensors.items()}
    assert found == {name: record(sensor) for name, sensor in outputs.file.sensors.items()}


def test_the_saved_measurements_show_the_error_before_that_the_fit_tells(outputs: Outputs) -> None:
    """An export is proven by them, and says the error of the readings as they are."""
    errors = Proof(outputs.file).errors(nominal(outputs.file), frame=False)
    in_si = {name for name, one in outputs.file.sensors.items() if one.bias_unit != "count"}
    assert errors.keys() == in_si
    for name, error in errors.items():
        # rotations are kept as increments, and a circle's chords are shorter than its arcs
        assert error == pytest.approx(outputs.file[name].rms_before, rel=1e-3)


def test_bench_tells_what_fit_tells(outputs: Outputs) -> None:
    """Model, parameters, standard errors, errors and verdict; the ladder begins with the fit."""
    document = outputs.documents["bench"]
    for name, sensor in outputs.sensors.items():
        own, bench = record(sensor), document["sensors"][name]
        assert bench["model"] == own["model"] == bench["ladder"][0]["model"]
        assert (bench["verdict"], bench["unit"]) == (own["verdict"], own["unit"])
        assert [bench["ladder"][0][key] for key in FIGURES] == [own[key] for key in FIGURES]
        assert bench["parameters"].keys() == own["parameters"].keys()
        for parameter, one in bench["parameters"].items():
            for key in ("value", "standard_error", "unit"):
                assert one[key] == own["parameters"][parameter][key]
    texts = [f"{n}: {one['says']}" for n, one in document["sensors"].items()]
    assert outputs.documents["fit"]["verdict"] == texts


def test_a_diagnosis_changes_no_figure(outputs: Outputs) -> None:
    for name, sensor in outputs.sensors.items():
        assert record(sensor, judged=False) == record(outputs.first[name], judged=False)


def test_compare_has_the_fit_among_its_methods(outputs: Outputs) -> None:
    for name, sensor in outputs.sensors.items():
        rows = outputs.documents["compare"]["sensors"][name]
        (own,) = (one["result"] for one in rows if one["method"] == sensor.method)
        assert {k: v for k, v in own.items() if k not in JUDGED} == record(sensor, judged=False)


def test_the_bench_of_the_wizard_begins_with_its_fit(outputs: Outputs) -> None:
    """Also where the samples are read from the session only after the fit, or not at all."""
    for readings in (None, outputs.readings):
        benches = Benches(outputs.report, readings)
        for name, sensor in outputs.first.items():
            bench = benches.bench(name)
            assert bench is not None
            fit = bench.fit
            assert [getattr(fit, key) for key in FIGURES] == [getattr(sensor, k) for k in FIGURES]
            assert {one.name: (one.value, one.standard_error) for one in fit.parameters} == {
                key: (one.value, one.standard_error) for key, one in sensor.parameters.items()
            }


def test_every_text_prints_these_figures(outputs: Outputs) -> None:
    """The result screen, ``fit`` and ``bench``: each error with the same digits, one sentence.

    The ladder of the bench has the unit in its heading.
    """
    texts = {
        "screen": screen(outputs),
        "fit": outputs.texts["fit"],
        "bench": outputs.texts["bench"],
    }
    for where, text in texts.items():
        flat = "".join(text.split())
        for name, sensor in outputs.sensors.items():
            shown = [quantity(sensor.rms_fitted, sensor.unit), outputs.diagnosis[name].says]
            if sensor.rms_held_out is not None:
                shown.append(quantity(sensor.rms_held_out, sensor.unit))
            if sensor.could_be is not None and where != "bench":
                shown.append(f"could be {quantity(sensor.could_be, sensor.unit)}")
            unit = readable(sensor.unit)[1] if where == "bench" else ""
            for words in shown:
                assert "".join(words.removesuffix(unit).split()) in flat, (where, name)


def test_a_picture_shows_the_residuals_of_the_fit(
    outputs: Outputs, capsys: pytest.CaptureFixture[str]
) -> None:
    with read_as(outputs.recording):
        main(["bench", *outputs.files, "--view", "accelerometer/number", "--json", "-"])
    (shown,) = json.loads(capsys.readouterr().out)["views"]
    drawn = dict(zip(shown["source"], shown["y"], strict=True))
    residuals = outputs.report.sensors["accelerometer"].residuals
    factor = drawn[0] / float(residuals[0])
    assert [drawn[k] for k in sorted(drawn)] == pytest.approx((factor * residuals).tolist())


def test_nothing_beside_a_verdict_contradicts_it(outputs: Outputs) -> None:
    """A hold that stands out is named where the verdict does not explain it, and nowhere else."""
    for name, one in outputs.diagnosis.items():
        settled = one.verdict is Verdict.COMPLETE
        assert ("The model is complete" in one.says) == settled
        assert ("tilts the reference" in one.says) == (one.verdict is Verdict.WAITING)
        if one.verdict is Verdict.WAITING:
            assert outputs.diagnosis["accelerometer"].verdict is not Verdict.COMPLETE
        odd = outputs.report.outlier_notes.get(name)
        for text in outputs.texts["fit"], outputs.texts["bench"]:
            flat = "".join(text.split())
            if odd is not None:
                assert ("".join(odd[1:].split()) in flat) == (one.verdict is Verdict.UNEXPLAINED)
        assert f"{'✓' if one.settled else '▲'} {name}:" in screen(outputs)


@functools.cache
def restless() -> bytes:
    """A device that rests for 80 s, whose hand trembles, and whose gyroscope filters its noise.

    Its samples show more than its holds: slow noise in the long rest, what the filter passes.
    """
    rng, rate = np.random.default_rng(5), 25.0
    lines = printed().decode().splitlines()
    header, rows = lines[1], np.array([line.split(",") for line in lines[2:]], float)
    rest = rng.permutation(np.repeat(rows[: int(18.0 * rate)], 4, axis=0)[: int(60.0 * rate)])
    rows = np.concatenate([rest, rows])
    rows[:, 0] = np.arange(len(rows)) / rate
    turning = np.linalg.norm(rows[:, 4:7], axis=1) > 0.3
    low = butter(2, 0.6, output="sos")
    noise = sosfilt(low, rng.standard_normal((len(rows), 3)), axis=0)
    rows[:, 4:7] += np.where(turning[:, None], 0.2, 2e-3) * noise
    text = "\n".join(",".join(f"{value:.6f}" for value in row) for row in rows)
    return f"{lines[0]}\n{header}\n{text}\n".encode()


def test_the_wizard_tells_what_fit_and_bench_tell_of_its_session(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    engine = sat(path, data=restless())
    services = WizardServices(WizardOptions())
    services.sources.watched = path
    collected, snapshot = engine.collected(), engine.snapshot()
    report = services.fit(collected, snapshot)
    benches = services.benches(report, None)
    fitted = iw.calibrate(iw.read(path))
    blind = fit_stream(collected, snapshot.stream, FitOptions()).sensors
    for name, fit in report.sensors.items():
        bench = benches.bench(name)
        assert bench is not None
        for other in (fitted.report.sensors[name], bench.ladder[0], bench.fit):
            assert [getattr(other, key) for key in FIGURES] == [getattr(fit, k) for k in FIGURES]
        for other in (fitted.report.sensors[name], bench.fit):
            assert other.parameters == fit.parameters
        assert blind[name].parameters != fit.parameters  # the samples matter here
