"""The functions that the screens call: sources, fit, bench, saving, exports."""

import gc
import itertools
import shlex
from collections.abc import Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from imucal_wizard.core.records import dataclass
from imucal_wizard.guide.kinds import TITLES
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.sources import SampleSource, SourceChoice, SourceKind, SourceOpener

if TYPE_CHECKING:  # all of these import numpy, which waits until after the first paint
    from imucal_wizard.diagnose.benches import Benches
    from imucal_wizard.diagnose.diagnosis import Diagnosis
    from imucal_wizard.diagnose.grade import Graded
    from imucal_wizard.estimate.comparison import MethodRow
    from imucal_wizard.estimate.result import FitReport
    from imucal_wizard.measurement.holds import Collected
    from imucal_wizard.report.calibration_file import Calibration
    from imucal_wizard.report.exports import Exported, ExportTarget
    from imucal_wizard.run.snapshot import Snapshot
    from imucal_wizard.sessions import SessionInfo

MAX_LISTED_SESSIONS = 4
"""Earlier sessions in the list of sources; with more, the ports would be out of sight."""
_GC_THRESHOLDS = 700, 10, 2
"""New objects between two collections of the youngest generation, as in Python; collections between
two of the next one; and, less than in Python, of the oldest. Frequent collections are short."""


@dataclass(frozen=True)
class Saved:
    """A saved calibration.

    Attributes:
        path: the file.
        says: the text to print when the app has closed.
        report: the fit that the file holds; None in tests that save nothing.
    """

    path: Path
    says: tuple[str, ...] = ()
    report: "FitReport | None" = None


class Services(Protocol):
    """The functions that the screens call; tests provide simpler ones."""

    def open_source(self, choice: SourceChoice) -> SampleSource:
        """Make the chosen source, not started yet. Runs in a thread.

        Raises:
            ImucalError: it cannot be opened, and why.
        """

    def ports(self) -> Sequence[SourceChoice]:
        """The ports with devices. Runs in a thread."""

    def earlier(self) -> Sequence[SourceChoice]:
        """Sessions that can be resumed, newest first. Runs in a thread."""

    def fit(self, collected: "Collected", snapshot: "Snapshot") -> "FitReport":
        """Fit what was collected. Runs in a thread.

        Raises:
            DataError: the data are insufficient.
        """

    def compare(
        self, report: "FitReport", collected: "Collected", snapshot: "Snapshot"
    ) -> "Sequence[MethodRow]":
        """Every method of every sensor on what was collected. Runs in a thread."""

    def benches(self, report: "FitReport", before: "Benches | None") -> "Benches":
        """The benches of a fit, with the models of earlier benches. Runs in a thread."""

    def diagnose(self, benches: "Benches") -> "Mapping[str, Diagnosis]":
        """The diagnosis of each sensor. Runs in a thread."""

    def grades(
        self, report: "FitReport", diagnoses: "Mapping[str, Diagnosis]"
    ) -> "Mapping[str, Graded]":
        """The grade of each sensor; none without diagnoses."""

    def save(self, report: "FitReport", benches: "Benches | None") -> Saved:
        """Write the calibration, with the effects that the bench has added. Runs in a thread.

        Raises:
            UsageError: the place cannot be written.
        """

    def targets(self) -> "Sequence[ExportTarget]":
        """The programs that a calibration can be written for."""

    def export(self, saved: Path, target: str) -> "Exported":
        """Write a saved calibration for another program, beside it. Runs in a thread.

        Raises:
            UsageError: the target cannot hold it, or the place cannot be written.
        """

    def loaded(self) -> None:
        """Note that all modules of the app are imported."""


