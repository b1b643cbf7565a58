"""A device that prints what is no measurement: its calibration is that of a file of its bytes."""

from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.transport import Transport
from imucal_wizard.api import calibrate, read
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.recording import FitOptions
from imucal_wizard.guide.kinds import EventKind, StepKind
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.reader import Pump, Reader
from imucal_wizard.run.review import fit_stream
from tests.acquire.ports import Pty
from tests.run.performance import recorded, settings
from tests.waiting import wait_for


def _rows() -> tuple[str, FloatArray]:
    """Header and rows of the device."""
    lines = [line for line in recorded().decode().splitlines() if line[:1] not in "#t"]
    header = next(line for line in recorded().decode().splitlines() if line[:1] == "t")
    return header, np.array([line.split(",") for line in lines], float)


def _text(header: str, values: FloatArray) -> bytes:
    rows = [",".join(f"{value:.7f}" for value in row) for row in values]
    return "\n".join([header, *rows, ""]).encode()


def _spoilt() -> bytes:
    """Each measurement printed twice, some as zeros, with times that jitter by 0.3 intervals."""
    rng = np.random.default_rng(5)
    header, once = _rows()
    once[rng.random(len(once)) < 0.001, 1:7] = 0.0
    once[0, 1:7] = once[1, 1:7]
    values = np.repeat(once, 2, axis=0)
    values[:, 0] = np.arange(len(values)) / 100.0 + rng.uniform(0.0, 0.003, len(values))
    return _text(header, values)


def test_repeats_zeros_and_jitter_change_no_calibration(tmp_path: Path, pty: Pty) -> None:
    data, path = _spoilt(), tmp_path / "a.csv"
    path.write_bytes(data)
    file = calibrate(read(path))
    reader = Reader(Pump(Transport(pty.path)), Engine(settings=settings()))
    reader.start()
    try:
        wait_for(lambda: reader.snapshot().stream.connected)
        reader.command("start")
        for start in range(0, len(data), 4000):
            pty.send(data[start : start + 4000])
        wait_for(lambda: reader.snapshot().status.step is StepKind.RESULT)
        snapshot = reader.snapshot()
        live = fit_stream(reader.collected(), snapshot.stream, FitOptions())
    finally:
        reader.stop()
    assert "is repeated 2 times" in " ".join(snapshot.stream.warnings)
    assert "jitter about even ones" in " ".join(snapshot.stream.warnings)
    assert "exactly zero" in " ".join(snapshot.stream.warnings)
    assert snapshot.stream.rate == pytest.approx(50.0, rel=1e-3)
    for name in ("accelerometer", "gyroscope"):
        for one, other in zip(
            file[name].parameters.values(), live.sensors[name].parameters, strict=True
        ):
            if one.standard_error is None or other.standard_error is None:
                continue  # six faces do not determine it
            assert one.value is not None
            assert other.value is not None
            assert abs(one.value - other.value) < 1.96 * min(
                one.standard_error, other.standard_error
            )


def test_a_procedure_that_was_begun_with_wrong_signs_begins_again() -> None:
    """What was measured before the first reading passed through zero has other signs."""
    header, values = _rows()
    values[:, 1:4] = np.round(values[:, 1:4] * 1670.0 + np.array([-3000.0, -3000.0, 3000.0]))
    values[:, 4:7] = np.round(values[:, 4:7] * 900.0) + 3000.0
    values[:, 1:7] = np.mod(values[:, 1:7], 2.0**16)
    data = _text(header.replace("m/s^2", "count").replace("rad/s", "count"), values)
    engine = Engine(settings=settings())
    engine.command("start")
    for start in range(0, len(data), 3000):
        engine.receive(data[start : start + 3000], start / 9000.0)
        if engine.samples and engine.step is StepKind.SOURCE:
            engine.command("start")
    warnings = [e.text for e in engine.snapshot().events if e.kind is EventKind.WARNING]
    assert sum("the procedure begins again" in text for text in warnings) == 1
    holds = np.array([hold.accelerometer for hold in engine.collected().holds])
    assert len(holds) >= 3
    assert np.abs(holds).max() < 2.0**15
    assert holds.min() < 0.0
