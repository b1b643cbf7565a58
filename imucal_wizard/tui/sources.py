"""Opens the chosen source: virtual IMU, port, recording, session to replay or resume."""

import math
import textwrap
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol, runtime_checkable

from imucal_wizard.acquire.files import SUFFIX
from imucal_wizard.core.description import Description
from imucal_wizard.core.errors import SessionError, SessionTakenError, UsageError
from imucal_wizard.core.input import check_file, is_file
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.tui.options import WizardOptions

if TYPE_CHECKING:  # all of these import numpy, which waits until after the first paint
    from imucal_wizard.acquire.setup import StreamSetup
    from imucal_wizard.core.readings import Readings
    from imucal_wizard.guide.steps.recheck import Planner
    from imucal_wizard.measurement.holds import Collected
    from imucal_wizard.report.calibrated_device import CalibratedDevice
    from imucal_wizard.run.engine import Engine
    from imucal_wizard.run.procedure_settings import ProcedureSettings
    from imucal_wizard.run.reader import Link
    from imucal_wizard.run.session_replay import ResumedSession
    from imucal_wizard.run.snapshot import Snapshot
    from imucal_wizard.simulate.imu import VirtualImu


class SampleSource(Protocol):
    """A stream with its procedure, running in its own thread."""

    live: bool
    """Whether it is a device, which can measure more."""

    def start(self) -> None:
        """Start reading."""

    def stop(self) -> None:
        """Stop reading; returns within 100 ms."""

    def snapshot(self) -> "Snapshot":
        """The newest snapshot."""

    def command(self, name: str, argument: str = "") -> None:
        """Pass a command to the procedure."""

    def collected(self) -> "Collected":
        """All measurements."""

    def set_setup(self, setup: "StreamSetup") -> None:
        """Read the stream with this setup from its first byte on."""

    def rescue(self, path: Path) -> None:
        """Write the whole session to another file after its disk has failed.

        Raises:
            SessionError: the file exists already, or cannot be written.
        """

    def describe(self, description: Description) -> None:
        """State device, place and operator; the session keeps it."""


@runtime_checkable
class Hand(Protocol):
    """The virtual hand that moves the virtual device."""

    following: bool
    """Whether it performs the procedure by itself."""

    @property
    def trembling(self) -> bool:
        """Whether the device is held in the hand."""

    def turn(self, axis: str, degrees: float) -> None:
        """Turn the device about one of its axes."""

    def snap_to(self, target: str) -> None:
        """Bring a pose on top."""

    def tremble(self, on: bool) -> None:
        """Hold the device in the hand, or lay it down."""

    def pass_steel(self) -> None:
        """Pass steel by the device, which disturbs the field for a moment."""


class SourceKind(StrEnum):
    """Kinds of sources."""

    VIRTUAL = "virtual"
    PORT = "port"
    FILE = "file"
    SESSION = "session"
    RECHECK = "recheck"
    """A calibration to check the device against; the source is chosen afterwards."""


@dataclass(frozen=True)
class SourceChoice:
    """A source to choose.

    Attributes:
        kind: a virtual device, a port or URL, a recording, an earlier session.
        target: device name, URL or path; "" for the virtual device.
        title: for the list.
        detail: one more line for the list.
        unfinished: a session that can be continued.
    """

    kind: SourceKind
    target: str = ""
    title: str = ""
    detail: str = ""
    unfinished: bool = False


