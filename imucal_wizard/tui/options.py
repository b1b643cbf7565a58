"""The options of the wizard, and the settings of the app."""

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from imucal_wizard.acquire.files import RecordingOptions
from imucal_wizard.core.description import Description, Location
from imucal_wizard.core.records import dataclass

if TYPE_CHECKING:  # effects need numpy
    from imucal_wizard.model.effect import Effect

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
        location: of the device, from which the gravity follows, or None.
        gyroscope_range: full scale, deg/s, or None if not known.
        rotations: rotations per axis.
        count_faces: count the up/down faces among the 18 poses.
        poses: which poses are asked for: ``8`` (tilted), ``18`` or ``26``.
        resume: session to continue, or None.
        sessions: folder for session files, or None for the user's data folder.
        description: device, place and operator, as far as the user states them.
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
        recheck: calibration that the device is checked against, or None.
        recheck_grade: grade of its sensors, for turn-on spread and ageing.
        gyro_zeroed: the gyroscope's bias is zeroed at each start.
        document: file for the verdict as JSON, or None.
        effects: the user's own effects, for the bench.
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
    location: Location | None = None
    gyroscope_range: float | None = None
    rotations: int = 6
    count_faces: bool = False
    poses: str = "18"
    resume: Path | None = None
    sessions: Path | None = None
    description: Description = Description()
    save: Path | None = None
    force: bool = False
    limits: Mapping[str, float] | None = None
    muted: bool = False
    method: str = "least_squares"
    gyroscope_method: str = "vector"
    magnetometer_method: str = "orthogonal"
    field: float | None = None
    effects: "tuple[Effect, ...]" = ()
    mystery: int | None = None
    grade: str = "consumer"
    key: str = ""
    key_made: bool = False
    recheck: Path | None = None
    recheck_grade: str = "consumer"
    gyro_zeroed: bool = False
    document: str | None = None


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
    """

    auto: bool = False
    quit_after: bool = False
    muted: bool = False
    countdown: float = 20.0
    header_patience: float = 6.0
