"""The magnetometer's step: alone, taken up again, disturbed, and not there."""

from pathlib import Path

import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.plan import Procedure, standard
from imucal_wizard.guide.state import FieldStatus
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.run.procedure_settings import ProcedureSettings
from imucal_wizard.run.reader import Reader
from imucal_wizard.run.session_replay import begin_session, resume_session
from imucal_wizard.sessions import Session
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.imu import VirtualImu
from tests.waiting import wait_for

SEED = 3
FAST = float("inf")


def _settings() -> ProcedureSettings:
    """A short rest, and the magnetometer."""
    wanted = (StepKind.SOURCE, StepKind.SETTLE, StepKind.FIELD, StepKind.RESULT)
    steps = standard(settle_seconds=3.0).steps
    return ProcedureSettings(Procedure(tuple(step for step in steps if step.kind in wanted)))


def _reader(path: Path, speed: float = FAST, *, magnetometer: bool = True) -> Reader:
    imu = VirtualImu(25.0, SEED, speed, magnetometer=magnetometer, following=True)
    reader = Reader(imu, begin_session(path, None, _settings()))
    reader.start()
    wait_for(lambda: reader.snapshot().stream.samples > 0)
    reader.command("start")
    return reader


def _step(reader: Reader) -> str:
    return reader.snapshot().status.step


def _field(reader: Reader) -> FieldStatus:
    return reader.snapshot().status.field or FieldStatus()


def _to_the_result(path: Path, speed: float) -> tuple[bytes, Collected]:
    reader = _reader(path, speed)
    try:
        wait_for(lambda: _step(reader) == StepKind.RESULT)
        collected = reader.collected()
    finally:
        reader.stop()
    wait_for(lambda: reader.finished)
    with Session.open(path) as session:
        return b"".join(piece for _, _, piece in session.raw()), collected


@pytest.mark.study
def test_the_hand_turns_all_six_circles_and_two_speeds_give_the_same(tmp_path: Path) -> None:
    slow, fast = (_to_the_result(tmp_path / f"{speed}.imucal", speed) for speed in (40.0, FAST))
    assert slow[0] == fast[0]
    assert slow[1].field_spans == fast[1].field_spans
    ((start, end),) = fast[1].field_spans
    assert 60.0 < end - start < 140.0
    assert fast[1].field_left_out == ()
    one, other = slow[1].magnetometer, fast[1].magnetometer
    assert one is not None
    assert other is not None
    assert one.values.tobytes() == other.values.tobytes()


def test_a_session_left_in_mid_circle_goes_on_where_it_was(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    reader = _reader(path, 40.0)
    try:
        wait_for(lambda: len(_field(reader).done) == 2 and 100.0 < _field(reader).turned < 250.0)
    finally:
        reader.stop()
    wait_for(lambda: reader.finished)
    left = reader.snapshot().status.field
    assert left is not None
    taken_up = resume_session(path)
    taken_up.prepare(taken_up.engine)
    found = taken_up.engine.status().field
    taken_up.engine.close()
    assert found is not None
    assert (found.done, found.turned, found.here) == (left.done, left.turned, left.here)
    assert (found.samples, found.gaps, found.fit_error) == (
        left.samples,
        left.gaps,
        left.fit_error,
    )
    assert found.counts.tobytes() == left.counts.tobytes()


def test_a_resumed_field_step_is_completed(tmp_path: Path) -> None:
    """The hand begins anew on a device that was put down in between."""
    path = tmp_path / "a.imucal"
    reader = _reader(path, 40.0)
    try:
        wait_for(lambda: len(_field(reader).done) == 3)
    finally:
        reader.stop()
    wait_for(lambda: reader.finished)
    ((start, left), *_) = reader.collected().field_spans
    taken_up = resume_session(path)
    imu = VirtualImu(25.0, SEED, FAST, magnetometer=True, following=True)
    again = Reader(imu, taken_up.engine, prepare=taken_up.prepare)
    again.start()
    try:
        wait_for(lambda: _step(again) == StepKind.RESULT)
        spans = again.collected().field_spans
        assert spans[0][0] == start
        assert spans[-1][1] > left + 20.0
    finally:
        again.stop()
    wait_for(lambda: again.finished)


def test_passing_steel_is_detected_and_left_out(tmp_path: Path) -> None:
    reader = _reader(tmp_path / "a.imucal", 20.0)
    try:
        wait_for(lambda: len(_field(reader).done) == 3)
        assert isinstance(reader.hand, VirtualHand)
        reader.hand.pass_steel()
        wait_for(lambda: "µT" in _field(reader).disturbed)
        wait_for(lambda: _step(reader) == StepKind.RESULT)
        ((start, end, reason),) = reader.collected().field_left_out
        assert "µT too" in reason
        assert 0.3 < end - start < 2.5
    finally:
        reader.stop()
    wait_for(lambda: reader.finished)


def test_without_a_magnetometer_the_step_is_not_there(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    reader = _reader(path, magnetometer=False)
    try:
        wait_for(lambda: _step(reader) == StepKind.RESULT)
        assert reader.collected().magnetometer is None
        assert StepKind.FIELD not in dict(reader.snapshot().status.skipped)
    finally:
        reader.stop()
    wait_for(lambda: reader.finished)
    with Session.open(path) as session:
        data = b"".join(piece for _, _, piece in session.raw())
    assert b"mx[uT]" not in data


def test_an_effect_of_a_magnetometer_that_is_not_there_is_refused() -> None:
    with pytest.raises(UsageError, match="needs a device with one"):
        VirtualImu(hidden=["magnetometer/misalignment:2:x"])