class WizardServices:
    """The services with real sources and files.

    Args:
        options: of the command line.

    Attributes:
        sources: opens the chosen source.
    """

    def __init__(self, options: WizardOptions) -> None:
        self._options = options
        self.sources = SourceOpener(options)

    def open_source(self, choice: SourceChoice) -> SampleSource:
        """Make the chosen source."""
        return self.sources.open(choice)

    def fit(self, collected: "Collected", snapshot: "Snapshot") -> "FitReport":
        """Fit what was collected.

        Raises:
            DataError: the holds do not carry a calibration.
        """
        from imucal_wizard.estimate.recording import FitOptions
        from imucal_wizard.run.review import fit_stream

        wanted = self._options
        options = FitOptions(
            self.sources.gravity,
            wanted.method,
            wanted.gyroscope_method,
            wanted.magnetometer_method,
            wanted.field,
        )
        return fit_stream(collected, snapshot.stream, options)

    def compare(
        self, report: "FitReport", collected: "Collected", snapshot: "Snapshot"
    ) -> "tuple[MethodRow, ...]":
        """Every method of every sensor on what was collected."""
        from imucal_wizard.estimate.comparison import method_rows
        from imucal_wizard.estimate.magnetometer.report import samples_during

        stream, series = snapshot.stream, collected.magnetometer
        unit = None if stream.gyroscope is None else stream.gyroscope_unit
        if series is not None:
            spans = collected.field_spans
            series = samples_during(spans, series) if spans else None
        return method_rows(report, unit, series, self._options.field)

    def benches(self, report: "FitReport", before: "Benches | None") -> "Benches":
        """The benches of a fit, with its readings if they are available."""
        from imucal_wizard.diagnose.benches import Benches
        from imucal_wizard.model.catalogue import load_effect
        from imucal_wizard.sessions.stored_readings import session_readings

        kept = self.sources.session or self.sources.watched
        readings = self.sources.played or session_readings(kept, report.holds)
        own = [load_effect(path) for path in self._options.effects]
        return Benches(report, readings, own=own, before=before)

    def diagnose(self, benches: "Benches") -> "Mapping[str, Diagnosis]":
        """The diagnosis of each sensor."""
        from imucal_wizard.diagnose.survey import diagnose_benches

        return {one.sensor: one for one in diagnose_benches(benches, {}, automatic=False)}

    def save(self, report: "FitReport", benches: "Benches | None" = None) -> Saved:
        """Write the calibration, with the effects that the bench has added.

        Raises:
            DataError: no sensor's calibration is usable.
            UsageError: the place cannot be written.
        """
        from imucal_wizard.report.calibration_file import from_report, judged
        from imucal_wizard.report.text import summary

        now = datetime.now().astimezone()
        report = report if benches is None else benches.fitted()
        diagnoses = {} if benches is None else self.diagnose(benches)
        made = from_report(report, self.sources.title, now.isoformat(timespec="seconds"))
        made = judged(made, report, diagnoses, self._options.limits)
        left_out = [] if self._options.force else list(made.unusable)
        path = self._written(made if self._options.force else made.usable_part())
        without = f" without the {' and the '.join(left_out)}" if left_out else ""
        said = summary(report, diagnoses, self._options.limits)
        last = self._last_line(self.grades(report, diagnoses), report, path)
        return Saved(path, (said, f"saved: {path}{without}", last), report)

    def grades(
        self, report: "FitReport", diagnoses: "Mapping[str, Diagnosis]"
    ) -> "Mapping[str, Graded]":
        """The grade of each sensor; none without diagnoses."""
        from imucal_wizard.diagnose.grade import graded

        return graded(report, diagnoses, self._options.limits)

    def _last_line(self, grades: "Mapping[str, Graded]", report: "FitReport", path: Path) -> str:
        """The final state in words, the effects of the model included, and what to type next."""
        told = []
        for name, one in grades.items():
            terms = report.sensors[name].terms if name in report.sensors else ()
            beyond = f" with {' + '.join(term.name for term in terms)}" if terms else ""
            told.append(f"{name} {one.grade.word}{beyond}")
        kept = self.sources.session or self.sources.watched
        place = kept or (self._options.replay[0] if self._options.replay else None)
        following = f"imucal-wizard export {shlex.quote(str(path))} --to TARGET"
        if place is not None and any(one.grade != "good" for one in grades.values()):
            following = f"imucal-wizard bench {shlex.quote(str(place))}"
        return f"{'; '.join(told) or 'saved without a verdict'}. Next: {following}"

    def _written(self, made: "Calibration") -> Path:
        """Write it under the given name, else under a free one; an equal file is kept."""
        from imucal_wizard.report.calibration_file import says_the_same

        if self._options.save is not None:
            return made.save(self._options.save, force=True)
        for path in self._names():
            if not path.exists():
                break
            if says_the_same(path, made):
                return path
        return made.save(path, force=True)

    def _names(self) -> Iterator[Path]:
        """Names for the calibration, without end; the first has no number."""
        if self.sources.session is not None:
            first = self.sources.session.with_suffix(".json")
        else:
            names = "+".join(path.stem for path in self._options.replay) or "recording"
            first = Path.cwd() / f"{names}.calibration.json"
        yield first
        for number in itertools.count(2):
            yield first.with_name(f"{first.stem}-{number}{first.suffix}")

    def targets(self) -> "Sequence[ExportTarget]":
        """The programs that a calibration can be written for."""
        from imucal_wizard.report.exports import targets

        return tuple(targets().values())

    def export(self, saved: Path, target: str) -> "Exported":
        """Write a saved calibration for another program, beside it."""
        from imucal_wizard.report.calibration_file import read_calibration
        from imucal_wizard.report.exports import path_beside, target_named, write_export

        path = path_beside(saved, target_named(target))
        return write_export(read_calibration(saved), target, path)

    def loaded(self) -> None:
        """Keep the pauses of the garbage collector short.

        A full collection of everything that a Textual app has loaded takes 50 to 200 ms, in which
        no thread fetches a byte; a terminal's buffer holds 20 to 40 ms of 2,000 samples a second.
        """
        gc.freeze()
        gc.collect()  # from here on the collector counts only what is left
        gc.set_threshold(*_GC_THRESHOLDS)

    def ports(self) -> list[SourceChoice]:
        """The ports with devices."""
        from imucal_wizard.acquire.ports import list_ports

        found = []
        for port in list_ports():
            words = (port.vid_pid, port.description, port.hint)
            detail = "  ".join(word for word in words if word)
            found.append(SourceChoice(SourceKind.PORT, port.device, port.device, detail))
        return found

    def earlier(self) -> list[SourceChoice]:
        """Sessions that are not finished, newest first."""
        from imucal_wizard.sessions import list_sessions

        known = [one for one in list_sessions(self.sources.directory()) if not one.problem]
        return [_resumable(one) for one in known if not one.finished and one.holds][
            :MAX_LISTED_SESSIONS
        ]


def _resumable(session: "SessionInfo") -> SourceChoice:
    from imucal_wizard.guide.wording import plural
    from imucal_wizard.tui.text import clock

    begun = datetime.fromtimestamp(session.created).astimezone()
    today = begun.date() == datetime.now().astimezone().date()
    when = f"{begun:%H:%M}" if today else f"{begun:%d %b, %H:%M}"
    step = TITLES.get(session.step, session.step)
    return SourceChoice(
        SourceKind.SESSION,
        str(session.path),
        f"resume session of {when}, at {step}",
        f"{plural(session.holds, 'hold')} in {clock(session.seconds)}, {session.source}",
    )
