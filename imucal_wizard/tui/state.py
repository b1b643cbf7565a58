"""The state shared by the wizard's screens: source, newest snapshot, fit, bench, saved file."""

from contextlib import suppress
from threading import RLock
from typing import TYPE_CHECKING

from imucal_wizard.core.description import Description
from imucal_wizard.core.errors import DataError, ImucalError
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.run.faults import remember
from imucal_wizard.tui.options import AppSettings
from imucal_wizard.tui.services import Saved, Services
from imucal_wizard.tui.sounds import Sounds
from imucal_wizard.tui.sources import Hand, SampleSource, SourceChoice

if TYPE_CHECKING:  # numpy waits until after the first paint
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from imucal_wizard.diagnose.benches import Benches
    from imucal_wizard.diagnose.diagnosis import Diagnosis
    from imucal_wizard.diagnose.grade import Graded
    from imucal_wizard.diagnose.recheck import Recheck
    from imucal_wizard.estimate.comparison import MethodRow
    from imucal_wizard.estimate.result import FitReport
    from imucal_wizard.measurement.requests import MeasurementRequest
    from imucal_wizard.report.calibration_file import Calibration
    from imucal_wizard.report.exports import Exported
    from imucal_wizard.run.snapshot import Snapshot
    from imucal_wizard.sessions.bench_draft import BenchDraft

_FITTED = (StepKind.RESULT, StepKind.VALIDATE, StepKind.SAVE)
"""Steps in which the data of the fit do not change."""


class BuiltModels:
    """The benches of one source, and the models built on them.

    Attributes:
        benches: the benches as they were left; None before they were opened.
        restored: the models that an earlier run has built, in words; "" for none.
        lock: held by a thread that reads or changes the benches: they open once the diagnosis is
            done, and the diagnosis waits for a term that is being added.
    """

    def __init__(self) -> None:
        self.lock = RLock()
        self.forget()

    def forget(self) -> None:
        """Begin again, for another source."""
        self.benches: Benches | None = None
        self.restored = ""
        self._in_file: Mapping[str, tuple[str, ...]] = {}
        self._draft: BenchDraft | None = None

    def open(
        self,
        benches: "Benches",
        draft: "Callable[[], BenchDraft] | None",
        in_file: "Mapping[str, tuple[str, ...]] | None" = None,
    ) -> None:
        """Take the newest benches; the first ones get the models that an earlier run has built.

        Args:
            benches: the benches.
            draft: where models are kept that no file has; None to keep none.
            in_file: the models that need no file, by sensor; None for the base models.
        """
        if self._draft is None and draft is not None:
            self._in_file, self._draft = in_file or {}, draft()
            self.restored = self._draft.restore(benches)
            if self._draft.in_file:
                self._in_file = benches.models
        self.benches = benches

    def keep(self) -> str:
        """Keep the models until a file has them. Slow: call it in a thread.

        Returns:
            Why they cannot be kept, or "".
        """
        self.restored = ""
        if self.benches is None or self._draft is None:
            return ""
        return self._draft.write(self.benches, self._in_file)

    def give_up(self) -> None:
        """Keep only the models that a file has."""
        if self._draft is not None:
            self._draft.give_up()

    def saved(self, file: "Path") -> None:
        """Note that a file has the models."""
        self._in_file = {} if self.benches is None else self.benches.models
        if self.benches is not None and self._draft is not None:
            self._draft.saved(self.benches, file)

    @property
    def unsaved(self) -> str:
        """The models that no file has, in words; "" if there are none."""
        return "" if self.benches is None else "; ".join(self.benches.changed(self._in_file))


