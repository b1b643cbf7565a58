"""The source step: what there is, what arrives, whether it makes sense."""

import os
import sys
import threading
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from textual.events import Key
from textual.widgets import Input

from imucal_wizard.acquire.decode.base import Column
from imucal_wizard.acquire.resolve import NEEDS_ACCELEROMETER
from imucal_wizard.core.errors import LinkError
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.state import Status
from imucal_wizard.run.snapshot import StreamStatus
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.options import AppSettings
from imucal_wizard.tui.sources import SourceChoice, SourceKind
from tests.tui import fakes
from tests.tui.terminals import USUAL
from tests.tui.waiting import seen, shows, until
from tests.waiting import PATIENCE

AT_ONCE = AppSettings(header_patience=0.0)
"""A stream without a header is asked about at once."""
PORT = SourceChoice(SourceKind.PORT, "/dev/ttyACM0", "/dev/ttyACM0", "2341:8057  Arduino Nano")
SESSION = SourceChoice(SourceKind.SESSION, "a.imucal", "session of 14:03", "at 18 poses")


def _ports() -> Sequence[SourceChoice]:
    return [PORT]


def _denied() -> Sequence[SourceChoice]:
    raise PermissionError("permission denied: /home/a/sessions")


def _sessions() -> Sequence[SourceChoice]:
    return [SESSION]


@pytest.mark.parametrize("size", [USUAL, (160, 50)])
async def test_the_list_names_ports_sessions_and_the_virtual_imu(size: tuple[int, int]) -> None:
    services = replace(fakes.services(fakes.FakeSource()), ports=_ports, earlier=_sessions)
    async with WizardApp(services).run_test(size=size) as pilot:
        await shows(
            pilot, "▸SOURCE", "virtual IMU", "/dev/ttyACM0", "2341:8057", "session of 14:03"
        )


async def test_an_interrupted_session_is_listed_before_rechecks_and_finished_sessions() -> None:
    """Whoever comes back after a crash looks for the session."""
    finished = replace(SESSION, title="session of 09:00")
    unfinished = replace(SESSION, title="resume session of 14:03", unfinished=True)
    recheck = SourceChoice(SourceKind.RECHECK, "cal.json", "recheck IMU 7")
    services = replace(
        fakes.services(fakes.FakeSource()),
        ports=_ports,
        calibrations=lambda: [recheck],
        earlier=lambda: [finished, unfinished],
    )
    async with WizardApp(services).run_test(size=USUAL) as pilot:
        text = await shows(pilot, "session of 09:00")
    wanted = ("virtual IMU", "/dev/ttyACM0", "resume session of", "recheck IMU 7", "session of 09")
    places = [text.index(words) for words in wanted]
    assert places == sorted(places)


async def test_what_cannot_be_listed_is_said_beside_the_other_sources() -> None:
    services = replace(fakes.services(fakes.FakeSource()), ports=_ports, earlier=_denied)
    async with WizardApp(services).run_test(size=USUAL) as pilot:
        await shows(pilot, "/dev/ttyACM0", "▲ not all sources are listed", "/home/a")


async def test_enter_opens_and_enter_again_starts() -> None:
    source = fakes.FakeSource()
    async with WizardApp(fakes.services(source)).run_test(size=USUAL) as pilot:
        await shows(pilot, "virtual IMU")
        await pilot.press("enter")
        await shows(
            pilot,
            "100.0 Hz",
            "0 lost",
            "9.790",
            "m/s²",
            "x 0.573",
            "°/s",
            "6 decimals",
            "9.795 m/s²  ✓",
        )
        assert source.commands == []
        await pilot.press("question_mark")
        await shows(pilot, "starts the calibration or the recheck")
        await pilot.press("escape")
        await pilot.press("enter")
        await shows(pilot, "▸SETTLE")


async def test_a_stream_that_is_come_back_to_is_the_same_one_and_called_by_its_name() -> None:
    """Opened a second time it would begin a second session."""
    source, opened = fakes.FakeSource(Status(step=StepKind.SETTLE)), list[SourceChoice]()

    def take(choice: SourceChoice) -> fakes.FakeSource:
        opened.append(choice)
        return source

    services = replace(fakes.services(source), open_source=take)
    async with WizardApp(services, None, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "▸SETTLE")
        source.say(Status(step=StepKind.SOURCE))
        await shows(pilot, f" {fakes.STREAM.source}: is this what you expect?")
        await pilot.press("enter")
        await shows(pilot, "▸SETTLE")
    assert opened == [PORT]


