"""A recheck on the screen: from the list of sources to the verdict in large letters."""

from dataclasses import replace
from pathlib import Path

import msgspec

from imucal_wizard.core.errors import UsageError
from imucal_wizard.diagnose.recheck import MovedParameter, Recheck, RecheckVerdict, SensorRecheck
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.state import Status
from imucal_wizard.measurement.holds import Collected
from imucal_wizard.report.calibration_file import Calibration, Device
from imucal_wizard.run.snapshot import Snapshot
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.services import Saved, last_line, recheck_line
from imucal_wizard.tui.sources import SourceChoice, SourceKind
from imucal_wizard.tui.widgets.big_text import dots, full_blocks
from tests.calibrate.sessions import session
from tests.report.devices import calibration
from tests.tui import fakes
from tests.tui.terminals import USUAL, VIRTUAL
from tests.tui.waiting import shows, until

VERDICT = Status(step=StepKind.VERDICT, elapsed=41.0, holds=6)
MILLI_G = 9.80665e-3


def no_go(_collected: Collected, _snapshot: Snapshot) -> tuple[Recheck, Calibration, Saved]:
    """A bias that has moved by 5 mg."""
    moved = MovedParameter("bias_x", 5.0 * MILLI_G, 0.3 * MILLI_G, "m/s^2", 1e-12)
    sensor = SensorRecheck(
        RecheckVerdict.NO_GO, 5.1 * MILLI_G, 2.0 * MILLI_G, 0.3 * MILLI_G, "m/s^2", (moved,)
    )
    found = Recheck(
        RecheckVerdict.NO_GO, 41.0, {"accelerometer": sensor}, "calibrate the device again"
    )
    return found, calibration(), Saved(Path("cal.json"), status=1)


async def test_the_verdict_is_read_from_two_metres_and_says_what_has_moved() -> None:
    source = fakes.FakeSource(VERDICT)
    app = WizardApp(replace(fakes.services(source), recheck=no_go), None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        large = full_blocks(dots("NO-GO") or [])
        await shows(
            pilot,
            *(row.rstrip() for row in large),
            "41 s of samples, against the calibration of",
            "5.10 mg, limit 2.00 mg",
            "bias_x +5.00 ± 0.30 mg (17 σ) since",
            "calibrate the device again",
            "of the poses held before it",
        )
        await pilot.press("b")
        await until(pilot, lambda: ("back", "") in source.commands)
    assert app.state.saved is not None
    assert app.state.saved.status == 1


async def test_a_recheck_of_the_command_line_asks_for_the_device_and_shows_its_own_steps() -> None:
    """No session and no other calibration is offered; what is said is said of a recheck."""
    listed = (SourceChoice(SourceKind.SESSION, "old.imucal", "resume session of 10:12"),)
    asked = SourceChoice(SourceKind.RECHECK, "cal.json", "recheck cal.json")
    services = replace(fakes.services(fakes.FakeSource()), given_recheck=asked)
    app = WizardApp(replace(services, earlier=lambda: listed), None, None)
    async with app.run_test(size=USUAL) as pilot:
        words = "recheck cal.json: where do the samples come from?", "GO or NO-GO", "virtual IMU"
        text = await shows(pilot, *words, "Settle  Recheck  Verdict")
        assert "resume session" not in text
        assert "poses" not in text


def test_the_last_line_tells_the_verdict_and_what_to_type_next() -> None:
    plain, go = calibration(), Recheck(RecheckVerdict.GO, 40.0, {}, "")
    named = msgspec.structs.replace(plain, device=Device("IMU 7"))
    no_go = replace(go, verdict=RecheckVerdict.NO_GO)
    path = Path("my cal.json")
    assert recheck_line(go, named, path, None) == "GO. Next: imucal-wizard devices 'IMU 7'"
    assert recheck_line(go, plain, path, None).endswith("export 'my cal.json' --to TARGET")
    assert recheck_line(no_go, named, path, "/dev/a") == "NO-GO. Next: imucal-wizard --port /dev/a"
    assert recheck_line(no_go, named, path, None) == "NO-GO. Next: imucal-wizard"
    unsure = replace(go, verdict=RecheckVerdict.INSUFFICIENT)
    words = "INSUFFICIENT. Next: imucal-wizard recheck 'my cal.json' --port /dev/a"
    assert recheck_line(unsure, named, path, "/dev/a") == words


async def test_what_cannot_be_judged_says_why() -> None:
    source = fakes.FakeSource(VERDICT)

    def refused(_collected: Collected, _snapshot: Snapshot) -> tuple[Recheck, Calibration, Saved]:
        raise UsageError("the accelerometer was calibrated in counts")

    app = WizardApp(replace(fakes.services(source), recheck=refused), None, VIRTUAL)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "▲ the accelerometer was calibrated in counts")


async def test_a_known_device_in_the_list_is_checked_with_the_source_chosen_next() -> None:
    asked: list[Path | None] = []
    choice = SourceChoice(SourceKind.RECHECK, "/a/cal.json", "recheck IMU 7", "calibrated today")
    services = replace(
        fakes.services(fakes.FakeSource()),
        calibrations=lambda: (choice,),
        recheck_with=asked.append,
    )
    async with WizardApp(services).run_test(size=USUAL) as pilot:
        await shows(pilot, "recheck IMU 7")
        await pilot.press("down", "enter")
        await shows(pilot, "recheck IMU 7: where do the samples come from?")
        await pilot.press("escape")  # not this device after all
        await shows(pilot, "recheck IMU 7", "d devices")
        await pilot.press("down", "enter")
        await until(pilot, lambda: asked == [Path("/a/cal.json"), None, Path("/a/cal.json")])
        await pilot.press("enter")
        await shows(pilot, "100.0 Hz")


def test_the_last_line_of_an_exercise_leads_to_the_bench() -> None:
    line = last_line({}, fit_readings(session()), Path("my.json"), Path("my.imucal"))
    assert line.startswith("saved; ")
    assert line.endswith("Next: imucal-wizard bench my.imucal")
