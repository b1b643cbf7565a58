"""Devices in the wizard: named on the source screen, kept with the session, shown with history."""

from dataclasses import replace
from pathlib import Path

import msgspec
import pytest

from imucal_wizard.acquire.ports import PortInfo
from imucal_wizard.core.description import Description
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.report.calibration_file import Device, read_calibration
from imucal_wizard.report.device_history import save_in_history
from imucal_wizard.run.session_replay import resume_session
from imucal_wizard.sessions import Session
from imucal_wizard.sessions.catalogue import Catalogue
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.screens.source import VIRTUAL
from imucal_wizard.tui.services import WizardServices
from imucal_wizard.tui.sources import SourceChoice, SourceKind
from tests.acquire.ports import Pty
from tests.cli.kept_sessions import listed
from tests.report.devices import calibration
from tests.report.test_device_history import shifted
from tests.tui import fakes
from tests.tui.terminals import USUAL
from tests.tui.waiting import shows
from tests.waiting import wait_for

PORT = SourceChoice(SourceKind.PORT, "/dev/ttyACM0", "/dev/ttyACM0")


async def test_a_device_is_named_while_its_samples_arrive() -> None:
    """No key is needed; d opens the fields, enter uses them, escape leaves them."""
    source = fakes.FakeSource()
    services = replace(fakes.services(source), description=Description("Arduino 7", "7"))
    async with WizardApp(services, None, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "device: Arduino 7", "is this what you expect?")
        await pilot.press("d")
        await shows(pilot, "what is measured?", "serial", "7")
        await pilot.press("end", *"x\x07", "down", "down", "down", *"bench 3", "enter")
        await shows(pilot, "device: Arduino 7x")
        assert source.description == Description("Arduino 7x", "7", place="bench 3")
        await pilot.press("d", *"zz", "escape")
        await shows(pilot, "device: Arduino 7x")
        await pilot.press("enter")
        await shows(pilot, "▸SETTLE")


@pytest.mark.parametrize("size", [USUAL, (160, 50)])
async def test_the_history_and_the_plots_of_a_device(tmp_path: Path, size: tuple[int, int]) -> None:
    for day in (1, 20):
        save_in_history(shifted(day, 0.01 * day), tmp_path / "a.json", tmp_path / "s")
    services = WizardServices(WizardOptions(sessions=tmp_path / "s", muted=True))
    async with WizardApp(services).run_test(size=size) as pilot:
        await shows(pilot, "virtual IMU")
        await pilot.press("d")
        await shows(pilot, "arm", "2 calibrations", "2031-03-01", "AS FOUND", "VERDICT")
        await shows(pilot, "SPREAD P")
        await pilot.press("o", "left", "q")


async def test_devices_of_one_name_are_told_apart_and_do_not_hide_the_others(
    tmp_path: Path,
) -> None:
    for place, serial in enumerate(("1", "2", "2")):
        made = shifted(1 + place, 0.01 * place)
        device = Device("twin", serial) if place < 2 else Device("arm")
        save_in_history(
            msgspec.structs.replace(made, device=device), tmp_path / "a.json", tmp_path / "s"
        )
    services = WizardServices(WizardOptions(sessions=tmp_path / "s", muted=True))
    titles = {one.title for one in services.calibrations()}
    assert titles == {"recheck twin 1", "recheck twin 2", "recheck arm"}
    async with WizardApp(services).run_test(size=USUAL) as pilot:
        await shows(pilot, "recheck arm")
        await pilot.press("d")
        await shows(pilot, "twin 1", "twin 2", "arm", "AS FOUND")


def test_a_session_keeps_its_device_and_a_saved_calibration_joins_its_history(
    tmp_path: Path, sagging: FitReport
) -> None:
    options = WizardOptions(sessions=tmp_path, speed=50.0, description=Description(place="roof"))
    workshop = WizardServices(options)
    source = workshop.open_source(VIRTUAL)
    assert workshop.description == Description("virtual IMU", "seed 0", place="roof")
    source.start()
    try:
        wait_for(lambda: source.snapshot().stream.samples > 0)
        source.describe(Description("arm", "7", operator="A. B."))
        workshop.describe(Description("arm", "7", operator="A. B."))
    finally:
        source.stop()
    wait_for(lambda: not listed(tmp_path)[0].busy)
    (session,) = listed(tmp_path)
    assert session.description == Description("arm", "7", operator="A. B.")
    saved = workshop.save(sagging)
    made = read_calibration(saved.path)
    assert made.device is not None
    assert (made.device.name, made.device.serial, made.operator) == ("arm", "7", "A. B.")
    assert (made.session, made.gravity.value) == (session.path.name, STANDARD_GRAVITY)
    assert "kept in the history of arm" in saved.says
    assert workshop.save(sagging).path == saved.path, "an equal file is kept"
    workshop.describe(Description("arm", "7", note="after a fall"))
    assert workshop.save(sagging).path == saved.path, "no other calibration by its note"
    assert read_calibration(saved.path).note == "after a fall"
    with Catalogue(tmp_path) as catalogue:
        (kept,) = catalogue.history("arm").calibrations
        assert kept.path == saved.path
        (known,) = catalogue.sessions()
        assert set(known.grades) == {"accelerometer", "gyroscope"}
    # gone on with, it is the same device, and the statement does not disturb the procedure
    again = WizardServices(WizardOptions(sessions=tmp_path))
    resumed = resume_session(session.path)
    resumed.prepare(resumed.engine)
    assert not [event for event in resumed.engine.snapshot().events if "describe" in event.text]
    resumed.session.close()
    reopened = again.open_source(SourceChoice(SourceKind.SESSION, str(session.path)))
    assert again.description == Description("arm", "7", operator="A. B.")
    reopened.start()
    reopened.stop()