async def test_a_field_is_shown_or_reported_missing() -> None:
    source = fakes.FakeSource()
    async with WizardApp(fakes.services(source), None, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "field        none")
        source.stream = replace(source.stream, magnetometer=(20.25, 3.0, -40.0))
        source.say(Status(step=StepKind.SOURCE))
        await shows(pilot, "field        x 20.25 y 3.00 z −40.00 µT")


async def test_an_early_enter_does_not_put_another_source_in_place_of_the_one_ordered() -> None:
    """The virtual IMU stands on top of the list while a long recording is still being read."""
    opened, read = list[SourceChoice](), threading.Event()
    recording = SourceChoice(SourceKind.FILE, "long.csv", "long.csv")

    def take(choice: SourceChoice) -> fakes.FakeSource:
        opened.append(choice)
        assert read.wait(PATIENCE)
        return fakes.FakeSource()

    services = replace(fakes.services(fakes.FakeSource()), open_source=take)
    app = WizardApp(services, None, recording)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "Opening long.csv")
        await pilot.press("enter")
        read.set()
        await until(pilot, lambda: app.state.source is not None)
    assert opened == [recording]


async def test_a_source_is_opened_once_however_often_enter_is_pressed() -> None:
    """Each opening begins a session."""
    opened, ready = list[SourceChoice](), threading.Event()

    def take(choice: SourceChoice) -> fakes.FakeSource:
        opened.append(choice)
        assert ready.wait(PATIENCE)
        return fakes.FakeSource()

    services = replace(fakes.services(fakes.FakeSource()), open_source=take)
    async with WizardApp(services).run_test(size=USUAL) as pilot:
        await shows(pilot, "enter open")
        await pilot.press("enter")
        await until(pilot, lambda: bool(opened))
        await pilot.press("enter", "enter")
        ready.set()
        await shows(pilot, "is this what you expect?")
    assert len(opened) == 1


async def test_enter_tries_the_port_of_the_command_line_again_and_opens_no_other() -> None:
    tried: list[SourceChoice] = []

    def refuse_once(choice: SourceChoice) -> fakes.FakeSource:
        tried.append(choice)
        if len(tried) == 1:
            raise LinkError(f"{choice.target}: no such port")
        return fakes.FakeSource()

    given = SourceChoice(SourceKind.PORT, "/dev/ttyACM7", "/dev/ttyACM7")
    services = replace(fakes.services(fakes.FakeSource()), open_source=refuse_once)
    async with WizardApp(services, None, given).run_test(size=USUAL) as pilot:
        await shows(pilot, "/dev/ttyACM7 cannot be opened", "no such port")
        await pilot.press("enter")
        await shows(pilot, "is this what you expect?")
    assert tried == [given, given]


async def test_a_port_that_cannot_be_opened_says_why_and_leaves_the_choice() -> None:
    def refuse(choice: SourceChoice) -> fakes.FakeSource:
        raise LinkError(f"{choice.target}: no permission; join the group dialout")

    services = replace(fakes.services(fakes.FakeSource()), open_source=refuse, ports=_ports)
    async with WizardApp(services).run_test(size=USUAL) as pilot:
        await shows(pilot, "/dev/ttyACM0")
        await pilot.press("down", "enter")
        await shows(pilot, "cannot be opened", "no permission", "dialout", "virtual IMU")


async def test_a_wrong_unit_and_too_few_digits_are_pointed_out() -> None:
    source = fakes.FakeSource(stream=replace(fakes.STREAM, gravity=1000.0, digits=2))
    async with WizardApp(fakes.services(source), None, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "▲ at rest it should be near 9.81 m/s²", "2 decimals", "▲ few decimals")


