"""A frozen snapshot of one sensor's bench, made in a thread."""

from imucal_wizard.core.readings import Readings
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.bench import Bench, BenchFindings, Entry, Rung, entries_of
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.survey import diagnosis_of, tried_findings
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.diagnose.verdict_text import not_confirmed
from imucal_wizard.diagnose.views import ResidualView, views_of
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.effect import Effect
from imucal_wizard.report.bench_text import BENCH_COLUMNS, suspect_details, suspect_row


@dataclass(frozen=True, eq=False)
class BenchSnapshot:
    """One sensor on the bench, with one model.

    Attributes:
        sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
        measured: the experiment.
        fit: the present fit.
        findings: suspects and opinion.
        diagnosis: the verdict, and what to measure next.
        ladder: all models so far.
        entries: what may be missing, the likeliest first.
        views: plots of the residuals.
        catalogue: all effects of this sensor, and its free curves.
        readings: of the whole session, if available.
    """

    sensor: str
    measured: Experiment
    fit: SensorFit
    findings: BenchFindings
    diagnosis: Diagnosis
    ladder: tuple[Rung, ...]
    entries: tuple[Entry, ...]
    views: tuple[ResidualView, ...]
    catalogue: tuple[Effect, ...]
    readings: Readings | None = None

    @property
    def whole(self) -> tuple[str, ...]:
        """The whole base model."""
        return self.measured.base_terms

    @property
    def parts(self) -> tuple[str, ...]:
        """The parts of the data with plots."""
        return tuple(dict.fromkeys(view.part for view in self.views))

    @property
    def style(self) -> str:
        """Style in which the verdict is shown."""
        bench = self.diagnosis.bench
        if self.diagnosis.settled and not (bench and not_confirmed(bench)):
            return "good"
        return "accent" if self.diagnosis.verdict is Verdict.MISSING else "warn"


def bench_snapshot(benches: Benches, bench: Bench) -> BenchSnapshot:
    """The snapshot of a bench as it is now."""
    findings = tried_findings(benches, bench)
    diagnosis = diagnosis_of(benches, bench, findings)
    entries = entries_of(bench, findings)
    # a screen that draws hears no key: what its table needs is computed here, in a thread, and kept
    for place, entry in enumerate(entries):
        suspect_row(entry, bench.fit, BENCH_COLUMNS)
        if not place:
            suspect_details(entry, bench.fit, BENCH_COLUMNS)
    return BenchSnapshot(
        sensor=bench.sensor,
        measured=bench.measured,
        fit=bench.fit,
        findings=findings,
        diagnosis=diagnosis,
        ladder=tuple(bench.ladder),
        entries=entries,
        views=views_of(bench.fit),
        catalogue=bench.effects,
        readings=benches.readings,
    )
