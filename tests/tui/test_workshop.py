"""The app on real sources: the virtual IMU, recordings, sessions; and what is saved."""

import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.api import load
from imucal_wizard.core.errors import InputError, RecordingError, SessionError, UsageError
from imucal_wizard.run.session_replay import begin_session
from imucal_wizard.run.snapshot import Snapshot
from imucal_wizard.simulate.recording import simulate_recording
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.options import AppSettings, WizardOptions
from imucal_wizard.tui.run import first_choice, run_wizard
from imucal_wizard.tui.services import WizardServices
from imucal_wizard.tui.sources import Hand, SampleSource, SourceChoice, SourceKind
from tests.calibrate.collecting import with_field
from tests.cli.kept_sessions import sat
from tests.tui import fakes
from tests.tui.terminals import VIRTUAL
from tests.tui.waiting import shows, until
from tests.waiting import wait_for


@contextmanager
def running(source: SampleSource) -> Iterator[SampleSource]:
    source.start()
    try:
        yield source
    finally:
        source.stop()


def snapshot_of(source: SampleSource, true: Callable[[Snapshot], bool]) -> Snapshot:
    """The first snapshot of which this is true."""
    seen = [source.snapshot()]

    def look() -> bool:
        seen[0] = source.snapshot()
        return true(seen[0])

    wait_for(look)
    return seen[0]


def test_the_virtual_imu_is_read_like_a_port_and_has_a_hand(tmp_path: Path) -> None:
    workshop = WizardServices(WizardOptions(sessions=tmp_path, speed=20.0))
    source = workshop.open_source(VIRTUAL)
    with running(source):
        snapshot = snapshot_of(source, lambda s: s.stream.samples > 100)
        assert snapshot.stream.rate == pytest.approx(100.0, rel=1e-3)
        assert "virtual IMU" in snapshot.stream.source
        assert snapshot.stream.needs == ()
        hand = getattr(source, "hand", None)
        assert isinstance(hand, Hand)
        hand.turn("x", 90.0)
        snapshot_of(source, lambda s: (s.stream.accelerometer or (0, 0, 9))[2] < 2.0)
        snapshot = snapshot_of(source, _drawn_upright)
        assert snapshot.stream.problem == ""


def _drawn_upright(snapshot: Snapshot) -> bool:
    """What the accelerometer says is up points up in the drawing."""
    if snapshot.attitude is None or snapshot.stream.accelerometer is None:
        return False
    up = snapshot.attitude @ np.array(snapshot.stream.accelerometer)
    return bool(up[2] / np.linalg.norm(up) > 0.99)


def test_a_session_left_in_the_middle_is_offered_and_goes_on_at_the_same_step(
    tmp_path: Path,
) -> None:
    workshop = WizardServices(WizardOptions(sessions=tmp_path, speed=50.0, auto=True))
    source = workshop.open_source(VIRTUAL)
    with running(source):
        snapshot_of(source, lambda s: s.stream.samples > 0)
        source.command("start")
        before = snapshot_of(source, lambda s: s.status.step == "up-down" and s.status.holds >= 3)
        assert workshop.earlier() == [], "it is at work"
    wait_for(lambda: bool(workshop.earlier()))  # stopping does not wait for a busy disk
    offered = workshop.earlier()
    assert [choice.kind for choice in offered] == [SourceKind.SESSION]
    assert "at Up/down" in offered[0].title
    assert re.fullmatch(r"[34] holds in 00:\d\d, virtual IMU", offered[0].detail)
    again = workshop.open_source(offered[0])
    assert workshop.sources.title == "virtual IMU", (
        "what was calibrated, and not how it was gone on with"
    )
    with running(again):
        after = snapshot_of(again, lambda s: s.stream.samples >= before.stream.samples)
        assert after.status.step in ("up-down", "poses")
        assert after.status.holds >= before.status.holds


