"""The unattended run: samples and result are the same at any speed, in every run."""

import functools
import json
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import pytest

from imucal_wizard.estimate.recording import fit_collected
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.report.calibration_record import from_report
from imucal_wizard.run.reader import Reader
from imucal_wizard.run.session_replay import begin_session
from imucal_wizard.sessions import Session
from imucal_wizard.simulate.imu import VirtualImu
from tests.run.performance import settings
from tests.waiting import wait_for


@dataclass(frozen=True)
class _Run:
    bytes: bytes
    commands: list[tuple[int, str]]
    result: dict[str, Any]


def _fitted(collected: Collected, reader: Reader) -> dict[str, Any]:
    units = {"accelerometer": "m/s^2", "gyroscope": "rad/s"}
    report = fit_collected(collected, units, reader.snapshot().stream.rate)
    result: dict[str, Any] = msgspec.to_builtins(from_report(report, "virtual IMU", ""))
    return result


@functools.cache
def _unattended(speed: float, again: int = 0) -> _Run:  # noqa: ARG001 -- another run of the same
    """From the first sample to the save step, without a key."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.imucal"
        imu = VirtualImu(speed=speed, seed=3, following=True)
        reader = Reader(imu, begin_session(path, None, settings()))
        reader.start()
        try:
            wait_for(lambda: reader.snapshot().stream.samples > 0)
            reader.command("start")
            wait_for(lambda: reader.snapshot().status.step is StepKind.RESULT)
            reader.command("validate")
            wait_for(lambda: reader.snapshot().status.step is StepKind.SAVE)
            result = _fitted(reader.collected(), reader)
        finally:
            reader.stop()
        wait_for(lambda: reader.finished)
        with Session.open(path) as session:
            data = b"".join(piece for _, _, piece in session.raw())
            commands = [(c.sample_index, c.name) for c in session.commands()]
    return _Run(data, commands, result)


@pytest.mark.study
def test_two_speeds_give_the_same_bytes_and_the_same_result() -> None:
    slow, fast = _unattended(30.0), _unattended(float("inf"))
    assert slow.bytes == fast.bytes
    assert slow.commands == fast.commands
    assert json.dumps(slow.result) == json.dumps(fast.result)


def test_two_runs_at_one_speed_give_the_same_bytes_and_the_same_result() -> None:
    one, other = _unattended(float("inf")), _unattended(float("inf"), again=1)
    assert one.bytes == other.bytes
    assert json.dumps(one.result) == json.dumps(other.result)


def test_a_command_without_new_samples_takes_effect_at_the_last_sample() -> None:
    """The start after two seconds of preview; the validation after the reaction time."""
    (start, validate) = _unattended(float("inf")).commands
    assert start == (200, "start")
    assert validate[1] == "validate"
    assert (validate[0] - 150) % 10 == 0
