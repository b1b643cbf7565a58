"""``imucal-wizard recheck``: is a calibration still good?"""

import sys
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path

from imucal_wizard.cli.arguments import (
    GRADES,
    STANDARD_OUT,
    Parser,
    add_all_samples,
    add_effects,
    add_gravity,
    add_json,
    add_limits,
    add_port,
    add_rate_table,
    add_recording_options,
    add_sensor,
    add_sessions,
    add_speed,
    date_of,
    gravity_given,
    own_effects,
    recording_options,
    sessions_folder,
    table_options,
)
from imucal_wizard.cli.outcome import spare, spare_others, write_json
from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.core.limits.stillness import MIN_USUAL_RATE, USUAL_REST_SECONDS
from imucal_wizard.core.output import note, say

USAGE = (
    ("recheck CAL.json FILE...", "is the calibration still good?"),
    ("recheck CAL.json --port PORT", "the same with the device, in a minute"),
)


def parser() -> Parser:
    """The options of ``recheck``."""
    made = Parser(
        prog="imucal-wizard recheck",
        description="Check a saved calibration with a minute of holds and rotations: GO or NO-GO "
        "for each sensor, and which parameters have moved by how much. Leave the device at rest "
        f"for 5 s, then hold it still for {USUAL_REST_SECONDS:.0f} s (longer below "
        f"{MIN_USUAL_RATE:.0f} samples/s) with each face up, and turn it about each axis in "
        "between.",
    )
    made.add_argument("calibration", type=Path, metavar="CAL.json", help="the saved calibration")
    made.add_argument(
        "files",
        nargs="*",
        default=[],
        type=Path,
        metavar="FILE",
        help="recording or session; without one the wizard opens and asks for the poses",
    )
    device = made.add_argument_group("device")
    add_port(device, "read a device, in the wizard")
    device.add_argument(
        "--format", default="auto", metavar="NAME", help="format of the device, if not recognised"
    )
    device.add_argument(
        "--auto", action="store_true", help="the virtual IMU, moved by the virtual hand"
    )
    device.add_argument("--quit", action="store_true", help="quit once the verdict is known")
    add_speed(device, "the virtual IMU")
    add_sensor(device)
    add_json(made)
    add_limits(made)
    made.add_argument(
        "--limit",
        action="append",
        default=[],
        metavar="SENSOR=VALUE",
        help="the limit of a sensor's error, like accelerometer=2mg or gyroscope=0.3deg/s; an angle"
        " per rotation, like gyroscope=1deg, counts as 0.3 deg/s",
    )
    made.add_argument(
        "--grade",
        choices=GRADES,
        default=GRADES[0],
        help=f"grade of the sensors: turn-on spread and ageing (default {GRADES[0]})",
    )
    made.add_argument(
        "--gyro-zeroed",
        action="store_true",
        help="the gyroscope's bias is zeroed at each start: report it, do not judge it",
    )
    made.add_argument(
        "--date", type=date_of, metavar="DATE", help="when FILE was measured, if not now"
    )
    add_recording_options(made)
    add_all_samples(made)
    add_rate_table(made)
    add_effects(made)
    add_gravity(made)
    add_sessions(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Recheck; the exit status is 0 for GO and 1 otherwise."""
    arguments = parser().parse_args(argv)
    spare([arguments.calibration, *arguments.files], arguments.json)
    spare_others(arguments)
    if not arguments.files:
        return _live(arguments)
    if arguments.port or arguments.auto:
        raise UsageError("a recording and a device are two sources: give FILE or --port")
    from datetime import datetime

    from imucal_wizard.acquire.files import is_session
    from imucal_wizard.api import Recording
    from imucal_wizard.estimate.table_steps import KnownRates
    from imucal_wizard.report.calibrated_device import (
        CalibratedDevice,
        RecheckSettings,
        unreadable_recheck,
    )
    from imucal_wizard.report.calibration_file import read_calibration
    from imucal_wizard.report.recheck_text import kept_recheck, recheck_document, recheck_text
    from imucal_wizard.sessions.session_list import session_info

    limits = _limits(arguments)
    calibration = read_calibration(arguments.calibration)
    sessions = [session_info(path) for path in arguments.files if is_session(path)]
    now = datetime.now().astimezone()
    if arguments.date is not None:
        now = datetime.fromisoformat(arguments.date)
    elif sessions:
        now = datetime.fromtimestamp(sessions[0].created).astimezone()
    settings = RecheckSettings(
        now,
        arguments.grade,
        limits,
        arguments.gyro_zeroed,
        gravity_given(arguments),
        own_effects(arguments.effects),
        KnownRates(*table_options(arguments)),
    )
    known = CalibratedDevice(calibration, settings)
    for one in sessions:
        known.check_device(one.description.serial)
    recording = Recording(
        arguments.files,
        recording_options(arguments),
        all_samples=arguments.all_samples,
        on_table=bool(settings.table),
        planner=known.next_pose,
    )
    try:
        found = recording.rechecked(known)
    except DataError as error:
        found = unreadable_recheck(known, str(error))
    session = sessions[0] if len(arguments.files) == len(sessions) == 1 else None
    document = recheck_document(found, arguments.calibration.name, session, arguments.date)
    if arguments.json:
        write_json(document, arguments.json)
    checked = next((one.description for one in sessions), None)
    for text in kept_recheck(known, found, document, sessions_folder(arguments), checked):
        note(text)
    for warning in recording.warnings:
        note(f"warning: {warning}")
    if arguments.json != STANDARD_OUT:
        say(recheck_text(found, calibration))
    return 0 if found.verdict == "go" else 1


def _live(arguments: Namespace) -> int:
    """Recheck in the wizard."""
    if arguments.json == STANDARD_OUT:
        raise UsageError(
            "the wizard needs the terminal: give --json a file, or a recording of the device"
        )
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise UsageError(
            "the wizard needs a terminal; give a recording of the device: recheck CAL.json FILE"
        )
    if arguments.port and (arguments.auto or arguments.hidden):
        raise UsageError("--auto and --hidden belong to the virtual IMU, not to --port")
    if any(table_options(arguments)):
        raise UsageError("the wizard does not follow a rate table: give a recording of it")
    from imucal_wizard.estimate.table_steps import KnownRates
    from imucal_wizard.report.calibrated_device import check_table
    from imucal_wizard.report.calibration_file import read_calibration
    from imucal_wizard.tui.options import WizardOptions
    from imucal_wizard.tui.run import run_wizard

    # before the terminal is taken over
    own = tuple(own_effects(arguments.effects))
    check_table(read_calibration(arguments.calibration), KnownRates())
    return run_wizard(
        WizardOptions(
            port=arguments.port,
            baud=arguments.baud,
            format=arguments.format,
            recording=recording_options(arguments),
            speed=arguments.speed,
            auto=arguments.auto,
            quit=arguments.quit,
            hidden=tuple(arguments.hidden),
            seed=arguments.seed or 0,
            gravity=gravity_given(arguments),
            sessions=arguments.sessions,
            limits=_limits(arguments),
            recheck=arguments.calibration,
            effects=own,
            recheck_grade=arguments.grade,
            gyro_zeroed=arguments.gyro_zeroed,
            document=arguments.json,
        )
    )


def _limits(arguments: Namespace) -> dict[str, float]:
    """The limits of the user's own."""
    from imucal_wizard.diagnose.grade import given_limits

    return given_limits(arguments.limit, arguments.limits)
