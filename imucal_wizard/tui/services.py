"""The functions that the screens call: sources, fit, bench, saving, exports."""

import gc
import shlex
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from imucal_wizard.core.dates import date_text, day_text, iso_date, iso_now
from imucal_wizard.core.description import Description
from imucal_wizard.core.errors import ImucalError, UsageError
from imucal_wizard.core.output import (
    encode_json,
    numbered_names,
    place_elsewhere,
    write_atomically,
)
from imucal_wizard.core.records import dataclass
from imucal_wizard.guide.kinds import TITLES
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.sources import SampleSource, SourceChoice, SourceKind, SourceOpener

if TYPE_CHECKING:  # all of these import numpy, which waits until after the first paint
    from imucal_wizard.core.readings import Readings
    from imucal_wizard.diagnose.benches import Benches
    from imucal_wizard.diagnose.diagnosis import Diagnosis
    from imucal_wizard.diagnose.grade import Graded
    from imucal_wizard.diagnose.recheck import Recheck
    from imucal_wizard.estimate.comparison import MethodRow
    from imucal_wizard.estimate.result import FitReport
    from imucal_wizard.measurement.holds import Collected
    from imucal_wizard.report.calibration_file import Calibration
    from imucal_wizard.report.exports import Exported, ExportTarget
    from imucal_wizard.run.snapshot import Snapshot
    from imucal_wizard.sessions import SessionInfo
    from imucal_wizard.sessions.bench_draft import BenchDraft
    from imucal_wizard.sessions.catalogue import Catalogue
    from imucal_wizard.sessions.history import DeviceHistory, KnownDevice

MAX_LISTED_DEVICES = 3
"""Devices to check in the list of sources; with more, the ports would be out of sight."""
_GC_THRESHOLDS = 700, 10, 2
"""New objects between two collections of the youngest generation, as in Python; collections between
two of the next one; and, less than in Python, of the oldest. Frequent collections are short."""


@dataclass(frozen=True)
class Saved:
    """A saved calibration.

    Attributes:
        path: the file.
        says: the text to print when the app has closed.
        report: the fit that the file holds; None in tests that save nothing, and of a recheck.
        status: exit status of the program.
        without: the sensors that the file does not have because they have no usable
            calibration.
    """

    path: Path
    says: tuple[str, ...] = ()
    report: "FitReport | None" = None
    status: int = 0
    without: tuple[str, ...] = ()


