"""All that the bench shows of one sensor, looked up once in a thread and then only read."""

from dataclasses import dataclass

from imucal_wizard.bench.benches import Benches
from imucal_wizard.bench.ladder import Rung, confirmed
from imucal_wizard.bench.says import says
from imucal_wizard.bench.session import Bench, Findings
from imucal_wizard.bench.statement import Statement, statement
from imucal_wizard.effects.effect import Effect
from imucal_wizard.readings import Readings
from imucal_wizard.solver.extended.fit import Measured, whole_base
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.tui.bench.entries import Entry, entries_of
from imucal_wizard.tui.bench.views import View, views_of


@dataclass(frozen=True, eq=False)
class Sight:
    """One sensor on the bench, with one model.

    Attributes:
        sensor: ``accelerometer``, ``gyroscope`` or ``magnetometer``.
        measured: what is known of it.
        fit: the present fit.
        findings: suspects and opinion.
        said: the verdict, and what to measure next.
        told: the verdict in sentences, as it was when this was looked up.
        ladder: every model so far.
        entries: what may be missing, the likeliest first.
        views: pictures of what is left.
        catalogue: all effects of this sensor.
        readings: of the whole session, where they are at hand.
    """

    sensor: str
    measured: Measured
    fit: Extended
    findings: Findings
    said: Statement
    told: str
    ladder: tuple[Rung, ...]
    entries: tuple[Entry, ...]
    views: tuple[View, ...]
    catalogue: tuple[Effect, ...]
    readings: Readings | None = None

    @property
    def missing_base(self) -> tuple[str, ...]:
        """Parts of the base that are not in the model."""
        return tuple(term for term in self.whole if term not in self.fit.base)

    @property
    def whole(self) -> tuple[str, ...]:
        """The whole base model."""
        return whole_base(self.measured)

    @property
    def parts(self) -> tuple[str, ...]:
        """The parts of the data there are pictures of."""
        return tuple(dict.fromkeys(view.part for view in self.views))

    def rose(self, place: int) -> bool:
        """Whether a rung of the ladder added a term without data held out agreeing."""
        if place < 1 or self.ladder[place].added is None:
            return False
        kinds = {effect.name: effect.kind for effect in self.catalogue}
        of_time = kinds.get(str(self.ladder[place].added)) == "time"
        below, above = self.ladder[place - 1], self.ladder[place]
        return not confirmed(below, above, of_time) and above.rms_held_out is not None


def look(benches: Benches, bench: Bench) -> Sight:
    """Look at a bench as it is now."""
    findings = bench.look()
    said = statement(benches, bench, findings)
    return Sight(
        sensor=bench.sensor,
        measured=bench.measured,
        fit=bench.fit,
        findings=findings,
        said=said,
        told=says(said),
        ladder=tuple(bench.ladder),
        entries=entries_of(bench, findings),
        views=views_of(bench.fit, bench.measured),
        catalogue=tuple(bench.catalogue),
        readings=benches.readings,
    )
