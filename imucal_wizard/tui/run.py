"""Starts the app with the options of a command, and reports its outcome."""

import os
import shlex
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from imucal_wizard.core.errors import PlaceError, SessionError, UsageError
from imucal_wizard.core.input import check_file, is_file
from imucal_wizard.core.output import note, say
from imucal_wizard.tui.app import SIGNALLED, BaseApp, WizardApp
from imucal_wizard.tui.options import AppSettings, WizardOptions
from imucal_wizard.tui.services import Saved, WizardServices
from imucal_wizard.tui.sources import SourceChoice, SourceKind, stream_setup

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.diagnose.benches import Benches
    from imucal_wizard.diagnose.diagnosis import Diagnosis
    from imucal_wizard.estimate.result import FitReport

_ENDING = ("SIGINT", "SIGTERM", "SIGQUIT", "SIGHUP")
"""Signals that end the app; not every system has all of them."""
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
    if options.auto or options.quit:
        settings = replace(settings, countdown=AUTO_COUNTDOWN)
    app = WizardApp(services, settings, first_choice(options))
    state, sources = app.state, services.sources
    try:
        saved = _run(app)
    finally:
        state.drop()
    if state.unwritten:
        say(f"▲ the end of the session is {state.unwritten}")
    if state.failure is not None and app.unkept is None:
        if sources.session is not None and sources.session.exists():
            _print_session(sources.session, None, port=sources.moved_to)
        raise state.failure
    if saved is not None:
        say("\n".join(saved.says))
        if saved.status and not app.ended_by:
            return saved.status
    else:
        if app.unkept is not None and state.result is not None:
            _print_calibration(state.result, state.diagnoses)
        if sources.session is not None and sources.session.exists():
            _print_session(
                sources.session,
                app.unkept if state.result is not None else None,
                lost=state.port_lost,
                port=sources.moved_to,
            )
    if sources.sealed is not None:
        say(f"answer (not secret: this computer knows it): {sources.sealed}")
        reveal = f"imucal-wizard simulate --reveal {shlex.quote(str(sources.sealed))}"
        word = shlex.quote(options.key) if options.key_made else "WORD"
        say(f"open it with: {reveal} --key {word} --guess TERM:AXIS")
    if app.unkept is not None:
        raise app.unkept
    return _status(app)


def _print_calibration(report: "FitReport", diagnoses: "Mapping[str, Diagnosis]") -> None:
    """Print a calibration that could not be written to a file."""
    from imucal_wizard.report.calibration_record import from_report
    from imucal_wizard.report.text import correction_text, summary

    say(f"{summary(report, diagnoses)}\n\n{correction_text(from_report(report, '', ''))}\n")
    say("▲ this calibration is not saved")


def _print_session(
    session: Path, unkept: PlaceError | None, *, lost: bool = False, port: str = ""
) -> None:
    """Print where the session is, and what to type next.

    Args:
        session: its file.
        unkept: why its calibration could not be written, or None.
        lost: its port is missing, and may have another name now.
        port: the one it continued at, if the session does not say so; else "".
    """
    place = shlex.quote(str(session))
    say(f"kept: {session}")
    if unkept is not None:
        other = (unkept.other or Path("FOLDER") / "FILE").with_suffix(".json")
        say(
            f"save the calibration with: imucal-wizard fit {place} --save {shlex.quote(str(other))}"
        )
    at_port = f" --port {shlex.quote(port)}" if port else ""
    say(f"continue with: imucal-wizard --resume {place}{at_port}")
    if lost:
        say("if the device is at another port now, give it: --port PORT")


def _run(app: BaseApp) -> Saved | None:
    """Run an app until it is left or a signal ends it; the session is closed in either case."""
    handlers = {
        number: signal.signal(number, lambda got, _frame: app.end(got))
        for number in (getattr(signal, name, 0) for name in _ENDING)
        if number
    }
    try:
        return app.run()
    finally:
        if not app.ended_by:
            for number, handler in handlers.items():
                signal.signal(number, handler)
        elif not sys.__stdout__ or not sys.__stdout__.isatty():
            sys.stdout = sys.stderr = open(os.devnull, "w")  # noqa: PTH123, SIM115 - to the end


def _status(app: BaseApp) -> int:
    """The exit status of an app; 128 and the number of the signal that ended it."""
    if app.ended_by:
        model = app.unsaved_model()  # nobody could be asked
        kept = "; the bench restores it with the same data" if model else ""
        lost = f"; this model is not saved: {model}{kept}" if model else ""
        note(f"imucal-wizard: ended by {signal.Signals(app.ended_by).name}{lost}")
        return SIGNALLED + app.ended_by
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
        check_file(path)
    if options.resume is not None and not is_file(options.resume):
        raise SessionError(f"there is no session {options.resume}; check the path")
    _check_stream(options)
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


class BenchApp(BaseApp):
    """The bench alone, on a recording.

    Args:
        make: makes the benches; called in a thread.
        save: writes the calibration with their models to this file, or without one to the usual
            file; called in a thread.
        recorded: the recording.
        wanted: a file is wanted even if no model is changed.
    """

    TITLE = "imucal-wizard bench"

    def __init__(
        self,
        make: "Callable[[], Benches]",
        save: Callable[[Path | None], Saved],
        recorded: Sequence[Path] = (),
        *,
        wanted: bool = False,
    ) -> None:
        super().__init__()
        self._make = make
        self._save = save
        self._wanted = wanted
        self._saved: Saved | None = None
        self._recorded = recorded

    def on_mount(self) -> None:
        """Open it."""
        from imucal_wizard.tui.screens.bench import BenchScreen

        self.push_screen(BenchScreen(self._made, alone=True))

    def _made(self) -> "Benches":
        """The benches; the models that they begin with need no file."""
        from imucal_wizard.sessions.bench_draft import BenchDraft

        benches = self._make()
        self.models.open(benches, lambda: BenchDraft(self._recorded), benches.models)
        return benches

    def unsaved_model(self) -> str:
        """The models that were changed since the file was written, or since the beginning."""
        changed = super().unsaved_model()
        if self._wanted and self._saved is None and self.models.benches is not None:
            return changed or "the one that was fitted"
        return changed

    def write_model(self, place: Path | None) -> Saved:
        """Write the calibration."""
        return self._save(place)

    def wrote(self, saved: Saved) -> None:
        """Note the file."""
        super().wrote(saved)
        self._saved = saved

    def leave(self) -> None:
        """End the app."""
        self.exit(self._saved)


def run_bench(
    benches: "Benches",
    save: Callable[[Path | None], Saved],
    recorded: Sequence[Path],
    *,
    wanted: bool = False,
) -> int:
    """Run the bench until it is left.

    Args:
        benches: the benches of a recording.
        save: writes the calibration with their models, see ``BenchApp``.
        recorded: the recording.
        wanted: a file is wanted even if no model is changed.

    Returns:
        Exit status.
    """
    app = BenchApp(lambda: benches, save, recorded, wanted=wanted)
    saved = _run(app)
    if saved is not None:
        say("\n".join(saved.says))
    elif app.unkept is not None:
        _print_calibration(benches.fitted(), {})
        raise app.unkept
    return _status(app)