class Services(Protocol):
    """The functions that the screens call; tests provide simpler ones."""

    def open_source(self, choice: SourceChoice) -> SampleSource:
        """Make the chosen source, not started yet. Runs in a thread.

        Raises:
            ImucalError: it cannot be opened, and why.
        """

    @property
    def exercise(self) -> bool:
        """Whether an effect is hidden in the source: the bench hides its answer until a guess."""

    @property
    def description(self) -> Description:
        """Device, place and operator of the present source."""

    def describe(self, description: Description) -> None:
        """State them."""

    def ports(self) -> Sequence[SourceChoice]:
        """The ports with devices. Runs in a thread."""

    def earlier(self) -> Sequence[SourceChoice]:
        """All sessions with measurements that no other program writes, newest first.

        Runs in a thread.
        """

    def devices(self) -> "Sequence[KnownDevice]":
        """All devices, the one that was measured last first. Runs in a thread."""

    def history(self, device: "KnownDevice") -> "DeviceHistory":
        """The history of a device. Runs in a thread."""

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

    def draft(self) -> "BenchDraft":
        """Where the models of the benches are kept until a file has them. Runs in a thread."""

    def diagnose(self, benches: "Benches") -> "Mapping[str, Diagnosis]":
        """The diagnosis of each sensor. Runs in a thread."""

    def grades(
        self, report: "FitReport", diagnoses: "Mapping[str, Diagnosis]"
    ) -> "Mapping[str, Graded]":
        """The grade of each sensor; none without diagnoses."""

    def save(self, report: "FitReport", benches: "Benches | None", place: Path | None) -> Saved:
        """Write the calibration, with the effects that the bench has added. Runs in a thread.

        Args:
            report: the fit without effects.
            benches: with the effects; None for none.
            place: the file; None for the usual one.

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

    def calibrations(self) -> Sequence[SourceChoice]:
        """The newest calibration of each device, to check it against. Runs in a thread."""

    @property
    def given_recheck(self) -> SourceChoice | None:
        """The calibration of the options to check the device against, or None."""

    def recheck_with(self, calibration: Path | None) -> None:
        """Check the next source against a calibration; None does what the options say."""

    def recheck(
        self, collected: "Collected", snapshot: "Snapshot"
    ) -> "tuple[Recheck, Calibration, Saved]":
        """The verdict on what was collected; it is kept in the device's history. Runs in a thread.

        Raises:
            ImucalError: the calibration or the stream cannot be used.
        """

    def session_elsewhere(self) -> Path | None:
        """A file for the session on another disk; None if there is no other one."""

    def moved(self, path: Path) -> None:
        """Note that the session is in another file from now on."""

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
        self._readings: Readings | None = None
        self._format = ""
        self.sources = SourceOpener(options)

    def open_source(self, choice: SourceChoice) -> SampleSource:
        """Make the chosen source."""
        return self.sources.open(choice)

    @property
    def exercise(self) -> bool:
        """Whether an effect is hidden in the source: the bench hides its answer until a guess."""
        return self.sources.exercise

    @property
    def description(self) -> Description:
        """Device, place and operator of the present source."""
        return self.sources.description

    def describe(self, description: Description) -> None:
        """State them."""
        self.sources.description = description

    def fit(self, collected: "Collected", snapshot: "Snapshot") -> "FitReport":
        """Fit what was collected.

        Raises:
            DataError: the holds do not determine a calibration.
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
        self._format = snapshot.stream.format
        self._readings = self._read(collected)
        return fit_stream(collected, snapshot.stream, options, self._readings)

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
        """The benches of the newest fit, with its readings if they are available."""
        from imucal_wizard.diagnose.benches import Benches

        return Benches(report, self._readings, own=self._options.effects, before=before)

    def draft(self) -> "BenchDraft":
        """Where the models of the benches of the present source are kept."""
        from imucal_wizard.sessions.bench_draft import BenchDraft

        return BenchDraft(self._measured)

    @property
    def _session_file(self) -> Path | None:
        """The session that is written or played; None for a recording."""
        return self.sources.session or self.sources.watched

    def _read(self, collected: "Collected") -> "Readings | None":
        """The samples of what was collected; None where only its means are kept."""
        from imucal_wizard.sessions.stored_readings import session_readings

        return self.sources.played or session_readings(self._session_file, collected.holds)

    @property
    def _measured(self) -> list[Path]:
        """The session, or the recordings that are replayed."""
        return list(self._options.replay) if self._session_file is None else [self._session_file]

    def diagnose(self, benches: "Benches") -> "Mapping[str, Diagnosis]":
        """The diagnosis of each sensor."""
        from imucal_wizard.diagnose.survey import diagnose_benches

        return {one.sensor: one for one in diagnose_benches(benches, {}, automatic=False)}

    def save(
        self, report: "FitReport", benches: "Benches | None" = None, place: Path | None = None
    ) -> Saved:
        """Write the calibration, with the effects that the bench has added.

        Args:
            report: the fit without effects.
            benches: with the effects; None for none.
            place: the file; None for the usual one.

        Raises:
            DataError: no sensor's calibration is usable.
            UsageError: the place cannot be written.
        """
        from imucal_wizard.report.calibration_record import described, from_report, judged, located
        from imucal_wizard.report.device_history import not_in_file
        from imucal_wizard.report.text import summary
        from imucal_wizard.sessions.session_list import session_info

        report = report if benches is None else benches.fitted()
        diagnoses = {} if benches is None else self.diagnose(benches)
        made = from_report(report, self.sources.title, iso_now())
        made = judged(made, report, diagnoses, self._options.limits)
        info = None if self._session_file is None else session_info(self._session_file)
        made = described(
            made,
            self.sources.description,
            stream_format=self._format,
            session=None if info is None else info.path.name,
            measured=None if info is None else iso_date(info.created),
            fingerprint=_fingerprint(self._measured),
        )
        if self._options.location is not None:
            made = located(made, self._options.location)
        path, history = self._written(made, place or self._options.save)
        said = summary(report, diagnoses, self._options.limits)
        measured = next(iter(self._measured), None)
        last = last_line(self.grades(report, diagnoses), report, path, measured)
        undone = [self.sources.undone] if self.sources.undone else []
        without = not_in_file(made, report.rates, force=self._options.force)
        return Saved(path, (said, *undone, *history, last), report, without=without)

    def grades(
        self, report: "FitReport", diagnoses: "Mapping[str, Diagnosis]"
    ) -> "Mapping[str, Graded]":
        """The grade of each sensor; none without diagnoses."""
        from imucal_wizard.diagnose.grade import graded

        return graded(report, diagnoses, self._options.limits)

    def _written(self, made: "Calibration", given: Path | None) -> "tuple[Path, Sequence[str]]":
        """Write it under the given name, else under a free one; an equal file is kept.

        Returns:
            The file, and what was saved and what to know of the device's history, in lines.

        Raises:
            DataError: no sensor's calibration is usable.
        """
        from imucal_wizard.report.calibration_file import says_the_same
        from imucal_wizard.report.device_history import not_in_file, save_in_history, saved_text

        force = self._options.force
        kept = made if force else made.usable_part()
        for path in numbered_names(self._first_name()) if given is None else (given,):
            if given is None and says_the_same(path, kept):
                return path, [saved_text(path, not_in_file(made, force=force))]
            if not path.exists() or says_the_same(path, kept, described=False):
                break  # another name of the device is no other calibration
        folder, effects = self.sources.directory(), self._options.effects
        return path, save_in_history(made, path, folder, force=force, effects=effects)

    def _first_name(self) -> Path:
        """The name for the calibration if no other file has it."""
        if self.sources.session is not None:
            return self.sources.session.with_suffix(".json")
        return name_of_calibration(self._options.replay)

    def calibrations(self) -> list[SourceChoice]:
        """The newest calibration of each device, to check it against."""
        from imucal_wizard.sessions.history import distinct_names

        found = []
        with self._catalogue() as catalogue:
            devices = catalogue.devices()
            for device, name in zip(devices, distinct_names(devices), strict=True):
                past = catalogue.history(device).calibrations
                if past:
                    title = f"recheck {name}"
                    calibrated = day_text(past[-1].measured)
                    detail = f"GO or NO-GO in a minute; calibrated {calibrated}"
                    kind = SourceKind.RECHECK
                    found.append(SourceChoice(kind, str(past[-1].path), title, detail))
        return found[:MAX_LISTED_DEVICES]

    @property
    def given_recheck(self) -> SourceChoice | None:
        """The calibration of the options to check the device against, or None."""
        path = self._options.recheck
        if path is None:
            return None
        return SourceChoice(SourceKind.RECHECK, str(path), f"recheck {path.name}")

    def recheck_with(self, calibration: Path | None) -> None:
        """Check the next source against a calibration; None does what the options say."""
        self.sources.recheck = calibration or self._options.recheck

    def recheck(
        self, collected: "Collected", snapshot: "Snapshot"
    ) -> "tuple[Recheck, Calibration, Saved]":
        """The verdict on what was collected, kept in the history of the device."""
        from imucal_wizard.report.calibrated_device import recheck_collected
        from imucal_wizard.report.recheck_text import kept_recheck, recheck_document, recheck_text
        from imucal_wizard.sessions.session_list import session_info

        known, path = self.sources.known, self.sources.recheck
        if known is None or path is None:
            raise UsageError("there is no calibration to check the device against")
        found = recheck_collected(
            known, collected, snapshot.stream, snapshot.status.elapsed, self._read(collected)
        )
        kept = self._session_file
        document = recheck_document(found, path.name, None if kept is None else session_info(kept))
        if self._options.document is not None:
            write_atomically(Path(self._options.document), encode_json(document))
        folder, checked = self.sources.directory(), self.sources.description
        history = kept_recheck(known, found, document, folder, checked)
        undone = [self.sources.undone] if self.sources.undone else []
        last = recheck_line(found, known.calibration, path, self._options.port)
        says = recheck_text(found, known.calibration), *undone, *history, last
        return found, known.calibration, Saved(path, says, status=int(found.verdict != "go"))

    def targets(self) -> "Sequence[ExportTarget]":
        """The programs that a calibration can be written for."""
        from imucal_wizard.report.exports import targets

        return tuple(targets().values())

    def export(self, saved: Path, target: str) -> "Exported":
        """Write a saved calibration for another program, beside it."""
        from imucal_wizard.report.calibration_file import read_calibration
        from imucal_wizard.report.exports import (
            ExportSettings,
            path_beside,
            target_named,
            write_export,
        )

        path = path_beside(saved, target_named(target))
        settings = ExportSettings(effects=self._options.effects)
        return write_export(read_calibration(saved), target, path, settings)

    def session_elsewhere(self) -> Path | None:
        """A file for the session on another disk; None if there is no other one."""
        return None if self.sources.session is None else place_elsewhere(self.sources.session)

    def moved(self, path: Path) -> None:
        """Note that the session is in another file from now on."""
        self.sources.session = path

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
        """All sessions with measurements that no other program writes, newest first."""
        with self._catalogue() as catalogue:
            found = [one for one in catalogue.sessions() if not one.busy]
        return [_kept(one) for one in found if one.problem or not one.empty]

    def devices(self) -> "list[KnownDevice]":
        """All devices, the one that was measured last first."""
        with self._catalogue() as catalogue:
            return catalogue.devices()

    def history(self, device: "KnownDevice") -> "DeviceHistory":
        """The history of a device."""
        with self._catalogue() as catalogue:
            return catalogue.history(device)

    def _catalogue(self) -> "Catalogue":
        from imucal_wizard.sessions.catalogue import Catalogue

        return Catalogue(self.sources.directory())


