"""Starts the app with the options of a command, and reports its outcome."""

import shlex
import sys
from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

from imucal_wizard.core.errors import RecordingError, SessionError, UsageError
from imucal_wizard.core.output import say
from imucal_wizard.tui.app import BaseApp, WizardApp
from imucal_wizard.tui.options import AppSettings, WizardOptions
from imucal_wizard.tui.services import WizardServices
from imucal_wizard.tui.sources import SourceChoice, SourceKind, stream_setup

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.diagnose.benches import Benches

AUTO_COUNTDOWN = 2.0
"""Time for which an unattended run shows its result, s."""


def run_wizard(options: WizardOptions) -> int:
    """Run the wizard until it is left.

    Returns:
        Exit status: 0, or that of the error that stopped an unattended run.

    Raises:
        UsageError: there is no terminal, or an option is wrong.
        RecordingError: a file to replay does not exist.
        SessionError: the session to resume does not exist.
    """
    _check(options)
    services = WizardServices(options)
    settings = AppSettings(options.auto, options.quit, options.muted)
    settings = replace(settings, predict=options.mystery is not None)
    if options.auto or options.quit:
        settings = replace(settings, countdown=AUTO_COUNTDOWN)
    app = WizardApp(services, settings, first_choice(options))
    state, sources = app.state, services.sources
    try:
        saved = app.run()
    finally:
        state.drop()
    if state.unwritten:
        say(f"▲ the end of the session is {state.unwritten}")
    if state.failure is not None:
        raise state.failure
    if saved is not None:
        say("\n".join(saved.says))
    elif sources.session is not None and sources.session.exists():
        say(f"kept: {sources.session}")
        say(f"continue with: imucal-wizard --resume {shlex.quote(str(sources.session))}")
    if sources.sealed is not None:
        say(f"sealed answer: {sources.sealed}")
        reveal = f"imucal-wizard simulate --reveal {shlex.quote(str(sources.sealed))}"
        word = shlex.quote(options.key) if options.key_made else "WORD"
        say(f"open it with: {reveal} --key {word} --guess TERM:AXIS")
    return app.return_code or 0


def first_choice(options: WizardOptions) -> SourceChoice | None:
    """The source that the options name, or None if the operator chooses."""
    if options.port and options.resume is None:
        return SourceChoice(SourceKind.PORT, options.port, options.port)
    if options.replay:
        title = " + ".join(path.name for path in options.replay)
        return SourceChoice(SourceKind.FILE, title=title)
    if options.resume is not None:
        return SourceChoice(SourceKind.SESSION, str(options.resume), options.resume.name)
    if options.auto or options.hidden or options.mystery is not None:
        return SourceChoice(SourceKind.VIRTUAL, title="virtual IMU")
    return None


def _check(options: WizardOptions) -> None:
    """Report wrong options before the app takes over the terminal."""
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise UsageError(
            "the wizard needs a terminal; for a recording without one: imucal-wizard fit FILE"
        )
    for path in options.replay:
        if not path.is_file():
            raise RecordingError(f"there is no file {path}; check the path")
    if options.resume is not None and not options.resume.is_file():
        raise SessionError(f"there is no session {options.resume}; check the path")
    if not 0 < options.baud <= 20_000_000:
        raise UsageError(f"--baud {options.baud} is no speed; give bits per second, like 115200")
    _check_stream(options)
    if options.effects:
        from imucal_wizard.model.catalogue import load_effect

        for path in options.effects:
            load_effect(path)
    if options.hidden:
        from imucal_wizard.simulate.hidden import parse_hidden

        for text in options.hidden:
            parse_hidden(text)


def _check_stream(options: WizardOptions) -> None:
    """Check format, columns and units; NumPy is imported only if one of them is given."""
    known = options.recording
    units = (known.accelerometer_unit, known.gyroscope_unit, known.magnetometer_unit)
    if options.format == "auto" and not known.columns and not any(units):
        return
    from imucal_wizard.acquire.decode import decoder_for
    from imucal_wizard.acquire.setup import AUTO

    setup = stream_setup(options)
    if setup.format != AUTO:
        decoder_for(setup.format, setup.columns)


class BenchApp(BaseApp[None]):
    """The bench alone, on a recording.

    Args:
        make: makes the benches; called in a thread.
    """

    TITLE = "imucal-wizard bench"

    def __init__(self, make: "Callable[[], Benches]") -> None:
        super().__init__()
        self._make = make

    def on_mount(self) -> None:
        """Open it."""
        from imucal_wizard.tui.screens.bench import BenchScreen

        self.push_screen(BenchScreen(self._make), lambda _none: self.exit())


def run_bench(benches: "Benches") -> int:
    """Run the bench until it is left.

    Args:
        benches: the benches of a recording.

    Returns:
        Exit status.
    """
    app = BenchApp(lambda: benches)
    app.run()
    return app.return_code or 0
