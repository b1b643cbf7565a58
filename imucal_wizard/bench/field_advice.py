"""What to measure next of a magnetometer: circles, where and when."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.bench.pose import NextPose
from imucal_wizard.bench.session import Findings
from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.procedure.poses import FACES, spoken
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.field_data import FieldData

ELSEWHERE = "one metre away from where it was, and from anything of iron"


def circles(
    why: str, faces: Sequence[str] = tuple(FACES), warm: bool = False
) -> tuple[NextPose, ...]:
    """A whole circle about the vertical on each of these faces."""
    return tuple(
        NextPose(
            FACES[face],
            f"with {spoken(face)}, a whole circle about the vertical: {why}",
            face,
            warm,
            face[1],
            1,
            f"a whole circle about the vertical with {spoken(face)}",
        )
        for face in faces
    )


def field_advice(data: FieldData, findings: Findings, verdict: Verdict) -> tuple[NextPose, ...]:
    """The circles that would help after this verdict."""
    if verdict is Verdict.AMBIGUOUS:
        return _apart(findings)
    if verdict is Verdict.UNEXPLAINED:
        return circles(f"again, {ELSEWHERE}: an error that stays is the sensor's")
    if verdict is Verdict.DISTURBED:
        return circles("once more decides it", _near(data, findings))
    if verdict is Verdict.INSUFFICIENT:
        return circles("the magnetometer needs the field from every side")
    return ()


def _apart(findings: Findings) -> tuple[NextPose, ...]:
    """Circles that change one cause and leave the others as they were."""
    if any("current" in terms for terms in findings.opinion.explanations):
        return circles(
            "once more, half of it with the motors on, tells a current from what is slow"
        )
    return circles("once more with the device warmer tells a drift from warmth", warm=True)


def accused_field(
    data: FieldData, findings: Findings
) -> tuple[tuple[int, ...], tuple[tuple[float, float], ...]]:
    """Numbers of the holds, and stretches of time (s), that are said to be disturbed."""
    rows = findings.opinion.holds
    holds = tuple(int(data.dips.hold[row - len(data)]) for row in rows if row >= len(data))
    pieces, offsets = data.pieces, data.pieces.offsets
    spans = tuple(
        (float(pieces.time[offsets[row]]), float(pieces.time[offsets[row + 1] - 1]))
        for row in rows
        if row < len(data)
    )
    return holds, spans


def _near(data: FieldData, findings: Findings) -> tuple[str, ...]:
    """Faces on which a circle sees the directions that are accused."""
    field = data.circumstances.magnetic[list(findings.opinion.holds)]
    names, axes = list(FACES), np.array(list(FACES.values()))
    cosine: FloatArray = -(field / np.linalg.norm(field, axis=1)[:, None]) @ axes.T
    near = np.argmax(cosine, axis=1)
    return tuple(dict.fromkeys(names[int(one)] for one in near))
