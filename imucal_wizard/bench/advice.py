"""What to measure next, for every verdict: which poses, what each is good for, what they bring."""

from dataclasses import dataclass

from imucal_wizard.bench.field_advice import field_advice
from imucal_wizard.bench.more_poses import again, corners_and_repeats, missing
from imucal_wizard.bench.pose import NextPose
from imucal_wizard.bench.separating import Apart, separating
from imucal_wizard.bench.session import Bench, Findings
from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.solver.extended.field_data import FieldData


@dataclass(frozen=True, eq=False)
class Advice:
    """What to measure next.

    Attributes:
        poses: in their order.
        apart: the explanations that were compared, and what the poses bring.
    """

    poses: tuple[NextPose, ...] = ()
    apart: tuple[Apart, ...] = ()


def advice(bench: Bench, findings: Findings, verdict: Verdict) -> Advice:
    """What to measure next.

    Args:
        bench: of one sensor.
        findings: those that the verdict is about.
        verdict: what is said of them.
    """
    if isinstance(bench.measured, FieldData):
        return Advice(field_advice(bench.measured, findings, verdict))
    if verdict is Verdict.AMBIGUOUS:
        return Advice(*separating(bench, findings))
    if verdict is Verdict.DISTURBED:
        return Advice(again(bench, findings))
    if verdict is Verdict.UNEXPLAINED:
        return Advice(corners_and_repeats(bench, findings))
    if verdict is Verdict.INSUFFICIENT:
        return Advice(missing(bench))
    return Advice()
