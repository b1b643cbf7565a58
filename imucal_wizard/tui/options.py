"""What the command line says to the wizard, and how the app behaves."""

import dataclasses
from pathlib import Path

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.core.records import dataclass

FRAMES_PER_SECOND = 20.0
"""How often the screen asks for a snapshot."""


@dataclass(frozen=True)
class WizardOptions:
    """How the wizard is opened.

    Attributes:
        port: port or URL, or None for the virtual IMU or the choice on the screen.
        baud: bits per second.
        format: name of the stream's format, or ``auto``.
        replay: recordings or one session to play instead of a port.
        recording: what these files do not say themselves; its columns, rate and units also serve
            for a stream.
        speed: samples per second of playing, as a multiple of the true rate.
        auto: the virtual hand performs everything.
        quit: leave after the result is saved.
        hidden: effects hidden in the virtual sensor, ``TERM:SIZE:AXIS``.
        magnetometer: the virtual sensor has a magnetometer.
        seed: which virtual sensor and hand.
        gravity: local gravity, m/s²; None for the standard one, or that of the session.
        gyroscope_range: full scale, deg/s, or None when not known.
        rotations: rotations per axis.
        count_faces: count the up/down faces among the 18 poses.
        poses: which poses are asked for: ``8`` (tilted), ``18`` or ``26``.
        resume: session to go on with, or None.
        sessions: folder for session files, or None for the user's data folder.
        save: file for the calibration, or None for a name beside the session.
        muted: no sounds.
        method: the accelerometer's method.
        gyroscope_method: the gyroscope's method.
        magnetometer_method: the magnetometer's method.
        field: magnitude of the local magnetic field, µT, or None when it is not known.
        mystery: number of an exercise: an effect that chance hides in the virtual sensor; or None.
        grade: how good that sensor is.
        key: the word that opens its sealed answer.
        key_made: the program made that word, so that it is told at the end.
        effects: files with effects of the user's own, for the bench.
    """

    port: str | None = None
    baud: int = 115200
    format: str = "auto"
    replay: tuple[Path, ...] = ()
    recording: RecordingOptions = dataclasses.field(default_factory=RecordingOptions)
    speed: float = 1.0
    auto: bool = False
    quit: bool = False
    hidden: tuple[str, ...] = ()
    magnetometer: bool = False
    seed: int = 0
    gravity: float | None = None
    gyroscope_range: float | None = None
    rotations: int = 6
    count_faces: bool = False
    poses: str = "18"
    resume: Path | None = None
    sessions: Path | None = None
    save: Path | None = None
    muted: bool = False
    method: str = "least_squares"
    gyroscope_method: str = "vector"
    magnetometer_method: str = "orthogonal"
    field: float | None = None
    effects: tuple[Path, ...] = ()
    mystery: int | None = None
    grade: str = "consumer"
    key: str = ""
    key_made: bool = False


@dataclass(frozen=True)
class AppSettings:
    """Choices made on the command line.

    Attributes:
        auto: the virtual hand does the work and every choice is made by itself.
        quit_after: leave as soon as the result is saved.
        muted: start without sounds.
        countdown: seconds the result is shown before the validation begins by itself.
        header_patience: seconds a header is waited for before the operator is asked what the
            columns are: a device that was opened in the middle of its stream prints the next one
            within five.
        predict: the bench tells nothing before a guess when it is opened first.
    """

    auto: bool = False
    quit_after: bool = False
    muted: bool = False
    countdown: float = 20.0
    header_patience: float = 6.0
    predict: bool = False
