"""A diagnosis: one verdict and one text per sensor, for every command and screen."""

import numpy as np

from imucal_wizard.core.notices import UNLIKE_HOLDS, Notice, NoticeKind
from imucal_wizard.core.quantities import as_sentence, plural, quantity
from imucal_wizard.core.records import dataclass
from imucal_wizard.diagnose.bench import Bench, BenchFindings, Found, Rung
from imucal_wizard.diagnose.suspects import Suspect
from imucal_wizard.diagnose.verdict import Opinion, Terms, Verdict
from imucal_wizard.estimate.methods import methods_of
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.measurement.requests import MeasurementRequest
from imucal_wizard.model.effect import ACCELEROMETER


@dataclass(frozen=True)
class Apart:
    """What it takes to separate two explanations.

    Attributes:
        first: the likelier effect.
        second: the other one.
        before: size of the first at which these data separate it from the second, in ``unit``;
            infinite when no size would do.
        after: the same with the poses proposed.
        size: what the first is estimated to be.
        unit: shown unit of the first effect.
        poses: how many are proposed: poses, or rotations where only these help.
        turning: they are rotations.
    """

    first: str
    second: str
    before: float
    after: float
    size: float
    unit: str
    poses: int
    turning: bool = False

    @property
    def enough(self) -> bool:
        """The poses proposed would decide it at the size that it seems to have."""
        return self.after <= self.size

    @property
    def never(self) -> bool:
        """Nothing that can be asked for makes a difference."""
        return not np.isfinite(self.after)

    @property
    def things(self) -> str:
        """What is proposed, with its number: ``6 more poses``."""
        return plural(self.poses, f"more {'rotation' if self.turning else 'pose'}")


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """What the data say of one sensor's model.

    Attributes:
        sensor: which.
        verdict: in one word.
        says: the verdict in sentences, the most important first.
        next_poses: what to measure next, in order.
        apart: the explanations that were compared, and what the poses bring.
        bench: the sensor's bench; None where its data determine no model.
        findings: those that the verdict is about; None without a bench.
        present: those of the model at the end, which differ where the last step has left only
            noise; None without a bench.
        ladder: the models tried so far, the base model first.
        added: terms that have been added to the model that the findings are about.
        found: terms of the model that the evidence has added, each with its reason.
        lacking: why the data are insufficient, or "".
        disturbed_holds: numbers of disturbed holds, from 0.
        disturbed_rotations: numbers of disturbed rotations, from 0.
        disturbed_stretches: of a magnetometer, begin and end of the times at which the field was
            disturbed, s.
        waits_for: the accelerometer's own verdict, where this sensor waits for it.
        in_reference: effects of the accelerometer, each of which explains the misfit alone.
        report: the fit that the bench began with; None where there is none.
    """

    sensor: str
    verdict: Verdict
    says: str = ""
    next_poses: tuple[MeasurementRequest, ...] = ()
    apart: tuple[Apart, ...] = ()
    bench: Bench | None = None
    findings: BenchFindings | None = None
    present: BenchFindings | None = None
    ladder: tuple[Rung, ...] = ()
    added: tuple[str, ...] = ()
    found: tuple[Found, ...] = ()
    lacking: str = ""
    disturbed_holds: tuple[int, ...] = ()
    disturbed_rotations: tuple[int, ...] = ()
    disturbed_stretches: tuple[tuple[float, float], ...] = ()
    waits_for: Verdict | None = None
    in_reference: tuple[str, ...] = ()
    report: FitReport | None = None

    @property
    def unlike_holds(self) -> Notice | None:
        """What is said of rests unlike the means of the holds, of a sensor that does not repeat."""
        if self.report is None or self.verdict is not Verdict.NOT_REPEATABLE:
            return None
        return next(iter(self.report.warned(self.sensor, *UNLIKE_HOLDS)), None)

    @property
    def opinion(self) -> Opinion:
        """What the evidence carries; of a sensor with findings only."""
        assert self.findings is not None, "a bench has findings"  # noqa: S101 (narrows the type)
        return self.findings.opinion

    def warned(self, *kinds: NoticeKind) -> list[str]:
        """The warnings of these kinds about this sensor, as sentences."""
        said = [] if self.report is None else self.report.warned(self.sensor, *kinds)
        return [as_sentence(one) for one in said]

    @property
    def suspects(self) -> tuple[Suspect, ...]:
        """The effects that may be missing, the likeliest first."""
        return () if self.findings is None else self.findings.suspects

    @property
    def explanations(self) -> tuple[Terms, ...]:
        """Sets of effects, each of which would leave only noise, the likeliest first."""
        named = self.verdict in (Verdict.MISSING, Verdict.AMBIGUOUS)
        return () if self.findings is None or not named else self.findings.opinion.explanations

    @property
    def base_left_out(self) -> tuple[str, ...]:
        """Terms of the base model that are not in the model."""
        bench = self.bench
        return () if bench is None else tuple(t for t in bench.whole if t not in bench.fit.base)

    @property
    def settled(self) -> bool:
        """Whether the whole model leaves nothing but noise, and nothing else has to come first."""
        return self.verdict is Verdict.COMPLETE and not self.base_left_out

    @property
    def could_be(self) -> float | None:
        """The error of the model at the end that these data may not show, see ``could_be``.

        None without findings, and of a method of the papers: they are those of the usual fit.
        """
        return None if self.present is None or self.by_method else self.present.could_be

    @property
    def hidden_note(self) -> str:
        """The largest error that the figure "could be" leaves out, in a sentence, or ""."""
        one = None if self.could_be is None or not self.present else self.present.most_hidden
        if self.present is None or one is None:
            return ""
        error = quantity(one.error, self.present.fit.unit)
        return f"these data hide {one.name}, which at its usual size would make {error}"

    @property
    def by_method(self) -> str:
        """The method of the papers that made this calibration or its reference, "" for none.

        The verdict is then on the fit of rows and terms to the same data.
        """
        sensors = {} if self.report is None or self.bench is None else self.report.sensors
        for name in dict.fromkeys((self.sensor, ACCELEROMETER)):
            if name in sensors and sensors[name].method in methods_of(name):
                return sensors[name].method
        return ""

    @property
    def usable(self) -> bool:
        """Whether applying the calibration is better than not applying it, on data held out."""
        fit = None if self.report is None else self.report.sensors.get(self.sensor)
        return fit is not None and not fit.unusable
