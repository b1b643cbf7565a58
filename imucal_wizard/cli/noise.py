"""``imucal-wizard noise``: Allan deviation of a long recording at rest, or of a port."""

import argparse
import shutil
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from imucal_wizard.cli.arguments import (
    STANDARD_OUT,
    Parser,
    add_json,
    add_port,
    add_recording_options,
    positive,
    recording_options,
)
from imucal_wizard.cli.outcome import spare, spare_others, write_json
from imucal_wizard.core.errors import DataError, LinkError, UsageError
from imucal_wizard.core.output import note, say

if TYPE_CHECKING:
    from rich.live import Live

    from imucal_wizard.estimate.noise_survey import NoiseResult, NoiseSurvey

USAGE = (("noise FILE", "Allan deviation of a long recording at rest (or --port PORT)"),)
REPORTED_TAUS = (0.1, 1.0, 10.0, 100.0, 1000.0)
"""τ, s, that the progress of a live measurement lists."""
REPORT_SECONDS = 10.0
"""Between two lines of progress."""
DRAW_SECONDS = 2.0
"""Between two drawings of the plot."""
REOPEN_SECONDS = 1.0


def parser() -> Parser:
    """The options of ``noise``."""
    made = Parser(
        prog="imucal-wizard noise",
        description="Overlapping Allan deviation of a device at rest, for hours: white noise, bias "
        "instability and bias random walk of each axis with standard errors. The recording is read "
        "in pieces and may be of any length. Motion is named and left out.",
    )
    made.add_argument("files", nargs="*", type=Path, metavar="FILE", help="recording or session")
    add_port(made, "measure live; ctrl+c ends it")
    made.add_argument("--seconds", type=positive, metavar="S", help="end the live measurement")
    add_json(made)
    add_recording_options(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Measure the noise; the status is 1 if the device did not rest or for too short a time."""
    arguments = parser().parse_args(argv)
    if bool(arguments.files) == bool(arguments.port):
        raise UsageError("give a recording or --port PORT, one of them")
    spare(arguments.files, arguments.json)
    spare_others(arguments)
    try:
        result = _live(arguments) if arguments.port else _recorded(arguments)
    except DataError as error:
        if arguments.json:
            from imucal_wizard.report.noise_report import NOISE_SCHEMA

            write_json({"schema": NOISE_SCHEMA, "error": str(error)}, arguments.json)
        raise
    from imucal_wizard.report.noise_report import noise_document, noise_text

    if arguments.json:
        write_json(noise_document(result), arguments.json)
    if arguments.json != STANDARD_OUT:
        say(noise_text(result, min(shutil.get_terminal_size().columns, 100)))
    return 0


def _recorded(arguments: argparse.Namespace) -> "NoiseResult":
    from imucal_wizard.acquire.files.long_recording import LongRecording
    from imucal_wizard.acquire.files.recording_files import refuse_unknown_format
    from imucal_wizard.estimate.noise_survey import NoiseSurvey

    options = recording_options(arguments)
    refuse_unknown_format(options)
    survey = NoiseSurvey()
    for place, path in enumerate(arguments.files):
        survey.next_file()
        recording = LongRecording(path, options, place)
        for readings in recording:
            survey.feed(readings)
        for text in recording.warnings:
            note(f"warning: {text}")
    return survey.result()


def _live(arguments: argparse.Namespace) -> "NoiseResult":
    """Measure until ``--seconds`` or ctrl+c, and report how well each τ is known.

    Raises:
        LinkError: the port cannot be opened, or sends nothing that can be read.
    """
    from imucal_wizard.acquire.files.recording_files import with_options
    from imucal_wizard.acquire.intake import LINK_BREAK, Intake
    from imucal_wizard.acquire.setup import AUTO, StreamSetup
    from imucal_wizard.acquire.transport import Transport
    from imucal_wizard.estimate.noise_survey import NoiseSurvey

    options = recording_options(arguments)
    intake = Intake(with_options(StreamSetup(format=options.as_format or AUTO), options))
    survey, transport = NoiseSurvey(), Transport(arguments.port, arguments.baud)
    transport.open()
    note(f"{transport.description}: leave the device at rest; ctrl+c ends the measurement")
    began = reported = time.monotonic()
    with closing(transport), _screen() as screen, suppress(KeyboardInterrupt):
        every = REPORT_SECONDS if screen is None else DRAW_SECONDS
        while arguments.seconds is None or survey.seconds < arguments.seconds:
            try:
                piece = transport.read()
            except LinkError as error:
                note(str(error))
                while not transport.reopen():
                    time.sleep(REOPEN_SECONDS)
                intake.feed(LINK_BREAK, time.monotonic())
                continue
            readings = intake.feed(piece, time.monotonic()) if piece else None
            if readings is not None:
                survey.feed(readings)
            if time.monotonic() - reported > every:
                reported = time.monotonic()
                _report(survey, intake.problem, intake.needs, reported - began, screen)
    return survey.result()


@contextmanager
def _screen() -> "Iterator[Live | None]":
    """Where the plot is drawn again below the lines; None without a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.live import Live

    with Live(console=Console(stderr=True), auto_refresh=False, transient=True) as live:
        yield live


def _report(
    survey: "NoiseSurvey",
    problem: str,
    needs: Sequence[str],
    waited: float,
    screen: "Live | None",
) -> None:
    """The progress as a line, or with plots on a screen; or why there is none.

    Raises:
        LinkError: nothing can be read from what arrives.
    """
    from imucal_wizard.report.noise_report import live_noise_text, progress_line

    if problem or needs:
        settings = tuple(need.replace(" ", "_") for need in needs)
        raise LinkError(
            problem or f"the stream does not state its {', '.join(needs)}", settings=settings
        )
    if not survey.seconds:
        note(f"no data for {waited:.0f} s: is the device switched on and sending?")
        return
    try:
        sensors = survey.result(ended=False).sensors
    except DataError as error:
        note(str(error))
        return
    if not sensors:
        words = "the noise at rest is measured for half a minute, then the plot follows"
        note(f"{survey.seconds:.0f} s: {words}")
        return
    progress = progress_line(sensors, survey.seconds, REPORTED_TAUS)
    lines = [
        f"▲ the {name} shows motion: this part is left out"
        for name, one in sensors.items()
        for moved in one.disturbances[-1:]
        if survey.seconds - moved.end < 4.0 * REPORT_SECONDS
    ]
    if screen is None:
        note("\n".join([progress, *lines]))
        return
    from rich.text import Text

    size = screen.console.size
    text = live_noise_text(sensors, "\n".join([progress, *lines]), size.width, size.height)
    screen.update(Text(text), refresh=True)