class SourceOpener:
    """Makes sources by the options of the command line.

    Args:
        options: of the command line.

    Attributes:
        session: the session file being written, or None.
        title: of the source.
        played: the recording being played, or None.
        watched: the session being played, or None.
        exercise: an effect is hidden in the source, and its verdicts would give it away.
        sealed: the answer of an exercise, or None.
        gravity: local gravity for the fit, m/s².
        description: device, place and operator of the present source.
        recheck: the calibration that the device is checked against, or None.
        known: the same, read; None without one.
        undone: the correction of a flight controller that was undone, in words, or "".
        moved_to: the port of a session that began at another one, or "".
    """

    def __init__(self, options: WizardOptions) -> None:
        self._options = options
        self.title = ""
        self.session: Path | None = None
        self.played: Readings | None = None
        self.watched: Path | None = None
        self.exercise = False
        self.sealed: Path | None = None
        self.gravity = options.gravity or STANDARD_GRAVITY
        self.description = options.description
        self.recheck = options.recheck
        self.known: CalibratedDevice | None = None
        self.undone = self.moved_to = ""

    def directory(self) -> Path:
        """The folder of the sessions."""
        from imucal_wizard.sessions import default_directory

        return self._options.sessions or default_directory()

    def open(self, choice: SourceChoice) -> SampleSource:
        """Make the chosen source.

        Raises:
            ImucalError: it cannot be opened, and why.
        """
        self.title = choice.title or choice.target
        self.session, self.played, self.watched = None, None, None
        self.undone = self.moved_to = ""
        self.exercise, self.sealed = False, None
        self.description = self._options.description
        self.known = None if self.recheck is None else self._known(self.recheck, {})
        if choice.kind is SourceKind.SESSION or choice.target.endswith(SUFFIX):
            return self._resumed(Path(choice.target))
        if choice.kind is SourceKind.FILE:
            paths = (Path(choice.target),) if choice.target else self._options.replay
            return self._player(paths)
        if choice.kind is SourceKind.PORT:
            return self._reader(choice.target)
        return self._virtual()

    def _known(self, path: Path, before: Mapping[str, Any]) -> "CalibratedDevice":
        """The calibration that the device is checked against.

        Args:
            path: its file.
            before: settings of a recheck that goes on; empty for a new one.

        Raises:
            RecordingError: it cannot be read, or was edited by hand.
            UsageError: it has no accelerometer.
        """
        from imucal_wizard.report.calibrated_device import CalibratedDevice, RecheckSettings
        from imucal_wizard.report.calibration_file import read_calibration

        options = self._options
        settings = RecheckSettings(
            datetime.now().astimezone(),
            str(before.get("recheck_grade", options.recheck_grade)),
            before.get("limits", options.limits),
            bool(before.get("gyro_zeroed", options.gyro_zeroed)),
            options.gravity,
            options.effects,
        )
        known = CalibratedDevice(read_calibration(path), settings)
        self.gravity = known.criteria.gravity
        return known

    def _planner_of(self, about: Mapping[str, Any]) -> "Planner | None":
        """The planner of an earlier session, if that is a recheck; else None.

        Raises:
            ImucalError: its calibration or its settings cannot be read.
        """
        if "recheck" not in about:
            return None
        self.recheck = Path(str(about["recheck"]))
        try:
            self.known = self._known(self.recheck, about)
        except (LookupError, TypeError, ValueError, AttributeError) as error:
            raise SessionError(
                f"the session is damaged: its recheck has no limits ({error}); begin a new one"
            ) from error
        return self.known.next_pose

    def _virtual(self) -> SampleSource:
        """The virtual IMU; an exercise has a random hidden effect and a sealed answer."""
        from imucal_wizard.run.reader import Reader

        options = self._options
        checked = () if self.known is None else self.known.calibration.sensors
        field = options.magnetometer or "magnetometer" in checked
        about: dict[str, Any] = {"kind": "virtual", "magnetometer": field}
        if options.mystery is None:
            about |= {"seed": options.seed, "hidden": list(options.hidden)}
        else:
            from imucal_wizard.teach.exercise_session import covered_number

            about |= {"mystery": covered_number(options.mystery), "grade": options.grade}
        imu = virtual_imu(about, options)
        if options.mystery is None:  # each exercise has a device of its own
            self._propose(Description("virtual IMU", f"seed {options.seed}"))
        engine = self._begin(about, float(imu.sensor.gyroscope.highest))
        if options.mystery is not None and self.session is not None:
            from imucal_wizard.teach.exercise_session import (
                draw_exercise_session,
                seal_beside_session,
            )

            exercise = draw_exercise_session(
                options.mystery, options.grade, magnetometer=options.magnetometer
            )
            self.exercise = True
            self.sealed = seal_beside_session(self.session, exercise, options.key)
        return Reader(imu, engine)

    def _reader(self, port: str) -> SampleSource:
        from imucal_wizard.run.reader import Pump, Reader
        from imucal_wizard.sessions import remove_session

        about = {"kind": "port", "port": port, "baud": self._options.baud}
        found = self._device_at(port)
        self._propose(found)
        if self.known is not None:
            self.known.check_device(self.description.serial)
            self._propose(self.known.described.over(found))
        link = self._link(port, self._options.baud)
        engine, path = self._begin(about), self.session
        assert path is not None, "the engine writes it"  # noqa: S101 (narrows the type)
        return Reader(
            Pump(link),
            engine,
            silent=lambda: remove_session(path),
        )

    def _link(self, port: str, baud: int) -> "Link":
        """A port, or a flight controller whose uncorrected sensor is read.

        Raises:
            LinkError: there is no flight controller, or it is armed.
            UsageError: its correction cannot be undone.
        """
        from imucal_wizard.acquire.mavlink import MAVLINK, VehicleLink
        from imucal_wizard.acquire.transport import Transport

        if not port.startswith(MAVLINK):
            return Transport(port, baud)
        from imucal_wizard.report.text import TEXT_COLUMNS
        from imucal_wizard.report.vehicle import undoing, undone_text

        vehicle = VehicleLink(port, baud, undoing)
        vehicle.open()
        said = undone_text(vehicle.autopilot, vehicle.parameters)
        self.undone = textwrap.fill(said, TEXT_COLUMNS)
        return vehicle

    def _propose(self, device: Description) -> None:
        """Describe the device by what is known of it, unless the user states otherwise."""
        self.description = self._options.description.over(device)

    def _device_at(self, port: str) -> Description:
        """The device by VID:PID and serial number of its port, with its name if it has one."""
        from imucal_wizard.acquire.ports import list_ports, same_device
        from imucal_wizard.sessions.catalogue import Catalogue

        found = same_device(port, list_ports())
        if found is None or not found.vid_pid:
            return Description(f"unnamed at {port.removeprefix('/dev/')}")
        kind = found.hint or found.description or "USB device"
        device = Description(f"{kind} {found.serial_number or found.vid_pid}", found.serial_number)
        with Catalogue(self.directory()) as catalogue:
            for known in catalogue.devices() if found.serial_number else ():
                if known.serial == found.serial_number:
                    return Description(known.name, known.serial, known.chip)
        return device

    def _begin(self, about: dict[str, Any], full_scale: float | None = None) -> "Engine":
        """An engine that writes a new session.

        Args:
            about: how to open the same source again.
            full_scale: of the gyroscope, rad/s, if the source knows it; an option overrides it.
        """
        from imucal_wizard.run.session_replay import begin_session
        from imucal_wizard.sessions import new_session_path

        setup, settings = stream_setup(self._options), self._settings()
        about = about | {"description": self.description.stated()}
        planner = None if self.known is None else self.known.next_pose
        if self.known is not None and self.recheck is not None:
            chosen = self.known.settings
            about |= {
                "recheck": str(self.recheck.resolve()),
                "recheck_grade": chosen.grade,
                "limits": chosen.limits,
                "gyro_zeroed": chosen.gyro_zeroed,
            }
        settings = replace(settings, gyroscope_range=settings.gyroscope_range or full_scale)
        while True:
            self.session = new_session_path(self.directory(), datetime.now().astimezone())
            try:
                return begin_session(
                    self.session,
                    setup,
                    settings,
                    source=self.title,
                    about=about,
                    planner=planner,
                )
            except SessionTakenError:  # another program has just created a file of this name
                continue

    def _resumed(self, path: Path) -> SampleSource:
        """The source of an earlier session, which is replayed before it continues."""
        from imucal_wizard.run.session_replay import resume_session
        from imucal_wizard.sessions.session_list import session_info

        if not is_file(path):
            raise SessionError(f"there is no session {path}; give the path of an .imucal file")
        resumed = resume_session(path, self._planner_of)
        self.session = path
        self._hide_again(resumed.about, path)
        self.gravity = self._options.gravity or resumed.engine.settings.gravity
        self.title = resumed.engine.source or self.title
        self._propose(session_info(path).description)
        with ExitStack() as on_failure:
            on_failure.callback(resumed.session.close)
            source = self._opened_again(resumed)
            on_failure.pop_all()
        return source

    def _hide_again(self, about: Mapping[str, Any], path: Path) -> None:
        """An earlier session that was an exercise remains one."""
        self.exercise = "mystery" in about
        if self.exercise:
            from imucal_wizard.teach.exercise import ANSWER_SUFFIX

            answer = path.with_suffix(ANSWER_SUFFIX)
            self.sealed = answer if answer.is_file() else None

    def _opened_again(self, resumed: "ResumedSession") -> SampleSource:
        """Open the source of a session again; a device may be at another port now."""
        from imucal_wizard.run.reader import Pump, Reader

        about, path, options = resumed.about, resumed.session.path, self._options
        virtual = about.get("kind") == "virtual"
        if virtual and options.port:
            raise UsageError(f"{path} is a session of the virtual IMU; leave --port out")
        try:
            imu = virtual_imu(about, options) if virtual else None
            baud = int(about.get("baud", options.baud))
        except (TypeError, ValueError, UsageError) as error:
            raise SessionError(f"{path} is damaged ({error}); begin a new session") from error
        if imu is not None:
            return Reader(imu, resumed.engine, prepare=resumed.prepare)
        before = str(about.get("port", ""))
        port = options.port or before
        if not port:
            raise SessionError(f"{path} does not say which port it was; add --port PORT")
        self.moved_to = port if port != before else ""
        return Reader(Pump(self._link(port, baud)), resumed.engine, prepare=resumed.prepare)

    def _player(self, paths: Sequence[Path]) -> SampleSource:
        """A recording with the present procedure, or a session with its operator's commands."""
        from imucal_wizard.acquire.files import is_session

        for path in paths:
            check_file(path)
        if len(paths) == 1 and is_session(paths[0]):
            return self._session_player(paths[0])
        from imucal_wizard.acquire.files.recording_files import read_files
        from imucal_wizard.acquire.files.session_salvage import corrections_note
        from imucal_wizard.run.engine import Engine
        from imucal_wizard.run.player import Player, ReadingsTape

        readings = read_files(list(paths), self._options.recording)
        undone = (text for path in paths for text in corrections_note(path))
        self.played = replace(readings, warnings=(*undone, *readings.warnings))
        settings = self._settings()
        settings = replace(settings, procedure=replace(settings.procedure, led=False))
        planner = None if self.known is None else self.known.next_pose
        title = " + ".join(path.name for path in paths)
        engine = Engine(None, settings, source=title, planner=planner)
        return Player(ReadingsTape(self.played), engine, self._options.speed)

    def _session_player(self, path: Path) -> SampleSource:
        from imucal_wizard.acquire.files.recording_files import with_options
        from imucal_wizard.run.player import Player, SessionTape
        from imucal_wizard.run.session_replay import SessionReplay
        from imucal_wizard.sessions import KeptSession
        from imucal_wizard.sessions.session_list import session_info

        options, session = self._options, KeptSession.look(path)
        with ExitStack() as on_failure:
            on_failure.callback(session.close)
            past = SessionReplay(session, lambda setup: with_options(setup, options.recording))
            engine = past.engine(self._planner_of(past.about))
            player = Player(SessionTape(past), engine, options.speed)
            on_failure.pop_all()
        self._hide_again(past.about, path)
        self.watched, self.gravity = path, options.gravity or past.settings.gravity
        self._propose(session_info(path).description)
        return player

    def _settings(self) -> "ProcedureSettings":
        from imucal_wizard.guide.plan import RECHECK_STEPS, Procedure, standard
        from imucal_wizard.run.procedure_settings import ProcedureSettings

        options = self._options
        limit = options.gyroscope_range
        turns = 0 if options.gyroscope_method == "offset" else options.rotations
        procedure = standard(turns, poses=options.poses, count_faces=options.count_faces)
        return ProcedureSettings(
            procedure if self.known is None else Procedure(RECHECK_STEPS),
            options.gravity or (STANDARD_GRAVITY if self.known is None else self.gravity),
            None if limit is None else math.radians(limit),
        )