def _fingerprint(recorded: Sequence[Path]) -> str | None:
    """Fingerprint of what was measured; None if it cannot be read at present."""
    from imucal_wizard.acquire.files.session_salvage import fingerprint

    try:
        return fingerprint(recorded) if recorded else None
    except ImucalError:
        return None


def name_of_calibration(recordings: Sequence[Path]) -> Path:
    """The name for the calibration of recordings, in the present folder."""
    names = "+".join(path.stem for path in recordings) or "recording"
    return Path.cwd() / f"{names}.calibration.json"


def last_line(
    grades: "Mapping[str, Graded]", report: "FitReport", path: Path, measured: Path | None
) -> str:
    """The final state in words, the effects of the model included, and what to type next.

    Args:
        grades: of the sensors; empty in an exercise, whose answer a verdict would give away.
        report: the fit that was saved.
        path: the saved calibration.
        measured: the session or recording for the bench; None to propose an export.
    """
    states = []
    for name, one in grades.items():
        terms = report.sensors[name].terms if name in report.sensors else ()
        beyond = f" with {' + '.join(term.name for term in terms)}" if terms else ""
        states.append(f"{name} {one.grade.word}{beyond}")
    following = f"imucal-wizard export {shlex.quote(str(path))} --to TARGET"
    judged = bool(grades) and all(one.grade == "good" for one in grades.values())
    if measured is not None and not judged:
        following = f"imucal-wizard bench {shlex.quote(str(measured))}"
    return f"{'; '.join(states) or 'saved; the bench shows what is missing'}. Next: {following}"