@pytest.mark.parametrize(
    ("typed", "kind"),
    [
        ("socket://h:1", SourceKind.PORT),
        ("/dev/ttyUSB0", SourceKind.PORT),
        ("COM3", SourceKind.PORT),
        ("com12", SourceKind.PORT),
        ("COM3.csv", SourceKind.FILE),
        ("dev/run.csv", SourceKind.FILE),
        ("x" * 300, SourceKind.FILE),
    ],
)
async def test_what_is_typed_is_opened_as_a_port_or_as_a_file(typed: str, kind: SourceKind) -> None:
    chosen: list[SourceChoice] = []
    source = fakes.FakeSource()

    def note(choice: SourceChoice) -> fakes.FakeSource:
        chosen.append(choice)
        return source

    services = replace(fakes.services(source), open_source=note)
    async with WizardApp(services).run_test(size=USUAL) as pilot:
        await shows(pilot, "virtual IMU")
        await pilot.press("tab")
        pilot.app.screen.query_one(Input).value = typed
        await pilot.press("enter")
        await until(pilot, lambda: source.running)
    assert (chosen[0].kind, chosen[0].target) == (kind, typed)


@pytest.mark.skipif(sys.platform == "win32", reason="ports have no other names there")
async def test_another_name_of_a_device_is_a_port(tmp_path: Path) -> None:
    chosen: list[SourceChoice] = []

    def take(choice: SourceChoice) -> fakes.FakeSource:
        chosen.append(choice)
        return fakes.FakeSource()

    (tmp_path / "imu").symlink_to(os.devnull)
    services = replace(fakes.services(fakes.FakeSource()), open_source=take)
    async with WizardApp(services).run_test(size=USUAL) as pilot:
        await shows(pilot, "virtual IMU")
        await pilot.press("tab")
        pilot.app.screen.query_one(Input).value = str(tmp_path / "imu")
        await pilot.press("enter")
        await until(pilot, lambda: bool(chosen))
    assert chosen[0].kind is SourceKind.PORT


async def test_unattended_and_recordings_start_by_themselves() -> None:
    source = fakes.FakeSource()
    app = WizardApp(fakes.services(source), AppSettings(auto=True), PORT)
    async with app.run_test(size=USUAL) as pilot:
        await shows(pilot, "▸SETTLE")
    source = fakes.FakeSource()
    recording = SourceChoice(SourceKind.FILE, "a.csv", "a.csv")
    async with WizardApp(fakes.services(source), None, recording).run_test(size=USUAL) as pilot:
        await shows(pilot, "▸SETTLE")


async def test_a_gyroscope_unit_that_is_not_known_is_asked_for() -> None:
    source = fakes.FakeSource()
    columns = [Column(f"a{axis}", "m/s^2", f"acc_{axis}") for axis in "xyz"]
    columns += [Column(f"g{axis}", "", f"gyr_{axis}") for axis in "xyz"]
    line = "0.1,0.2,9.8,0.01,0.02,[red]0.03"
    source.stream = replace(
        fakes.STREAM,
        needs=("gyroscope unit",),
        columns=tuple(columns),
        line=line,
        values=(0.1, 0.2, 9.8, 1, 2, 3),
    )
    app = WizardApp(fakes.services(source), AT_ONCE, PORT)
    async with app.run_test(size=USUAL) as pilot:
        await shows(
            pilot, "which column is what?", "[red]0.03", "acc_x", "gyroscope unit", "▲ choose"
        )
        source.stream = replace(source.stream, line="0.1,9.7,0.2", values=(0.1, 9.7, 0.2, 1, 2, -3))
        source.say(source.status)
        await shows(pilot, "newest line: 0.1,9.7,0.2", "now 9.700", "now −3.000")
        await pilot.press("enter")
        await shows(pilot, "choose the unit of the gyroscope")
        await pilot.press("right", "right", "right", "enter")
        await until(pilot, lambda: bool(source.setups))
    setup = source.setups[0]
    assert setup.gyroscope_unit == "deg/s"
    assert setup.columns[3] == Column("gx", "deg/s", "gyr_x")


async def test_questions_about_columns_say_that_the_device_is_unplugged() -> None:
    """The last line would look like the newest one, and turning the device would change nothing."""
    source = fakes.FakeSource()
    columns = tuple(Column(f"{kind}{axis}", "", "") for kind in "ag" for axis in "xyz")
    live = replace(
        fakes.STREAM,
        needs=("gyroscope unit",),
        columns=columns,
        line="0,0,9.8,1,2,3",
        values=(0.0, 0.0, 9.8, 1.0, 2.0, 3.0),
    )
    source.stream = live
    async with WizardApp(fakes.services(source), AT_ONCE, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "newest line: 0,0,9.8", "now 9.800")
        source.stream = replace(live, connected=False, problem="the port is gone: plug it in again")
        source.say(source.status)
        text = await shows(pilot, "▲ the port is gone: plug it in again")
        assert "newest line" not in text
        assert "now " not in text
        source.stream = live
        source.say(source.status)
        text = await shows(pilot, "newest line: 0,0,9.8", "now 9.800")
        assert "plug it in" not in text