def test_a_session_that_another_wizard_has_just_begun_is_left_to_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both have found the same name unused; the second takes the next one."""
    first, second = tmp_path / "a.imucal", tmp_path / "a-2.imucal"
    begin_session(first, source="another wizard").close()
    names = iter((first, second))
    monkeypatch.setattr("imucal_wizard.sessions.new_session_path", lambda *_: next(names))
    workshop = WizardServices(WizardOptions(sessions=tmp_path, speed=20.0))
    with running(workshop.open_source(VIRTUAL)):
        assert workshop.sources.session == second


def test_a_session_goes_on_at_another_port_when_one_is_given(tmp_path: Path) -> None:
    """A board that was plugged in again may be the next number."""
    path = tmp_path / "a.imucal"
    begin_session(
        path, source="/dev/ttyACM0", about={"kind": "port", "port": "/dev/ttyACM0"}
    ).close()
    there = WizardServices(WizardOptions(resume=path, port=str(tmp_path / "ttyACM1")))
    source = there.open_source(SourceChoice(SourceKind.SESSION, str(path)))
    with running(source):
        snapshot_of(source, lambda s: "ttyACM1" in s.stream.problem)


@pytest.mark.parametrize(("given", "said"), [("/dev/b c", " --port '/dev/b c'"), (None, "")])
def test_the_command_that_continues_names_the_port_used_last(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    given: str | None,
    said: str,
) -> None:
    path = tmp_path / "a.imucal"
    begin_session(path, about={"kind": "port", "port": "/dev/a"}).close()
    options = WizardOptions(resume=path, port=given)

    def quits(app: WizardApp) -> None:
        source = app.state.services.open_source(SourceChoice(SourceKind.SESSION, str(path)))
        with running(source):
            snapshot_of(source, lambda s: (given or "/dev/a") in s.stream.problem)

    monkeypatch.setattr("imucal_wizard.tui.run._run", quits)
    monkeypatch.setattr("imucal_wizard.tui.run._check", lambda _options: None)
    assert run_wizard(options) == 0
    assert f"continue with: imucal-wizard --resume {path}{said}\n" in capsys.readouterr().out


def test_a_session_without_its_port_says_what_to_add_and_is_let_go(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    begin_session(path).close()
    for options in (WizardOptions(), WizardOptions()):
        with pytest.raises(SessionError, match="add --port PORT"):
            WizardServices(options).open_source(SourceChoice(SourceKind.SESSION, str(path)))


def test_a_session_of_the_virtual_imu_takes_no_port(tmp_path: Path) -> None:
    path = tmp_path / "a.imucal"
    begin_session(path, about={"kind": "virtual"}).close()
    workshop = WizardServices(WizardOptions(resume=path, port="/dev/ttyACM0"))
    with pytest.raises(UsageError, match="leave --port out"):
        workshop.open_source(SourceChoice(SourceKind.SESSION, str(path)))


def test_a_recording_plays_to_its_end(tmp_path: Path) -> None:
    recording = tmp_path / "six.csv"
    simulate_recording(recording, poses="6")
    workshop = WizardServices(WizardOptions(replay=(recording,), speed=1000.0))
    source = workshop.open_source(SourceChoice(SourceKind.FILE, title="six.csv"))
    with running(source):
        snapshot_of(source, lambda s: s.stream.samples > 0)
        source.command("start")
        snapshot = snapshot_of(source, lambda s: s.finished)
        assert snapshot.status.holds >= 6


@pytest.mark.study
async def test_a_recording_is_calibrated_without_a_key(tmp_path: Path) -> None:
    recording, place = tmp_path / "six.csv", tmp_path / "six.json"
    simulate_recording(recording, poses="18")
    options = WizardOptions(replay=(recording,), speed=1000.0, save=place)
    settings = AppSettings(quit_after=True, countdown=0.1)
    app = WizardApp(WizardServices(options), settings, first_choice(options))
    async with app.run_test(size=(120, 24)) as pilot:
        await shows(pilot, "✓18 poses ✓Rotations", "–Validate ▸SAVE")
        await until(pilot, lambda: not app.is_running)
    assert app.state.failure is None
    assert set(load(place).sensors) == {"accelerometer", "gyroscope"}


async def test_a_file_that_is_no_recording_ends_the_app_with_the_reason(tmp_path: Path) -> None:
    nothing = tmp_path / "nothing.csv"
    nothing.write_text("these are words\n")
    options = WizardOptions(replay=(nothing,))
    app = WizardApp(WizardServices(options), AppSettings(), first_choice(options))
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: not app.is_running)
    assert isinstance(app.state.failure, RecordingError)


def test_a_calibration_never_replaces_another_unless_its_name_was_given(tmp_path: Path) -> None:
    workshop = WizardServices(WizardOptions())
    workshop.sources.session = tmp_path / "s.imucal"
    elsewhere = replace(fakes.report(), gravity=9.81, holds=())
    reports = [fakes.report(), fakes.report(True), elsewhere]
    names = [workshop.save(report).path.name for report in reports]
    assert names == ["s.json", "s-2.json", "s-3.json"]
    again = [workshop.save(report).path.name for report in reports]
    assert again == names, "a session taken up again after its end says nothing new"
    assert len(list(tmp_path.iterdir())) == 3
    given = tmp_path / "mine.json"
    workshop = WizardServices(WizardOptions(save=given))
    assert {workshop.save(fakes.report()).path for _ in range(2)} == {given}


@pytest.mark.parametrize(
    ("options", "kind"),
    [
        (WizardOptions(port="/dev/ttyACM0"), SourceKind.PORT),
        (WizardOptions(replay=(Path("a.csv"),)), SourceKind.FILE),
        (WizardOptions(resume=Path("a.imucal")), SourceKind.SESSION),
        (WizardOptions(resume=Path("a.imucal"), port="/dev/ttyACM1"), SourceKind.SESSION),
        (WizardOptions(auto=True), SourceKind.VIRTUAL),
        (WizardOptions(hidden=("g-sensitivity:0.1:x",)), SourceKind.VIRTUAL),
    ],
)
def test_options_that_name_a_source_choose_it(options: WizardOptions, kind: SourceKind) -> None:
    choice = first_choice(options)
    assert choice is not None
    assert choice.kind is kind


def test_without_options_the_operator_chooses() -> None:
    assert first_choice(WizardOptions()) is None


def test_without_a_terminal_the_wizard_says_what_to_use_instead(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("sys.stdin.isatty", lambda: False, raising=False)
    with pytest.raises(UsageError, match="imucal-wizard fit"):
        run_wizard(WizardOptions())


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (WizardOptions(format="nope"), "no format 'nope'"),
        (WizardOptions(recording=RecordingOptions(("ax", "foo"))), "'foo' is not a column"),
        (WizardOptions(recording=RecordingOptions(gyroscope_unit="foo")), "is not a unit"),
    ],
)
def test_wrong_usage_is_said_before_the_screen_is_taken_over(
    monkeypatch: pytest.MonkeyPatch, options: WizardOptions, says: str
) -> None:
    for stream in ("stdin", "stdout"):
        monkeypatch.setattr(f"sys.{stream}.isatty", lambda: True, raising=False)
    with pytest.raises(InputError, match=says):
        run_wizard(options)


def test_what_is_not_there_is_said_in_a_sentence(tmp_path: Path) -> None:
    workshop = WizardServices(WizardOptions())
    missing = SourceChoice(SourceKind.SESSION, str(tmp_path / "none.imucal"))
    with pytest.raises(SessionError, match="there is no session"):
        workshop.open_source(missing)
    for target in ("none.csv", "x" * 300):
        with pytest.raises(RecordingError, match="there is no file"):
            workshop.open_source(replace(missing, kind=SourceKind.FILE, target=target))
    with pytest.raises(RecordingError, match="is a folder; give the files in it"):
        workshop.open_source(replace(missing, kind=SourceKind.FILE, target=str(tmp_path)))
    with pytest.raises(SessionError, match="there is no session"):
        workshop.open_source(replace(missing, target="x" * 300))


def test_the_local_field_reaches_the_fit_and_the_saved_calibration(tmp_path: Path) -> None:
    """``--field`` and ``--mag-method`` are the wizard's, too; what is saved is in µT."""
    place = tmp_path / "mine.json"
    workshop = WizardServices(WizardOptions(save=place, field=48.5, magnetometer_method="two-step"))
    snapshot = Snapshot(stream=fakes.STREAM)
    report = workshop.fit(with_field(), snapshot)
    saved = workshop.save(report)
    kept = load(place).sensors["magnetometer"]
    assert kept.method == "two-step"
    assert kept.unit == "uT"
    assert kept.frame == "accelerometer"
    readings = with_field().magnetometer
    assert readings is not None
    length = np.linalg.norm(kept.apply(readings.values), axis=1)
    assert length.mean() == pytest.approx(48.5, rel=2e-3)
    assert any("MAGNETOMETER" in text for text in saved.says)