class WizardState:
    """The app owns it; screens read the attributes and change them only by the methods.

    Args:
        services: the functions below the app.
        settings: behaviour of the app.
        choice: the source to open, or None if the operator chooses.
        sounds: plays the events.

    Attributes:
        source: the present source, or None.
        snapshot: the newest snapshot that was shown, or None.
        report: the newest fit without effects, or None while the data change.
        result: the same with the effects that the bench has added.
        diagnoses: of each sensor of the newest fit; empty until they are known.
        models: the bench as it was left, and the models that no file has.
        sensor: the sensor whose bench was open last.
        answered: the bench of the source has shown what its model lacks; an exercise hides it.
        resume_bench: the bench has requested data and opens again after the next fit.
        saved: the saved calibration, or None.
        failure: why an unattended run could not go on, or None.
        unwritten: why the end of the session is not on disk, or "".
    """

    def __init__(
        self, services: Services, settings: AppSettings, choice: SourceChoice | None, sounds: Sounds
    ) -> None:
        self.services = services
        self.settings = settings
        self.choice = choice
        self.sounds = sounds
        self.source: SampleSource | None = None
        self.snapshot: Snapshot | None = None
        self.report: FitReport | None = None
        self.result: FitReport | None = None
        self.diagnoses: Mapping[str, Diagnosis] = {}
        self.models = BuiltModels()
        self.sensor = ""
        self.answered = False
        self.resume_bench = False
        self.saved: Saved | None = None
        self._filed: FitReport | None = None
        self.failure: ImucalError | None = None
        self.unwritten = ""
        self._rescued = False
        self._heard = 0

    @property
    def hand(self) -> Hand | None:
        """The virtual hand, if the source has one."""
        hand = getattr(self.source, "hand", None)
        return hand if isinstance(hand, Hand) else None

    @property
    def live(self) -> bool:
        """Whether the source is a device, which can measure more."""
        return self.source is not None and self.source.live

    @property
    def ended(self) -> bool:
        """Whether the source has ended."""
        return self.snapshot is not None and self.snapshot.finished

    @property
    def port_lost(self) -> bool:
        """Whether the device's port was missing or lost when the source was last seen."""
        if self.snapshot is None or self.ended:
            return False
        stream = self.snapshot.stream
        return not stream.connected and not stream.busy

    def use(self, source: SampleSource) -> None:
        """Start a source in place of the present one."""
        self.drop()
        remember(f"source {type(source).__name__}")
        self.source, self.snapshot, self._heard = source, None, 0
        self.resume_bench = self.answered = False
        self.models.forget()
        source.start()

    def drop(self) -> None:
        """Stop the source; everything measured is on disk already."""
        source, self.source = self.source, None
        if source is not None:
            source.stop()
            self.unwritten = "" if self._rescued else source.snapshot().stream.unwritten

    def take(self, snapshot: "Snapshot") -> None:
        """Take the newest snapshot, and play its new events."""
        self.snapshot = snapshot
        new, self._heard = snapshot.event_count - self._heard, snapshot.event_count
        if new > 0:
            self.sounds.hear(snapshot.events[-new:])
            for event in snapshot.events[-new:]:
                remember(str(event.kind))

    def describe(self, description: Description) -> None:
        """State device, place and operator of the source."""
        self.services.describe(description)
        if self.source is not None:
            self.source.describe(description)

    def order(self, name: str, argument: str = "") -> None:
        """Pass a command to the procedure."""
        remember(f"command {name}")
        if self.source is not None:
            self.source.command(name, argument)

    def enter(self, step: str) -> None:
        """Note the present step; a step that changes the data invalidates the fit."""
        remember(f"step {step}")
        if step not in _FITTED:
            self.report = self.result = None
            self.diagnoses = {}

    def fit(self) -> "FitReport":
        """Fit the measurements. Slow: call it in a thread.

        Raises:
            DataError: the data are insufficient.
        """
        assert self.source is not None, "only what a source has measured is fitted"  # noqa: S101 (narrows the type)
        assert self.snapshot is not None, "its snapshot has led to the fit"  # noqa: S101 (narrows the type)
        return self.services.fit(self.source.collected(), self.snapshot)

    def fitted(self, report: "FitReport") -> None:
        """Take the fit of the measurements."""
        self.report = self.result = report
        self.diagnoses = {}

    def judge(self) -> "tuple[FitReport, Mapping[str, Diagnosis]]":
        """The fit with the bench's effects, and the diagnoses. Slow: call it in a thread.

        An exercise has no diagnoses: a verdict would give the answer away.

        Raises:
            DataError: the data determine no model.
        """
        benches = self.bench()
        with self.models.lock:
            judged = {} if self.services.exercise else self.services.diagnose(benches)
            return benches.fitted(), judged

    def judged(self, result: "FitReport", diagnoses: "Mapping[str, Diagnosis]") -> None:
        """Take the fit with the bench's effects, and the diagnoses."""
        self.result, self.diagnoses = result, diagnoses

    @property
    def grades(self) -> "Mapping[str, Graded]":
        """The grade of each sensor; none while there is no verdict."""
        if self.result is None or not self.diagnoses:
            return {}
        return self.services.grades(self.result, self.diagnoses)

    @property
    def hides_answer(self) -> bool:
        """Whether the source is an exercise, and its bench hides the answer until a guess."""
        return self.services.exercise and not self.answered

    @property
    def good(self) -> bool | None:
        """Whether every sensor is good; None while there is no verdict."""
        grades = self.grades.values()
        return all(one.grade == "good" for one in grades) if grades else None

    def compare(self) -> "Sequence[MethodRow]":
        """Fit the measurements by every method. Slow: call it in a thread.

        Raises:
            DataError: the data are insufficient.
        """
        if self.report is None or self.source is None or self.snapshot is None:
            return ()
        return self.services.compare(self.report, self.source.collected(), self.snapshot)

    def bench(self) -> "Benches":
        """The bench of the newest fit. Slow: call it in a thread.

        Raises:
            DataError: the data determine no model.
        """
        assert self.report is not None, "the bench is offered after the fit"  # noqa: S101 (narrows the type)
        models, draft = self.models, None if self.settings.quit_after else self.services.draft
        with models.lock:
            benches = models.benches
            if benches is None or benches.report is not self.report:
                benches = self.services.benches(self.report, benches)
                models.open(benches, draft)
            return benches

    def leave_bench(
        self, sensor: str, asked: "tuple[MeasurementRequest, ...] | None", *, answered: bool
    ) -> None:
        """Note the sensor whose bench was left, and measure what the bench has requested."""
        self.sensor, self.answered = sensor, answered
        if asked:
            from imucal_wizard.measurement.requests import requests_to_text

            self.resume_bench = True
            self.order("measure", requests_to_text(asked))

    def opens_bench(self) -> bool:
        """Whether the bench opens again now; true once after each request."""
        wanted, self.resume_bench = self.resume_bench, False
        return wanted

    def save(self, place: "Path | None" = None) -> Saved:
        """Write the calibration, with its verdicts and the bench's effects. Slow: use a thread.

        An exercise whose answer is hidden is saved without verdicts, which give it away.

        Args:
            place: the file; None for the usual one.

        Raises:
            UsageError: the place cannot be written.
        """
        assert self.report is not None, "saving follows the fit"  # noqa: S101 (narrows the type)
        benches = None
        with self.models.lock:
            opened = self.models.benches
            if not self.hides_answer or (opened is not None and opened.changed({})):
                with suppress(DataError):  # the data determine a fit, but no model to be judged
                    benches = self.bench()
            return self.services.save(self.report, benches, place)

    def rescue(self, path: "Path") -> None:
        """Write the whole session to another file after its disk has failed.

        Raises:
            SessionError: the file exists already, or cannot be written.
        """
        assert self.source is not None, "a source has measured the session"  # noqa: S101 (narrows the type)
        self.source.rescue(path)
        self.services.moved(path)
        self._rescued = True

    def wrote(self, saved: Saved) -> None:
        """Note that the calibration is on disk."""
        self.saved, self.result, self._filed = saved, saved.report or self.result, self.report

    @property
    def unsaved(self) -> bool:
        """Whether the bench has another model than the saved file."""
        return self.saved is not None and bool(self.models.unsaved)

    @property
    def in_file(self) -> bool:
        """Whether the saved file has the present fit with the present model."""
        return self.saved is not None and self._filed is self.report and not self.models.unsaved

    @property
    def validated(self) -> bool:
        """Whether the present fit has all new orientations that the validation asks for."""
        if self.report is None or self.snapshot is None:
            return False
        skipped = (step for step, _ in self.snapshot.status.skipped)
        taken = any(fit.validation for fit in self.report.sensors.values())
        return taken and StepKind.VALIDATE not in skipped

    def recheck(self) -> "tuple[Recheck, Calibration]":
        """The verdict of a recheck. Slow: call it in a thread.

        Raises:
            ImucalError: the calibration or the stream cannot be used.
        """
        assert self.source is not None, "only what a source has measured is judged"  # noqa: S101 (narrows the type)
        assert self.snapshot is not None, "its snapshot has led to the verdict"  # noqa: S101 (narrows the type)
        found, calibration, self.saved = self.services.recheck(
            self.source.collected(), self.snapshot
        )
        return found, calibration

    def export(self, target: str) -> "Exported":
        """Write the saved calibration for another program. Slow: call it in a thread.

        Raises:
            UsageError: the target cannot hold it, or the place cannot be written.
        """
        assert self.saved is not None, "what is exported has been saved"  # noqa: S101 (narrows the type)
        return self.services.export(self.saved.path, target)

    def fail(self, error: ImucalError) -> None:
        """Note why the run cannot continue."""
        self.failure = error