async def test_an_error_in_the_answers_is_taken_back_once_they_are_changed() -> None:
    source = fakes.FakeSource()
    columns = tuple(Column(f"{kind}{axis}", "", "") for kind in "ag" for axis in "xyz")
    source.stream = replace(fakes.STREAM, needs=("gyroscope unit",), columns=columns)
    async with WizardApp(fakes.services(source), AT_ONCE, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "which column is what?")
        await pilot.press("enter")
        await shows(pilot, "▲ choose the unit of the")
        await pilot.press("right")
        await until(pilot, lambda: "choose the unit of" not in seen(pilot))


async def test_the_fields_unit_is_asked_too_and_a_current_beside_it_is_kept() -> None:
    """A unit guessed from the field's size is a guess: iron beside the sensor makes it another."""
    source = fakes.FakeSource()
    columns = [Column(f"a{axis}", "m/s^2", f"a{axis}") for axis in "xyz"]
    columns += [Column(f"g{axis}", "rad/s", f"g{axis}") for axis in "xyz"]
    columns += [Column(f"m{axis}", "uT", f"m{axis}") for axis in "xyz"]
    columns += [Column("current", "mA", "current"), Column("throttle", "%", "throttle")]
    values = (0.1, 0.2, 9.8, 0.0, 0.1, 0.2, 20.0, 3.0, -40.0, 120.0, 5.0)
    source.stream = replace(fakes.STREAM, columns=tuple(columns), values=values)
    async with WizardApp(fakes.services(source), None, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "is this what you expect?")
        await pilot.press("c")
        await shows(pilot, "which column is what?", "magnetometer unit", "22 to 67 µT")
        await pilot.press(*["down"] * 13, "right", "right", "enter")
        await until(pilot, lambda: bool(source.setups))
    setup = source.setups[0]
    assert setup.magnetometer_unit == "mT"
    assert setup.columns[6:] == (
        *(Column(f"m{axis}", "mT", f"m{axis}") for axis in "xyz"),
        Column("current", "mA", "current"),
        Column("throttle", "%", "throttle"),
    )


async def test_a_magnetometer_with_missing_axes_is_ignored() -> None:
    source = fakes.FakeSource()
    columns = tuple(Column(name, "", name) for name in ("ax", "ay", "az", "mx", "my"))
    source.stream = replace(fakes.STREAM, columns=columns, values=(0.1, 0.2, 9.8, 20.0, 3.0))
    async with WizardApp(fakes.services(source), None, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "is this what you expect?")
        await pilot.press("c", "enter")
        await shows(pilot, "the magnetometer needs all of mx, my, mz, or none")


async def test_enter_does_not_overtake_the_keys_before_it() -> None:
    """Keys that arrive together, as from a slow connection, count in their order."""
    source = fakes.FakeSource()
    columns = tuple(Column(name, "", name) for name in ("ax", "ay", "az"))
    source.stream = replace(fakes.STREAM, columns=columns, values=(0.1, 0.2, 9.8))
    async with WizardApp(fakes.services(source), None, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "is this what you expect?")
        for key, character in (("c", "c"), ("enter", "\r")):
            pilot.app.post_message(Key(key, character))
        await shows(pilot, "which column is what?")
        assert "start" not in [name for name, _ in source.commands]


async def test_a_header_that_comes_late_answers_for_the_operator() -> None:
    source = fakes.FakeSource()
    columns = tuple(Column(f"g{axis}", "") for axis in "xyz")
    source.stream = replace(fakes.STREAM, needs=("gyroscope unit",), columns=columns)
    async with WizardApp(fakes.services(source), AT_ONCE, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "which column is what?")
        source.stream = replace(source.stream, needs=())
        source.say(source.status)
        await shows(pilot, "is this what you expect?")
        assert source.setups == []