@pytest.mark.study
async def test_a_session_is_watched_again_to_its_end(tmp_path: Path) -> None:
    """``--replay`` of a session: with what was taken back, to the result it had, on one screen."""
    path, place = tmp_path / "a.imucal", tmp_path / "a.json"
    live = sat(path, {0.4: ("undo",)})
    options = WizardOptions(replay=(path,), speed=1000.0, save=place)
    settings = AppSettings(quit_after=True, countdown=0.1)
    workshop = WizardServices(options)
    app = WizardApp(workshop, settings, first_choice(options))
    async with app.run_test(size=(80, 24)) as pilot:
        await until(pilot, lambda: not app.is_running)
    assert app.state.failure is None
    assert set(load(place).sensors) == {"accelerometer", "gyroscope"}
    assert app.state.report is not None
    kept = live.collected()
    assert [hold.start for hold in app.state.report.holds] == [hold.start for hold in kept.holds]
    assert workshop.benches(app.state.report, None).readings is not None


def test_ns_procedure_is_led_through_by_its_options(tmp_path: Path) -> None:
    """``--poses 8 --gyro-method offset``: eight tilts, no rotations, the offset from the holds."""
    options = WizardOptions(
        sessions=tmp_path, speed=100.0, auto=True, poses="8", gyroscope_method="offset"
    )
    workshop = WizardServices(options)
    source = workshop.open_source(VIRTUAL)
    with running(source):
        snapshot_of(source, lambda s: s.stream.samples > 0)
        source.command("start")
        snapshot = snapshot_of(source, lambda s: s.status.step == "result")
        assert snapshot.status.skipped == ()
        report = workshop.fit(source.collected(), snapshot)
    assert len(report.holds) == 9
    assert report.sensors["gyroscope"].method == "offset"
