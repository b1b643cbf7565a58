"""``imucal-wizard``: the app that leads through the calibration."""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from imucal_wizard.commands.arguments import (
    Parser,
    add_effects,
    add_gravity,
    add_magnetometer,
    add_methods,
    add_recording_options,
    positive,
    recording_options,
)
from imucal_wizard.commands.exercise import add_exercise, add_sensor, check_exercise
from imucal_wizard.commands.places import file_to_write, spare
from imucal_wizard.errors import UsageError
from imucal_wizard.tui.options import WizardOptions


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
    """Where the samples come from."""
    source.add_argument(
        "--port",
        metavar="PORT_OR_URL",
        help="read a device: /dev/ttyACM0, COM3, socket://HOST:PORT, rfc2217://HOST:PORT",
    )
    source.add_argument(
        "--baud", type=int, default=115200, metavar="N", help="speed of the port (default 115200)"
    )
    source.add_argument(
        "--format",
        default="auto",
        metavar="NAME",
        help="how the device prints, where it is not recognised by itself",
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
        help="go on with a session where it was left; --port where the device has another name now",
    )
    source.add_argument(
        "--speed",
        type=float,
        default=1.0,
        metavar="X",
        help="let a recording, or the virtual IMU, run X times faster (default 1)",
    )


def _add_virtual(virtual: "argparse._ArgumentGroup") -> None:
    """What the virtual IMU is, and who moves it."""
    virtual.add_argument(
        "--auto", action="store_true", help="let the virtual hand perform the whole procedure"
    )
    virtual.add_argument(
        "--quit", action="store_true", help="leave by itself once the result is saved"
    )
    virtual.add_argument(
        "--magnetometer", action="store_true", help="give it a magnetometer, and the step for it"
    )
    add_sensor(virtual)
    add_exercise(virtual, "hide an effect by chance and seal the answer")


def _add_procedure(way: "argparse._ArgumentGroup") -> None:
    """What is asked for, and where it goes."""
    way.add_argument(
        "--rotations",
        type=int,
        default=6,
        metavar="N",
        help="turns asked for about each axis (default 6)",
    )
    way.add_argument(
        "--poses",
        choices=("8", "18", "26"),
        default="18",
        help="poses asked for: 18 (faces and edges), 26 (corners too), or N's 8, tilted (default "
        "18)",
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
        help="full scale of the gyroscope, °/s: turns that reach it are refused",
    )
    way.add_argument(
        "--sessions",
        type=Path,
        metavar="DIR",
        help="folder for the sessions (default: this program's place in your data folder)",
    )
    way.add_argument(
        "--save",
        type=file_to_write,
        metavar="FILE",
        help="save the calibration to this file (default: beside the session)",
    )
    add_effects(way)
    way.add_argument("--mute", action="store_true", help="no sounds")


def run(argv: Sequence[str]) -> int:
    """Open the wizard and stay until it is left."""
    arguments = parser().parse_args(argv)
    _check(arguments)
    from imucal_wizard.tui.run import run_wizard

    return run_wizard(_options(arguments))


def _check(arguments: argparse.Namespace) -> None:
    """Refuse what contradicts itself, before anything is opened.

    Raises:
        UsageError: two sources, an option of another source, or a number out of its range.
    """
    chosen = [name for name in ("port", "replay", "resume") if getattr(arguments, name)]
    elsewhere = chosen == ["port", "resume"]  # the device has another name than it had then
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
    if not 0.0 < arguments.speed <= 1000.0:
        raise UsageError("--speed must lie above 0 and at most at 1000")
    if not 1 <= arguments.rotations <= 100:
        raise UsageError("--rotations must lie between 1 and 100 for each axis")


def _options(arguments: argparse.Namespace) -> WizardOptions:
    """The options as the wizard takes them."""
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
        gravity=arguments.gravity,
        gyroscope_range=arguments.gyro_range,
        rotations=arguments.rotations,
        count_faces=arguments.count_faces,
        poses=arguments.poses,
        resume=arguments.resume,
        sessions=arguments.sessions,
        save=arguments.save,
        muted=arguments.mute,
        method=arguments.method,
        gyroscope_method=arguments.gyro_method,
        magnetometer_method=arguments.mag_method,
        field=arguments.field,
        effects=tuple(arguments.effects),
        **_mystery(arguments),
    )


def _mystery(arguments: argparse.Namespace) -> dict[str, Any]:
    """Number, grade and key of an exercise; nothing without one."""
    if not arguments.mystery:
        return {}
    from imucal_wizard.mystery.exercise import any_key
    from imucal_wizard.mystery.sitting import any_number

    number = any_number() if arguments.seed is None else arguments.seed
    key, made = (any_key(), True) if arguments.key is None else (arguments.key, False)
    return {"mystery": number, "grade": arguments.grade, "key": key, "key_made": made}