async def test_nothing_is_asked_while_a_header_may_still_come() -> None:
    source = fakes.FakeSource()
    columns = tuple(Column(f"g{axis}", "") for axis in "xyz")
    source.stream = replace(fakes.STREAM, needs=("gyroscope unit",), columns=columns)
    async with WizardApp(fakes.services(source), None, PORT).run_test(size=USUAL) as pilot:
        text = await shows(pilot, "not known: gyroscope unit", "c columns and units")
        assert "which column" not in text
        assert "enter start " not in text


async def test_columns_without_names_are_mapped_by_hand() -> None:
    source = fakes.FakeSource()
    columns = tuple(Column("", "", f"column {i + 1}") for i in range(3))
    source.stream = replace(
        fakes.STREAM, needs=("columns",), columns=columns, line="0 0 1", values=(0.0, 0.0, 1.0)
    )
    async with WizardApp(fakes.services(source), AT_ONCE, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "column 1", "not used")
        for presses in (3, 4, 5):  # t, ax, ay, az come after "not used"
            await pilot.press(*["right"] * (presses - 1), "down")
        await pilot.press("right", "right", "enter")
        await until(pilot, lambda: bool(source.setups))
    assert [column.channel for column in source.setups[0].columns] == ["ax", "ay", "az"]
    assert source.setups[0].accelerometer_unit == "g"


async def test_no_unit_is_asked_of_a_sensor_that_is_not_there() -> None:
    """Its question opens if a column is said to be of that sensor."""
    source = fakes.FakeSource()
    names = (*(Column(f"a{axis}", "m/s^2", f"a{axis}") for axis in "xyz"), Column("", "", "light"))
    source.stream = replace(
        fakes.STREAM, columns=names, gyroscope=None, values=(0.0, 0.0, 9.8, 3.0)
    )
    async with WizardApp(fakes.services(source), None, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "c columns and units")
        await pilot.press("c")
        text = await shows(pilot, "which column is what?", "gyroscope unit")
        assert "▲ choose" not in text
        await pilot.press("up", "up", "up", "up", "up", *["left"] * 10)  # light is gx

        def asked() -> str:
            return seen(pilot).partition("gyroscope unit")[2].partition("magnetometer unit")[0]

        await until(pilot, lambda: "▲ choose" in asked())
        assert seen(pilot).count("▲ choose") == 1


async def test_a_stream_without_an_accelerometer_is_told_so_and_not_asked_for_columns() -> None:
    source = fakes.FakeSource()
    said = "The stream has no accelerations, and gravity is the reference of all steps"
    columns = tuple(Column(f"m{axis}", "uT", f"m{axis}") for axis in "xyz")
    source.stream = replace(
        fakes.STREAM, needs=NEEDS_ACCELEROMETER, columns=columns, samples=0, warnings=(said,)
    )
    async with WizardApp(fakes.services(source), AT_ONCE, PORT).run_test(size=USUAL) as pilot:
        text = await shows(pilot, "▲ /dev/ttyACM0: no accelerometer", "The stream has no")
        assert "which column" not in text
        assert "enter start " not in text


async def test_the_gravity_of_counts_is_shown_with_its_note() -> None:
    stream = replace(fakes.STREAM, accelerometer_unit="count", gravity=15574.0)
    source = fakes.FakeSource(stream=stream)
    async with WizardApp(fakes.services(source), None, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "15574 count", "the fit determines the scale")


async def test_no_start_is_offered_before_anything_has_arrived() -> None:
    problem = "There is no port /dev/ttyACM0. Plug the device in."
    source = fakes.FakeSource(stream=StreamStatus(source="/dev/ttyACM0", problem=problem))
    async with WizardApp(fakes.services(source), None, PORT).run_test(size=USUAL) as pilot:
        text = await shows(pilot, "There is no port /dev/ttyACM0", "esc other source")
        assert "enter start " not in text


async def test_many_unreadable_lines_are_shown_whole_at_the_usual_size() -> None:
    stream = replace(fakes.STREAM, samples=123_456, lost=7_890, malformed=4_567)
    source = fakes.FakeSource(stream=stream)
    async with WizardApp(fakes.services(source), None, PORT).run_test(size=USUAL) as pilot:
        await shows(pilot, "7890 lost", "4567 lines unreadable")
