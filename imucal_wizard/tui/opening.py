"""Opening what was chosen: the virtual IMU, a port, a recording, an earlier session."""

import math
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import replace
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from imucal_wizard.errors import RecordingError, SessionError
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.source import Source, SourceChoice, SourceKind
from imucal_wizard.units import STANDARD_GRAVITY

if TYPE_CHECKING:  # all of these import numpy, which waits until after the first paint
    from imucal_wizard.devices.setup import StreamSetup
    from imucal_wizard.live.engine import Engine
    from imucal_wizard.live.settings import Settings
    from imucal_wizard.readings import Readings


class Opening:
    """Makes sources as the command line's options want them.

    Args:
        options: what the command line says.

    Attributes:
        session: the session file being written, or None.
        title: what is read, in words.
        played: the recording being played, or None.
        watched: the session being played, or None.
        sealed: the answer of an exercise, or None.
        gravity: local gravity by which the result is fitted, m/s².
    """

    def __init__(self, options: WizardOptions) -> None:
        self._options = options
        self.title = ""
        self.session: Path | None = None
        self.played: Readings | None = None
        self.watched: Path | None = None
        self.sealed: Path | None = None
        self.gravity = options.gravity or STANDARD_GRAVITY

    def directory(self) -> Path:
        """Where sessions are kept."""
        from imucal_wizard.sessions import default_directory

        return self._options.sessions or default_directory()

    def open_source(self, choice: SourceChoice) -> Source:
        """Make the source chosen.

        Raises:
            ImucalError: it cannot be opened, and why.
        """
        self.title = choice.title or choice.target
        self.session, self.played, self.watched = None, None, None
        if choice.kind is SourceKind.SESSION or choice.target.endswith(".imucal"):
            return self._resumed(Path(choice.target))
        if choice.kind is SourceKind.FILE:
            paths = (Path(choice.target),) if choice.target else self._options.replay
            return self._player(paths)
        if choice.kind is SourceKind.PORT:
            return self._reader(choice.target)
        return self._virtual()

    def _virtual(self) -> Source:
        from imucal_wizard.devices.virtual import VirtualImu
        from imucal_wizard.tui.virtual_reader import VirtualReader

        options = self._options
        if options.mystery is not None:
            return self._exercise(options.mystery)
        imu = VirtualImu(
            seed=options.seed,
            speed=options.speed,
            hidden=options.hidden,
            magnetometer=options.magnetometer,
        )
        about = {"kind": "virtual", "seed": options.seed, "hidden": list(options.hidden)}
        about["magnetometer"] = options.magnetometer
        engine = self._begin(about, float(imu.sensor.gyroscope.highest))
        return VirtualReader(imu, engine, following=options.auto)

    def _exercise(self, number: int) -> Source:
        """A virtual IMU with an effect that chance has hidden; the answer lies beside, sealed."""
        from imucal_wizard.mystery.sitting import seal_beside, sitting
        from imucal_wizard.tui.taking_up import virtual_imu
        from imucal_wizard.tui.virtual_reader import VirtualReader

        options = self._options
        made = sitting(number, options.grade, magnetometer=options.magnetometer)
        imu = virtual_imu(made, options.speed)
        about = {"kind": "virtual", "mystery": made.number, "grade": made.grade}
        about["magnetometer"] = options.magnetometer
        engine = self._begin(about, float(imu.sensor.gyroscope.highest))
        if self.session is not None:
            self.sealed = seal_beside(self.session, made, options.key)
        return VirtualReader(imu, engine, following=options.auto)

    def _reader(self, port: str) -> Source:
        from imucal_wizard.devices.link import Transport
        from imucal_wizard.live.reader import Reader

        about = {"kind": "port", "port": port, "baud": self._options.baud}
        return Reader(Transport(port, self._options.baud), self._begin(about))

    def _begin(self, about: dict[str, Any], full_scale: float | None = None) -> "Engine":
        """An engine that writes a new session.

        Args:
            about: what is needed to open the same source again.
            full_scale: of the gyroscope, rad/s, where the source knows it and the user says none.
        """
        from imucal_wizard.live.resume import begin
        from imucal_wizard.sessions import new_path

        self.session = new_path(self.directory(), datetime.now().astimezone())
        settings = self._settings()
        settings = replace(settings, gyroscope_range=settings.gyroscope_range or full_scale)
        return begin(
            self.session, stream_setup(self._options), settings, source=self.title, about=about
        )

    def _resumed(self, path: Path) -> Source:
        from imucal_wizard.live.resume import resume
        from imucal_wizard.tui.taking_up import opened_again

        if not path.is_file():
            raise SessionError(f"there is no session {path}; give the path of an .imucal file")
        taken_up = resume(path)
        self.session = path
        self.gravity = self._options.gravity or taken_up.engine.settings.gravity
        self.title = taken_up.engine.source or self.title
        with ExitStack() as on_failure:
            on_failure.callback(taken_up.session.close)
            source = opened_again(taken_up, self._options)
            on_failure.pop_all()
        return source

    def _player(self, paths: Sequence[Path]) -> Source:
        from imucal_wizard.recordings.session import is_session
        from imucal_wizard.tui.playing import recording_player, session_player

        for path in paths:
            if not path.is_file():
                raise RecordingError(f"there is no file {path}; check the path")
        options = self._options
        if len(paths) == 1 and is_session(paths[0]):
            player, gravity = session_player(paths[0], options.recording, options.speed)
            self.watched, self.gravity = paths[0], options.gravity or gravity
            return player
        player, self.played = recording_player(
            paths, options.recording, options.speed, self._settings()
        )
        return player

    def _settings(self) -> "Settings":
        from imucal_wizard.live.settings import Settings
        from imucal_wizard.procedure.plan import standard

        options = self._options
        limit = options.gyroscope_range
        turns = 0 if options.gyroscope_method == "offset" else options.rotations
        return Settings(
            standard(turns, poses=options.poses, count_faces=options.count_faces),
            options.gravity or STANDARD_GRAVITY,
            None if limit is None else math.radians(limit),
        )


def stream_setup(options: WizardOptions) -> "StreamSetup":
    """What the options say of a stream.

    Raises:
        UsageError: a column or a unit does not exist.
    """
    from imucal_wizard.devices.setup import StreamSetup
    from imucal_wizard.recordings.session import with_options

    return with_options(StreamSetup(format=options.format), options.recording)
