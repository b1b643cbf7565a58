"""What the wizard knows beyond one screen: source, newest snapshot, fit, bench, what was saved."""

from threading import Lock
from typing import TYPE_CHECKING

from imucal_wizard.core.errors import ImucalError
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.tui.options import AppSettings
from imucal_wizard.tui.services import Saved, Services
from imucal_wizard.tui.sounds import Sounds
from imucal_wizard.tui.sources import Hand, SampleSource, SourceChoice

if TYPE_CHECKING:  # numpy waits until after the first paint
    from collections.abc import Mapping, Sequence

    from imucal_wizard.diagnose.benches import Benches
    from imucal_wizard.diagnose.diagnosis import Diagnosis
    from imucal_wizard.estimate.comparison import MethodRow
    from imucal_wizard.estimate.result import FitReport
    from imucal_wizard.measurement.requests import MeasurementRequest
    from imucal_wizard.report.exports import Exported
    from imucal_wizard.run.snapshot import Snapshot

_FITTED = (StepKind.RESULT, StepKind.VALIDATE, StepKind.SAVE)
"""Steps in which the data of the fit do not change."""


class WizardState:
    """Owned by the app; screens read the attributes, and change them only by the methods.

    Args:
        services: what the wizard is given to work with.
        settings: how it behaves.
        choice: the source chosen already, or None to let the operator choose.
        sounds: what is heard of the events.

    Attributes:
        source: what is read, or None.
        snapshot: the newest picture of the source that was shown, or None.
        report: the newest fit, or None while the data change.
        diagnoses: what the data say of each sensor of the newest fit; empty until that is known.
        benches: the bench of the newest fit, as it was left; None before it was opened.
        sensor: whose bench was open last.
        resume_bench: the bench has asked for more data and is to be opened after the next fit.
        saved: where the calibration was written, or None.
        failure: why an unattended run could not go on, or None.
        unwritten: why the end of the session could not be written down, or "".
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
        self.diagnoses: Mapping[str, Diagnosis] = {}
        self.benches: Benches | None = None
        self.sensor = ""
        self.resume_bench = False
        self.saved: Saved | None = None
        self.failure: ImucalError | None = None
        self.unwritten = ""
        self._heard = 0
        self._bench_lock = Lock()
        """The bench opens once the diagnosis, which uses the same benches, is done."""

    @property
    def hand(self) -> Hand | None:
        """The virtual hand, where the source has one."""
        hand = getattr(self.source, "hand", None)
        return hand if isinstance(hand, Hand) else None

    @property
    def live(self) -> bool:
        """Whether there is a device that can be asked for new poses."""
        return self.source is not None and self.source.live

    @property
    def ended(self) -> bool:
        """Whether no new pose can come."""
        return self.snapshot is not None and self.snapshot.finished

    def use(self, source: SampleSource) -> None:
        """Read from this source from now on."""
        self.drop()
        self.source, self.snapshot, self._heard = source, None, 0
        self.benches, self.resume_bench = None, False
        source.start()

    def drop(self) -> None:
        """Stop the source; what it has measured is on disk already."""
        source, self.source = self.source, None
        if source is not None:
            source.stop()
            self.unwritten = source.snapshot().stream.unwritten

    def take(self, snapshot: "Snapshot") -> None:
        """This is the newest picture; what has happened since the last one is heard."""
        self.snapshot = snapshot
        new, self._heard = snapshot.event_count - self._heard, snapshot.event_count
        if new > 0:
            self.sounds.hear(snapshot.events[-new:])

    def order(self, name: str, argument: str = "") -> None:
        """Hand a command to the procedure."""
        if self.source is not None:
            self.source.command(name, argument)

    def enter(self, step: str) -> None:
        """The procedure is in this step: where data change, the fit is no longer theirs."""
        if step not in _FITTED:
            self.report, self.diagnoses = None, {}

    def fit(self) -> "FitReport":
        """Fit what has been measured. Takes a while: call it in a thread.

        Raises:
            DataError: the data are insufficient.
        """
        assert self.source is not None, "only what a source has measured is fitted"  # noqa: S101 (narrows the type)
        assert self.snapshot is not None, "its snapshot has led to the fit"  # noqa: S101 (narrows the type)
        return self.services.fit(self.source.collected(), self.snapshot)

    def fitted(self, report: "FitReport") -> None:
        """This is the fit of what has been measured."""
        self.report, self.diagnoses = report, {}

    def diagnose(self) -> "Mapping[str, Diagnosis]":
        """What the data say of each sensor of the newest fit. Takes a while: call it in a thread.

        Raises:
            DataError: the data carry no diagnosis.
        """
        benches = self.bench()
        with self._bench_lock:
            return self.services.diagnose(benches)

    def diagnosed(self, diagnoses: "Mapping[str, Diagnosis]") -> None:
        """This is what the data say."""
        self.diagnoses = diagnoses

    def compare(self) -> "Sequence[MethodRow]":
        """Every method on what has been measured. Takes a while: call it in a thread.

        Raises:
            DataError: the data are insufficient.
        """
        if self.report is None or self.source is None or self.snapshot is None:
            return ()
        return self.services.compare(self.report, self.source.collected(), self.snapshot)

    def bench(self) -> "Benches":
        """The bench of the newest fit. Takes a while: call it in a thread.

        Raises:
            DataError: the data carry no bench.
        """
        assert self.report is not None, "the bench is offered after the fit"  # noqa: S101 (narrows the type)
        with self._bench_lock:
            if self.benches is None or self.benches.report is not self.report:
                self.benches = self.services.benches(self.report, self.benches)
            return self.benches

    def leave_bench(self, sensor: str, asked: "tuple[MeasurementRequest, ...] | None") -> None:
        """The bench has been left at this sensor, perhaps to measure something for it."""
        self.sensor = sensor
        if asked:
            from imucal_wizard.measurement.requests import requests_to_text

            self.resume_bench = True
            self.order("measure", requests_to_text(asked))

    def opens_bench(self) -> bool:
        """Whether the bench is to be opened again now; only the first question is answered yes."""
        wanted, self.resume_bench = self.resume_bench, False
        return wanted

    def found(self) -> dict[str, tuple[str, ...]]:
        """The models with the effects that the bench has added, by sensor."""
        models = {} if self.benches is None else self.benches.models()
        return {name: model.model for name, (model, _) in models.items()}

    def save(self) -> Saved:
        """Write the calibration with the effects of the bench. Takes a while: call it in a thread.

        Raises:
            UsageError: the place cannot be written.
        """
        assert self.report is not None, "saving follows the fit"  # noqa: S101 (narrows the type)
        benches = self.bench() if self.found() else self.benches
        return self.services.save(self.report, benches)

    def wrote(self, saved: Saved) -> None:
        """The calibration is on disk."""
        self.saved = saved

    def export(self, target: str) -> "Exported":
        """Write the saved calibration for another program. Takes a while: call it in a thread.

        Raises:
            UsageError: the target cannot hold it, or the place cannot be written.
        """
        assert self.saved is not None, "what is exported has been saved"  # noqa: S101 (narrows the type)
        return self.services.export(self.saved.path, target)

    def fail(self, error: ImucalError) -> None:
        """The run ends with this."""
        self.failure = error
