"""Poses where no two explanations are to be told apart: repeats, corners, what is missing."""

import numpy as np

from imucal_wizard.bench.misfit import RowKind
from imucal_wizard.bench.pose import NextPose, turns
from imucal_wizard.bench.session import Bench, Findings
from imucal_wizard.errors import DataError
from imucal_wizard.procedure.poses import (
    AXES,
    CORNERS,
    DIRECTIONS,
    EDGES,
    FACES,
    POSE_TOLERANCE_DEG,
    nearest,
    spoken,
    spoken_up,
)
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.carried import decide, design
from imucal_wizard.solver.extended.hold_data import HoldData
from imucal_wizard.solver.extended.turn_data import TurnData

MOST = 12
REPEATS = 4
"""Holds that are measured again where nothing explains what is left: the worst ones."""
SPARE = 2
"""Directions beyond what carries the model, to leave out one and to contradict the rest."""


def up_of(bench: Bench) -> FloatArray:
    """Up at each hold measured, unit vectors, shape (n, 3)."""
    force = bench.measured.circumstances.force
    return np.asarray(force / np.linalg.norm(force, axis=1)[:, None])


def accused(findings: Findings) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Numbers of the holds, and of the rotations, that are said to be disturbed."""
    misfit = findings.misfit
    holds: list[int] = []
    rotations: list[int] = []
    for source in findings.opinion.holds:
        rows = misfit.source == source
        moving = misfit.kind == RowKind.ROTATION
        parts = [misfit.residual[rows & moving], misfit.residual[rows & ~moving]]
        turned, rested = (float(np.mean(part**2)) if len(part) else 0.0 for part in parts)
        (rotations if turned > rested else holds).append(source)
    return tuple(holds), tuple(rotations)


def again(bench: Bench, findings: Findings) -> tuple[NextPose, ...]:
    """The accused hold's direction, or the accused turn, once more."""
    holds, rotations = accused(findings)
    measured = bench.measured
    found = []
    for hold in holds:
        row = hold
        if isinstance(measured, TurnData):
            row = int(np.flatnonzero(measured.still_rows == hold)[0])
        up = up_of(bench)[row]
        why = f"{_name(up)} again: hold {hold + 1} is accused, and one more hold there decides it"
        brief = f"hold {hold + 1} is accused, and one more there decides it"
        found.append(NextPose(up, why, _pose(up), brief=brief))
    for number in rotations:
        if isinstance(measured, TurnData):
            place = int(np.flatnonzero(measured.rotations == number)[0])
            up, axis = measured.before[place], _turned_about(measured, place)
            why = f"rotation {number + 1} again, from {_name(up)}: one more turn decides it"
            brief = f"turn {number + 1} once more, about {axis}"
            found.append(NextPose(up, why, _pose(up), axis=axis, turns=1, brief=brief))
    return tuple(found)


def _turned_about(measured: TurnData, place: int) -> str:
    """The body axis that a rotation was mostly about."""
    first, past = measured.samples.offsets[place : place + 2]
    return AXES[int(np.argmax((measured.motion.rate[first:past] ** 2).sum(axis=0)))]


def corners_and_repeats(bench: Bench, findings: Findings) -> tuple[NextPose, ...]:
    """Corners that were not held, then the holds that fit worst once more."""
    up = up_of(bench)
    done = {_pose(one) for one in up}
    new = [
        NextPose(vector, f"{spoken(name)}: a direction that no hold has seen yet", name)
        for name, vector in CORNERS.items()
        if name not in done
    ]
    misfit = findings.misfit
    rest = misfit.kind != RowKind.ROTATION
    size = np.sqrt((misfit.residual[rest] ** 2).reshape(len(up), -1).mean(axis=1))
    chosen: list[NextPose] = []
    for row in np.argsort(-size, kind="stable"):
        name = _name(up[row])
        if len(chosen) < REPEATS and all(name not in one.why for one in chosen):
            why = f"{name} again: off by {size[row]:.1f} times the noise; does it repeat?"
            chosen.append(NextPose(up[row], why, _pose(up[row])))
    return (*new, *chosen)


def more_of_all(bench: Bench) -> tuple[NextPose, ...]:
    """Where nothing has to be decided: corners not held yet, the first poses again; or turns."""
    if isinstance(bench.measured, TurnData):
        return tuple(turns("xyz", "more of them show smaller effects"))
    up = up_of(bench)
    done = {_pose(one) for one in up}
    new = [
        NextPose(vector, f"{spoken(name)}: a direction not held yet", name, brief="not held so far")
        for name, vector in CORNERS.items()
        if name not in done
    ]
    first = list(dict.fromkeys(pose for pose in map(_pose, up) if pose))[:REPEATS]
    return (*new, *(
        NextPose(DIRECTIONS[name], f"{spoken(name)} again: a drift shows there", name,
                 brief="once more, to show a drift")
        for name in first
    ))  # fmt: skip


def missing(bench: Bench) -> tuple[NextPose, ...]:
    """Directions, or turns, that the model needs."""
    if isinstance(bench.measured, HoldData):
        return missing_directions(up_of(bench), bench.fit.base)
    return tuple(turns("xyz", "the gyroscope's gains need turns about every axis"))


def missing_directions(up: FloatArray, base: tuple[str, ...]) -> tuple[NextPose, ...]:
    """Poses until the directions carry the terms of the base, the most telling one first.

    Args:
        up: directions held, unit vectors, shape (n, 3).
        base: terms that are to be carried.
    """
    directions = list(up)
    names = [*FACES, *EDGES, *CORNERS]
    found: list[NextPose] = []
    while len(found) < MOST and not _carries(np.array(directions).reshape(-1, 3), base):
        columns = design(np.array(directions).reshape(-1, 3))
        gain = [_gain(columns, DIRECTIONS[name]) for name in names]
        best = names[int(np.argmax(np.round(gain, 6)))]
        directions.append(DIRECTIONS[best])
        found.append(NextPose(DIRECTIONS[best], f"{spoken(best)}: {_lacks(base)}", best))
    return tuple(found)


def _carries(up: FloatArray, base: tuple[str, ...]) -> bool:
    try:
        carried = decide(up)
    except DataError:
        return False
    whole = "non-orthogonality" not in base or not carried.dropped
    return whole and set(base) <= set(carried.terms) and carried.spare >= SPARE


def _gain(columns: FloatArray, up: FloatArray) -> float:
    """Growth of the information about the nine parameters by one more direction.

    A faint prior stands for what no direction has shown yet.
    """
    row = design(up[None])[0]
    information = columns.T @ columns + 1e-3 * np.eye(len(row))
    return float(row @ np.linalg.solve(information, row))


def _lacks(base: tuple[str, ...]) -> str:
    return f"needed to carry {', '.join(base)}"


def _pose(up: FloatArray) -> str | None:
    return nearest(up, DIRECTIONS, POSE_TOLERANCE_DEG)


def _name(up: FloatArray) -> str:
    """A direction in words."""
    name = _pose(up)
    return spoken(name) if name else spoken_up(up)