def virtual_imu(about: Mapping[str, Any], options: WizardOptions) -> "VirtualImu":
    """The virtual IMU that a session describes.

    Args:
        about: ``mystery`` and ``grade`` of an exercise; else ``seed`` and ``hidden``;
            ``magnetometer``.
        options: its speed, and whether the hand performs everything.

    Raises:
        UsageError: a hidden effect or a grade does not exist.
        ValueError: a number is none.
    """
    from imucal_wizard.simulate.imu import VirtualImu

    field = bool(about.get("magnetometer", False))
    if "mystery" not in about:
        seed, hidden = int(about.get("seed", 0)), tuple(map(str, about.get("hidden", ())))
        return VirtualImu(
            seed=seed,
            speed=options.speed,
            hidden=hidden,
            magnetometer=field,
            following=options.auto,
        )
    from imucal_wizard.teach.exercise_session import draw_exercise_session, uncovered_number

    number = uncovered_number(about["mystery"])
    exercise = draw_exercise_session(number, str(about.get("grade")), magnetometer=field)
    return VirtualImu(
        seed=exercise.hand,
        speed=options.speed,
        sensor=exercise.sensor,
        hidden=[exercise.truth],
        magnetometer=exercise.magnetometer,
        ammeter=exercise.magnetometer,
        following=options.auto,
    )


def stream_setup(options: WizardOptions) -> "StreamSetup":
    """The setup of a stream by the options.

    Raises:
        UsageError: a column or a unit does not exist.
    """
    from imucal_wizard.acquire.files.recording_files import with_options
    from imucal_wizard.acquire.setup import StreamSetup

    return with_options(StreamSetup(format=options.format), options.recording)