def test_a_recheck_is_of_the_device_that_was_calibrated(tmp_path: Path) -> None:
    saved = shifted(1, 0.0).save(tmp_path / "my.json")
    services = WizardServices(WizardOptions(sessions=tmp_path / "s", recheck=saved))
    source = services.open_source(SourceChoice(SourceKind.PORT, "/dev/nothing"))
    assert services.description == Description("arm")
    source.start()
    source.stop()


def test_a_recheck_that_is_opened_again_has_its_calibration_and_its_limits(tmp_path: Path) -> None:
    saved = calibration(turns=6).save(tmp_path / "my.json")
    options = WizardOptions(sessions=tmp_path / "s", recheck=saved, speed=50.0)
    mine = replace(
        options, recheck_grade="industrial", limits={"accelerometer": 0.05}, gyro_zeroed=True
    )
    source = WizardServices(mine).open_source(VIRTUAL)
    source.start()
    try:
        wait_for(lambda: source.snapshot().stream.samples > 0)
        assert StepKind.RECHECK in source.snapshot().status.steps
        # every sensor that was calibrated can be checked
        wait_for(lambda: source.snapshot().stream.magnetometer is not None)
    finally:
        source.stop()
    wait_for(lambda: not listed(tmp_path / "s")[0].busy)
    again = WizardServices(WizardOptions(sessions=tmp_path / "s"))
    (session,) = (tmp_path / "s").glob("*.imucal")
    again.open_source(SourceChoice(SourceKind.SESSION, str(session)))
    known = again.sources.known
    assert known is not None
    chosen = known.settings
    assert (chosen.grade, chosen.limits, chosen.gyro_zeroed) == (
        "industrial",
        {"accelerometer": 0.05},
        True,
    )


def test_a_port_that_never_opened_leaves_no_session(tmp_path: Path) -> None:
    workshop = WizardServices(WizardOptions(sessions=tmp_path / "s"))
    source = workshop.open_source(SourceChoice(SourceKind.PORT, str(tmp_path / "none")))
    source.start()
    wait_for(lambda: "none" in source.snapshot().stream.problem)
    source.stop()
    wait_for(lambda: not list((tmp_path / "s").iterdir()))


def test_a_port_that_sent_nothing_leaves_no_session(tmp_path: Path) -> None:
    """It was offered as "resume session, 0 holds"."""
    workshop = WizardServices(WizardOptions(sessions=tmp_path / "s"))
    board = Pty()
    source = workshop.open_source(SourceChoice(SourceKind.PORT, board.path))
    source.start()
    wait_for(lambda: not source.snapshot().stream.busy)
    source.stop()
    wait_for(lambda: not list((tmp_path / "s").iterdir()))
    board.unplug()


@pytest.mark.parametrize(("step", "offered"), [("settle", 0), ("up-down", 1)])
def test_a_session_without_measurements_is_not_offered_but_kept(
    tmp_path: Path, step: str, offered: int
) -> None:
    path = tmp_path / "2031-01-01_080000.imucal"
    with Session.create(path, {}) as session:
        session.write_pieces([(0.0, b"what may be of use")])
        session.set_meta("step", step)
    assert len(WizardServices(WizardOptions(sessions=tmp_path)).earlier()) == offered
    assert path.exists()


def test_a_known_device_gets_its_name_from_the_catalogue(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the serial number of its port; without one by VID:PID."""
    board = PortInfo("/dev/ttyACM9", "Nano", "2341:8057", "55AB", "Arduino")
    monkeypatch.setattr("imucal_wizard.acquire.ports.list_ports", lambda: [board])
    workshop = WizardServices(WizardOptions(sessions=tmp_path / "s"))
    choice = SourceChoice(SourceKind.PORT, "/dev/ttyACM9")
    workshop.open_source(choice)
    assert workshop.description == Description("Arduino 55AB", "55AB")
    session = next((tmp_path / "s").glob("*.imucal"))
    with Catalogue(tmp_path / "s") as catalogue:
        checked = {"schema": "imucal-wizard/recheck/1", "created": "2099-01-01", "verdict": "go"}
        catalogue.add_recheck({"name": "left arm", "serial": "55AB"}, checked)
    workshop.open_source(choice)
    assert workshop.description.device == "left arm"
    board = replace(board, serial_number="")
    workshop.open_source(choice)
    assert workshop.description == Description("Arduino 2341:8057")
    assert session.exists()
