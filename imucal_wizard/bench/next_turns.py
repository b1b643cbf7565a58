"""How much better turns would tell two explanations of a gyroscope's misfit apart.

Turns that nobody has made yet are laid beside those there are, as a hand makes them: from the start
pose to the left and back, each speed once. What each does to the closures is the derivative that
the fit itself works with, at the present calibration.
"""

from dataclasses import replace

import numpy as np

from imucal_wizard.bench.next_poses import Explained, apart_length, size_needed
from imucal_wizard.bench.pose import SPEEDS
from imucal_wizard.effects.effect import Circumstances
from imucal_wizard.procedure.plan import START_POSES
from imucal_wizard.procedure.poses import AXES, DIRECTIONS
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.extended.levers import effect_columns, levers
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.extended.samples import lay_samples
from imucal_wizard.solver.extended.terms import Term, Terms
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.solver.extended.turn_fit import across, stacked
from imucal_wizard.solver.extended.turn_model import base_columns, doubt_columns, point_at

ANGLE = 120.0
"""How far each turn goes, degrees."""
STEP = 0.01
"""Between two samples, s."""


def turns_apart(
    data: TurnData, fit: Extended, first: Explained, second: Explained, axis: str
) -> tuple[float, float]:
    """Size of the first explanation at which it is told from the second: now, and with the turns.

    Args:
        data: what was measured.
        fit: the present fit of it.
        first: the likelier explanation.
        second: the other one.
        axis: the body axis to turn about.

    Returns:
        In shares of the first explanation's estimate; infinite where no size would do.
    """
    linear = fit.linear
    held = np.diag(np.sqrt(linear.precision))
    nothing = np.zeros((len(held), 1))
    own = linear.lift(first.effect, first.variant) @ first.size[:, None]
    other = linear.lift(second.effect, second.variant)
    base = np.concatenate([linear.base, held])
    own = np.concatenate([own, nothing])
    other = np.concatenate([other, np.zeros((len(held), other.shape[1]))])
    before = apart_length(base, own, other)
    more = _rows(data, fit, first, second, axis)
    after = apart_length(
        *(np.concatenate(pair) for pair in zip((base, own, other), more, strict=True))
    )
    return size_needed(before), size_needed(after)


def _rows(
    data: TurnData, fit: Extended, first: Explained, second: Explained, axis: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Whitened rows of the turns: base columns, the first at its size, the second's columns."""
    turns = _imagined(data, fit, axis)
    point = point_at(turns, Terms("gyroscope", ()), fit.fit.matrix, fit.fit.bias, np.zeros(0))
    lever, basis = levers(turns, point), across(turns.after)

    def moved(term: Term) -> FloatArray:
        return stacked(basis, *effect_columns(turns, point, term, lever))

    closing, still = base_columns(turns, point)
    free = list(data.free(fit.base))
    doubts = doubt_columns(turns, point)
    columns = [
        stacked(basis, closing[:, :, free], still[:, :, free]),
        *(moved(term) for term in fit.terms),
        stacked(basis, doubts, np.zeros((0, 3, doubts.shape[2]))),
    ]
    weight = 1.0 / np.sqrt(np.repeat(turns.closing_noise, 2))[:, None]
    own = moved(Term(first.effect, first.variant)) @ first.size[:, None]
    other = moved(Term(second.effect, second.variant))
    return np.concatenate(columns, axis=1) * weight, own * weight, other * weight


def _imagined(data: TurnData, fit: Extended, axis: str) -> TurnData:
    """Turns to the left and back at each speed, beginning in the start pose."""
    along = np.eye(3)[AXES.index(axis)]
    start = DIRECTIONS[START_POSES[axis]]
    end = _turned(start, along, np.radians(ANGLE))
    rates, ups = [], []
    for speed in SPEEDS:
        pulse = _pulse(np.radians(speed), np.radians(ANGLE))
        rates += [pulse[:, None] * along, -pulse[:, None] * along]
        ups += [(start, end), (end, start)]
    inverse = np.linalg.inv(fit.fit.matrix)
    times = [np.asarray(STEP * np.arange(len(rate)), np.float64) for rate in rates]
    samples = lay_samples(times, [rate @ inverse.T + fit.fit.bias for rate in rates])
    before, after = (np.array(side) for side in zip(*ups, strict=True))
    turning = np.array([row.kind == "rotation" for row in fit.linear.rows])
    noise = float(np.median(fit.linear.sigma[turning] ** 2))
    return replace(
        data,
        samples=samples,
        rotations=np.arange(len(rates)),
        before=before,
        after=after,
        before_doubt=_doubt(data, before),
        after_doubt=_doubt(data, after),
        closing_noise=np.full(len(rates), noise),
        motion=_motion(data, samples.time, np.concatenate(rates), before[samples.rotation]),
        stills=np.zeros((0, 3)),
        still_rows=np.zeros(0, np.int64),
        labels=np.zeros(0, np.int64),
        still_noise=np.zeros((0, 3)),
        circumstances=data.circumstances.select(slice(0, 0)),
    )


def _pulse(fastest: float, angle: float) -> FloatArray:
    """Rates of a turn that begins and ends softly: ``fastest · sin²``."""
    count = max(round(2.0 * angle / fastest / STEP), 4)
    phase = np.pi * np.arange(count + 1) / count
    return np.asarray(angle / (STEP * count / 2.0) * np.sin(phase) ** 2)


def _turned(up: FloatArray, along: FloatArray, angle: float) -> FloatArray:
    """Up in the body frame after the body has turned about a level axis."""
    return np.asarray(up * np.cos(angle) - np.cross(along, up) * np.sin(angle))


def _doubt(data: TurnData, up: FloatArray) -> FloatArray:
    """What is not known of up there: as at the hold nearest to it, shape (m, 3, k)."""
    nearest = np.argmax(up @ data.before.T, axis=1)
    return np.asarray(data.before_doubt[nearest])


def _motion(
    data: TurnData, time: FloatArray, rate: FloatArray, before: FloatArray
) -> Circumstances:
    """Circumstances of the samples: right after the session, at its last temperature."""
    known, count = data.motion, len(time)
    last = float(known.temperature[-1]) if len(known) else np.nan
    return replace(
        known,
        force=data.gravity * before,
        rate=rate,
        temperature=np.full(count, last),
        time=float(known.time[-1]) + time,
        previous=data.gravity * before,
        vibration=np.full(count, float(np.mean(known.vibration))),
    )
