"""``imucal-wizard``: the guided calibration on the screen."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from imucal_wizard.cli.arguments import (
    Parser,
    add_effects,
    add_exercise,
    add_gravity,
    add_limits,
    add_magnetometer,
    add_methods,
    add_port,
    add_recording_options,
    add_saving,
    add_sensor,
    add_speed,
    check_exercise,
    gravity_given,
    kept_session,
    limits_of_use,
    location_given,
    own_effects,
    positive,
    recording_options,
    said_about,
)
from imucal_wizard.cli.outcome import spare, spare_others
from imucal_wizard.core.errors import UsageError
from imucal_wizard.tui.options import WizardOptions

USAGE = (
    ("", "open the wizard, and choose a source"),
    ("--magnetometer", "the same with a magnetometer in the virtual IMU"),
    ("--port PORT", "the wizard on a serial port or URL"),
    ("--replay FILE...", "the wizard on a recording or session"),
    ("--resume SESSION", "continue a session where it was left"),
    ("--auto --quit", "the virtual hand performs everything"),
    ("--mystery", "an exercise: find the effect hidden in the virtual IMU"),
)


def parser() -> Parser:
    """The options of the wizard."""
    made = Parser(
        prog="imucal-wizard",
        description="Open the wizard: on the virtual IMU, on a port, or on a recording.",
    )
    _add_source(made.add_argument_group("source"))
    _add_virtual(made.add_argument_group("virtual IMU"))
    _add_procedure(made.add_argument_group("procedure"))
    add_recording_options(made)
    add_gravity(made)
    add_methods(made)
    add_magnetometer(made)
    return made


def _add_source(source: "argparse._ArgumentGroup") -> None:
    """Options for the source of the samples."""
    says = "read a device: /dev/ttyACM0, COM3, socket://HOST:PORT, rfc2217://HOST:PORT"
    add_port(source, says)
    source.add_argument(
        "--format",
        default="auto",
        metavar="NAME",
        help="format of the device, if it is not recognised",
    )
    source.add_argument(
        "--replay",
        nargs="+",
        type=Path,
        default=[],
        metavar="FILE",
        help="play a recording or a session",
    )
    source.add_argument(
        "--resume",
        type=Path,
        metavar="SESSION",
        help="continue a session where it was left; with --port if the device has a new name",
    )
    add_speed(source, "a recording or of the virtual IMU")


def _add_virtual(virtual: "argparse._ArgumentGroup") -> None:
    """Options for the virtual IMU."""
    virtual.add_argument(
        "--auto", action="store_true", help="let the virtual hand perform the whole procedure"
    )
    virtual.add_argument("--quit", action="store_true", help="quit once the result is saved")
    virtual.add_argument(
        "--magnetometer", action="store_true", help="simulate a magnetometer, too, and add its step"
    )
    add_sensor(virtual)
    add_exercise(
        virtual,
        "hide a random effect and cover the answer, which is not secret: this computer knows it",
    )


def _add_procedure(way: "argparse._ArgumentGroup") -> None:
    """Options for the procedure and its files."""
    way.add_argument(
        "--rotations",
        type=int,
        default=6,
        metavar="N",
        help="rotations about each axis (default 6)",
    )
    way.add_argument(
        "--poses",
        choices=("8", "18", "26"),
        default="18",
        help="poses: 18 (faces and edges), 26 (corners too), or N's 8, tilted (default 18)",
    )
    way.add_argument(
        "--count-faces",
        action="store_true",
        help="count the faces of the up/down step among the 18 poses",
    )
    way.add_argument(
        "--gyro-range",
        type=positive,
        metavar="DEG_S",
        help="full scale of the gyroscope, °/s: rotations that reach it are refused",
    )
    add_saving(way, "save the calibration to this file (default: beside the session)")
    add_limits(way)
    add_effects(way)
    way.add_argument("--mute", action="store_true", help="no sounds")


def run(argv: Sequence[str]) -> int:
    """Open the wizard."""
    arguments = parser().parse_args(argv)
    _check(arguments)
    from imucal_wizard.tui.run import run_wizard

    return run_wizard(_options(arguments))


def _check(arguments: argparse.Namespace) -> None:
    """Refuse options that contradict one another.

    Raises:
        UsageError: two sources, an option of another source, or an impossible number of rotations.
    """
    chosen = [name for name in ("port", "replay", "resume") if getattr(arguments, name)]
    elsewhere = chosen == ["port", "resume"]  # the device may have a new name
    if len(chosen) > 1 and not elsewhere:
        raise UsageError(f"--{chosen[0]} and --{chosen[1]} are two sources: give one of them")
    virtual = (arguments.auto, arguments.hidden, arguments.mystery, arguments.magnetometer)
    if chosen and any(virtual):
        raise UsageError(
            "--auto, --hidden, --mystery and --magnetometer belong to the virtual IMU, not to "
            f"--{chosen[0]}"
        )
    check_exercise(arguments)
    spare([*arguments.replay, *filter(None, [arguments.resume])], arguments.save)
    spare_others(arguments)
    if not 1 <= arguments.rotations <= 100:
        raise UsageError("--rotations must lie between 1 and 100 for each axis")


def _options(arguments: argparse.Namespace) -> WizardOptions:
    """The options in the form that the wizard takes."""
    return WizardOptions(
        port=arguments.port,
        baud=arguments.baud,
        format=arguments.format,
        replay=tuple(arguments.replay),
        recording=recording_options(arguments),
        speed=arguments.speed,
        auto=arguments.auto,
        quit=arguments.quit,
        hidden=tuple(arguments.hidden),
        magnetometer=arguments.magnetometer,
        seed=arguments.seed or 0,
        gravity=gravity_given(arguments),
        location=location_given(arguments),
        gyroscope_range=arguments.gyro_range,
        rotations=arguments.rotations,
        count_faces=arguments.count_faces,
        poses=arguments.poses,
        resume=kept_session(arguments.resume, arguments),
        sessions=arguments.sessions,
        description=said_about(arguments),
        save=arguments.save,
        force=arguments.force,
        limits=limits_of_use(arguments),
        muted=arguments.mute,
        method=arguments.method,
        gyroscope_method=arguments.gyro_method,
        magnetometer_method=arguments.mag_method,
        field=arguments.field,
        effects=tuple(own_effects(arguments.effects)),
        **_mystery(arguments),
    )


def _mystery(arguments: argparse.Namespace) -> dict[str, Any]:
    """Number, grade and key of an exercise; empty without one."""
    if not arguments.mystery:
        return {}
    from imucal_wizard.teach.exercise import random_key
    from imucal_wizard.teach.exercise_session import random_number

    number = random_number() if arguments.seed is None else arguments.seed
    key, made = (random_key(), True) if arguments.key is None else (arguments.key, False)
    return {"mystery": number, "grade": arguments.grade, "key": key, "key_made": made}
