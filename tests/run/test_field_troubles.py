"""A magnetometer of which nothing can come, through the whole way: words, and no result like one.

The lines of a virtual device are spoilt, decoded, led through the wizard and fitted.
"""

import functools
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.recording import FitOptions
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import Procedure, standard
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.review import fit_stream
from imucal_wizard.simulate.recording import simulate_recording

ARRIVING = 9000.0
"""Bytes per second, as fast as the device prints them."""
Spoil = Callable[[float, FloatArray], FloatArray | None]
"""What the magnetometer says instead at this many seconds of its step; None for nothing."""


@functools.cache
def printed() -> tuple[str, ...]:
    """A rest, six faces, six circles."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.csv"
        simulate_recording(path, rate=25.0, poses="6", rotations=0, hold=3.0, magnetometer=True)
        return tuple(path.read_text().splitlines())


def engine() -> Engine:
    """Settle, up/down, the field; started."""
    whole = standard(0, settle_seconds=5.0)
    steps = tuple(step for step in whole.steps if step.kind is not StepKind.POSES)
    made = Engine(settings=ProcedureSettings(Procedure(steps)))
    made.command("start")
    return made


@functools.cache
def begins() -> float:
    """When the magnetometer's step begins, s."""
    made = engine()
    for place, line in enumerate(printed()):
        made.receive(f"{line}\n".encode(), place / 100.0)
        if made.step is StepKind.FIELD:
            return made.status().elapsed
    raise AssertionError("it never began")


def spoilt(spoil: Spoil, seconds: float) -> bytes:
    """The lines up to so many seconds of the step, the magnetometer as it is spoilt."""
    lines = []
    for line in printed():
        if line[0] in "#t":
            lines.append(line)
            continue
        fields = line.split(",")
        since = float(fields[0]) - begins()
        if since > seconds:
            break
        if fields[7]:
            values = spoil(since, np.array(fields[7:10], float))
            fields[7:10] = ["", "", ""] if values is None else [f"{one:.1f}" for one in values]
        lines.append(",".join(fields))
    return ("\n".join(lines) + "\n").encode()


def performed(data: bytes) -> Engine:
    """All of it through the wizard, to the result as the app does at the end of a recording."""
    made = engine()
    for start in range(0, len(data), 3000):
        made.receive(data[start : start + 3000], start / ARRIVING)
    made.end()
    if made.step is not StepKind.RESULT:
        made.command("goto", "result")
    return made


def warnings_of(made: Engine) -> str:
    """The warnings of the fit, in which the accelerometer and no magnetometer must be."""
    report = fit_stream(made.collected(), made.snapshot().stream, FitOptions())
    assert set(report.sensors) >= {"accelerometer"}
    assert "magnetometer" not in report.sensors
    assert report.magnetic is None
    assert report.second_stage is None
    return " ".join(report.warnings)


RNG = np.random.default_rng(1)
CASES: dict[str, tuple[Spoil, float, str]] = {
    "never there": (lambda *_: None, 5.0, "No numbers (NaN or empty) arrive for the magne"),
    "one value": (lambda _, values: 0.0 * values + 12.0, 15.0, "always sends the same value"),
    "a dead axis": (lambda _, v: v * [1.0, 0.0, 1.0], 15.0, "axis y of the magnetometer always"),
    "half a circle": (lambda _, values: values, 6.0, "lie in one plane"),
    "one circle": (lambda _, values: values, 16.0, "urn the device through all"),
    "gone in a circle": (lambda s, v: v if s < 10.0 else None, 30.0, "lie in one plane"),
    "not the Earth's": (lambda _, values: 5.0 * values, 90.0, "is not the Earth's"),
    "saturated a little": (lambda _, v: np.minimum(v, [-5.0, 99.0, 99.0]), 90.0, "x of the magnet"),
    "saturated": (lambda _, v: np.minimum(v, [-20.0, 99.0, 99.0]), 140.0, "is saturated"),
    "does not turn": (
        lambda s, v: v if s < -1.0 else [20.0, 10.0, -40.0] + 0.4 * RNG.standard_normal(3),
        60.0,
        "does not turn",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_insufficient_field_data_are_refused_and_leave_the_rest_intact(name: str) -> None:
    spoil, seconds, says = CASES[name]
    assert says in warnings_of(performed(spoilt(spoil, seconds)))


def test_a_magnetometer_that_falls_silent_is_missed_at_once() -> None:
    """While it is turned: after two seconds, and the stream itself goes on."""
    made = engine()
    data = spoilt(lambda s, values: values if s < 12.0 else None, 16.0)
    for start in range(0, len(data), 3000):
        made.receive(data[start : start + 3000], start / ARRIVING)
    field = made.status().field
    assert field is not None
    assert "has sent nothing for" in field.trouble
    assert made.snapshot().stream.problem == ""


@pytest.mark.study
def test_a_disturbance_while_turning_is_left_out_with_its_time() -> None:
    """Steel passes for three seconds; the calibration is none the worse."""

    def passing(since: float, values: FloatArray) -> FloatArray:
        return values + np.array([15.0, -10.0, 5.0]) if 40.0 < since < 43.0 else values

    clean = performed(spoilt(lambda _, values: values, 200.0))
    made = performed(spoilt(passing, 200.0))
    stream = made.snapshot().stream
    report = fit_stream(made.collected(), stream, FitOptions())
    expected = fit_stream(clean.collected(), stream, FitOptions()).sensors["magnetometer"]
    found = report.sensors["magnetometer"]
    (said,) = [text for text in report.warnings if "these samples are left out" in text]
    since = float(said.split()[1]) - begins()
    assert 38.0 < since < 41.0
    for one, other in zip(found.parameters, expected.parameters, strict=True):
        assert abs(one.value - other.value) < 4.0 * (other.standard_error or 0.0), one.name
