"""The services of the app on the real house: sources, the fit, saving, lists."""

import itertools
from collections.abc import Iterator
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from imucal_wizard.tui.garbage import look_briefly
from imucal_wizard.tui.opening import Opening
from imucal_wizard.tui.source import Saved, Services, SourceChoice, SourceKind

if TYPE_CHECKING:  # all of these import numpy, which waits until after the first paint
    from imucal_wizard.bench.benches import Benches
    from imucal_wizard.calibration import Calibration
    from imucal_wizard.fitting.methods import MethodRow
    from imucal_wizard.live.snapshot import Snapshot
    from imucal_wizard.procedure.collected import Collected
    from imucal_wizard.sessions import SessionInfo
    from imucal_wizard.solver.result import FitReport

_LISTED = 4
"""So many earlier sessions are offered."""


class Workshop(Opening):
    """Opens what is chosen, fits what was collected, saves what was found."""

    def services(self) -> Services:
        """What the app works with."""
        return Services(
            self.open_source,
            self.fit,
            self.save,
            self.compare,
            self.ports,
            self.earlier,
            self.benches,
            look_briefly,
        )

    def fit(self, collected: "Collected", snapshot: "Snapshot") -> "FitReport":
        """Fit what was collected.

        Raises:
            DataError: the holds do not carry a calibration.
        """
        from imucal_wizard.fitting import FitOptions
        from imucal_wizard.live.review import fit_stream

        wanted = self._options
        options = FitOptions(
            self.gravity,
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
        from imucal_wizard.fitting.magnetometer import samples_during
        from imucal_wizard.fitting.methods import method_rows

        stream, series = snapshot.stream, collected.magnetometer
        unit = None if stream.gyroscope is None else stream.gyroscope_unit
        if series is not None:
            spans = collected.field_spans
            series = samples_during(spans, series) if spans else None
        return method_rows(report, unit, series, self._options.field)

    def benches(self, report: "FitReport", before: "Benches | None") -> "Benches":
        """The benches of a fit, with the readings it was made of where they are at hand."""
        from imucal_wizard.bench.benches import Benches
        from imucal_wizard.effects.own import load_effect
        from imucal_wizard.sessions.readings_again import session_readings

        kept = self.session or self.watched
        readings = self.played or session_readings(kept, report.holds)
        own = [load_effect(path) for path in self._options.effects]
        return Benches(report, readings, own=own, before=before)

    def save(self, report: "FitReport", benches: "Benches | None" = None) -> Saved:
        """Write the calibration, with the effects found on the bench, and say what it is worth.

        Raises:
            UsageError: the place cannot be written.
        """
        from imucal_wizard.calibration import from_report
        from imucal_wizard.summary import summary

        now = datetime.now().astimezone()
        models = {} if benches is None else benches.models()
        made = from_report(report, self.title, now.isoformat(timespec="seconds"), models)
        path = self._written(made)
        found: list[str] = []
        if benches is not None:
            found += [
                f"{one}: with {', '.join(benches.found(one))} from the bench" for one in models
            ]
        return Saved(path, (summary(report), *found, f"saved: {path}"))

    def _written(self, made: "Calibration") -> Path:
        """Write it, under a name that is free unless one was given; what is there stays."""
        from imucal_wizard.calibration import save, says_the_same

        if self._options.save is not None:
            return save(made, self._options.save)
        for path in self._names():
            if not path.exists():
                break
            if says_the_same(path, made):
                return path
        return save(made, path)

    def _names(self) -> Iterator[Path]:
        """Names for the calibration, the plainest first, without an end."""
        if self.session is not None:
            first = self.session.with_suffix(".json")
        else:
            names = "+".join(path.stem for path in self._options.replay) or "recording"
            first = Path.cwd() / f"{names}.calibration.json"
        yield first
        for number in itertools.count(2):
            yield first.with_name(f"{first.stem}-{number}{first.suffix}")

    def ports(self) -> list[SourceChoice]:
        """What is plugged in."""
        from imucal_wizard.devices.ports import list_ports

        found = []
        for port in list_ports():
            words = (port.vid_pid, port.description, port.hint)
            detail = "  ".join(word for word in words if word)
            found.append(SourceChoice(SourceKind.PORT, port.device, port.device, detail))
        return found

    def earlier(self) -> list[SourceChoice]:
        """Sessions that are not finished, newest first."""
        from imucal_wizard.sessions import list_sessions

        known = [one for one in list_sessions(self.directory()) if not one.problem]
        return [_offered(one) for one in known if not one.finished and one.holds][:_LISTED]


def _offered(session: "SessionInfo") -> SourceChoice:
    from imucal_wizard.procedure.wording import plural
    from imucal_wizard.tui.text import clock
    from imucal_wizard.tui.widgets.step_header import MORE, STEPS

    begun = datetime.fromtimestamp(session.created).astimezone()
    today = begun.date() == datetime.now().astimezone().date()
    when = f"{begun:%H:%M}" if today else f"{begun:%d %b, %H:%M}"
    step = dict((*STEPS, MORE)).get(session.step, session.step)
    return SourceChoice(
        SourceKind.SESSION,
        str(session.path),
        f"resume session of {when}, at {step}",
        f"{plural(session.holds, 'hold')} in {clock(session.seconds)}, {session.source}",
    )