def recheck_line(found: "Recheck", calibration: "Calibration", path: Path, port: str | None) -> str:
    """The verdict of a recheck, and what to type next.

    Args:
        found: the recheck.
        calibration: whose device it is.
        path: its file.
        port: of the device, if the command line names it.
    """
    there = f" --port {shlex.quote(port)}" if port else ""
    following = {
        "go": f"export {shlex.quote(str(path))} --to TARGET",
        "no-go": there.strip(),
        "insufficient": f"recheck {shlex.quote(str(path))}{there}",
    }[found.verdict]
    if found.verdict == "go" and calibration.device_name:
        following = f"devices {shlex.quote(calibration.device_name)}"
    return f"{found.verdict.word}. Next: imucal-wizard {following}".rstrip()


def _kept(session: "SessionInfo") -> SourceChoice:
    """A session as a source, to continue it or to open its result again."""
    from imucal_wizard.core.quantities import plural
    from imucal_wizard.report.history_text import session_state
    from imucal_wizard.tui.text import clock

    when = date_text(session.created).removeprefix(f"{day_text(time.time())} ")
    title = f"resume session of {when}, at {TITLES.get(session.step, session.step)}"
    unfinished = not (session.problem or session.finished)
    if not unfinished:
        title = f"session of {when}, {session_state(session)}"
    held = f"{plural(session.holds, 'hold')} in {clock(session.seconds)}"
    detail = session.problem or f"{held}, {session.description.named or session.source}"
    return SourceChoice(SourceKind.SESSION, str(session.path), title, detail, unfinished)
