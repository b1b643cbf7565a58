"""The options of the wizard, and the settings of the app."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.core.records import dataclass

FRAMES_PER_SECOND = 20.0
"""Snapshots per second."""


@dataclass(frozen=True)
class WizardOptions:
    """How the wizard is opened.

    Attributes:
        port: port or URL, or None.
        baud: bits per second.
        format: name of the stream's format, or ``auto``.
        replay: recordings, or one session, to play instead of a port.
        recording: columns, rate and units that the files do not name; they also serve
            for a stream.
        speed: speed of a recording or of the virtual IMU, as a multiple of real time.
        auto: the virtual hand performs the whole procedure.
        quit: leave after the result is saved.
        hidden: effects hidden in the virtual sensor, ``TERM:SIZE:AXIS``.
        magnetometer: the virtual sensor has a magnetometer.
        seed: seed of the virtual sensor and hand.
        gravity: local gravity, m/s²; None for the standard one, or that of the session.
        gyroscope_range: full scale, deg/s, or None if not known.
        rotations: rotations per axis.
        count_faces: count the up/down faces among the 18 poses.
        poses: which poses are asked for: ``8`` (tilted), ``18`` or ``26``.
        resume: session to continue, or None.
        sessions: folder for session files, or None for the user's data folder.
        save: file for the calibration, or None for a name beside the session.
        force: save sensors whose calibration is worse than none, too.
        limits: of use by sensor, in m/s², rad and µT; None for the usual ones.
        muted: no sounds.
        method: the accelerometer's method.
        gyroscope_method: the gyroscope's method.
        magnetometer_method: the magnetometer's method.
        field: magnitude of the local magnetic field, µT, or None if not known.
        mystery: number of an exercise with a random hidden effect, or None.
        grade: grade of the exercise's sensor.
        key: the word that opens its sealed answer.
        key_made: the program made that word and prints it at the end.
        effects: files with the user's own effects, for the bench.
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
    force: bool = False
    limits: Mapping[str, float] | None = None
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
        auto: the virtual hand performs the procedure; nobody is asked.
        quit_after: quit as soon as the result is saved.
        muted: start without sounds.
        countdown: time for which the result is shown before the validation begins, s.
        header_patience: time to wait for a header before the columns are asked for, s; devices
            that repeat their header do so within five seconds.
        predict: the bench hides its answer until a guess when it is opened first.
    """

    auto: bool = False
    quit_after: bool = False
    muted: bool = False
    countdown: float = 20.0
    header_patience: float = 6.0
    predict: bool = False
