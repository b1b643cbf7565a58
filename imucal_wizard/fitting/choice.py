"""Which of the limits of rest suits a recording: the one whose holds calibrate best."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.errors import DataError
from imucal_wizard.fitting.rounded import Steps
from imucal_wizard.procedure.holds import Hold
from imucal_wizard.procedure.reduction import reduce
from imucal_wizard.procedure.segmentation import candidates, loose_candidates, rests
from imucal_wizard.readings import FloatArray, Readings
from imucal_wizard.solver.judging import disturbed, judge

EQUAL = 1.1
"""Expected errors that differ by less say nothing: each comes from about thirty residuals, which
know a spread to 13 % at best."""
GOOD = 1e-3
"""An expected error, in units of gravity, below which no looser limit needs to be tried."""


def find_holds(readings: Readings, gravity: float) -> tuple[list[Hold], Steps]:
    """The holds under the limit from which the best calibration follows; steps of the readings."""
    stream = reduce(readings)
    if stream is None:
        raise DataError(
            "the recording is too short: at least two seconds of rest and six still positions are "
            "needed"
        )
    steps = stream.step_a, stream.step_g
    found = [holds for _, holds in candidates(stream)]
    errors = [judge(holds, gravity, rests(holds)) for holds in found]
    if min(errors) > GOOD * gravity:
        looser = [holds for _, holds in loose_candidates(stream)]
        found += looser
        errors += [judge(holds, gravity, rests(holds)) for holds in looser]
    best = _best(found, errors)
    odd = disturbed(best, gravity)
    if odd is None:
        return best, steps
    # a hold that was disturbed is so under every limit and must not decide between them
    others = [_without(holds, best[odd]) for holds in found]
    return _best(found, [judge(holds, gravity, rests(holds)) for holds in others]), steps


def _best(found: Sequence[list[Hold]], errors: Sequence[float]) -> list[Hold]:
    """Of those that are about as good as the best, the one with the longest holds.

    A limit that is too strict breaks holds to pieces, one too loose adds slow moments of turns. The
    pieces of one rest are judged as one, or a calm rest would count the more the more it is broken.
    """
    least = min(errors)
    if not np.isfinite(least):
        return max(found, key=_directions)
    equal = [one for one, error in zip(found, errors, strict=True) if error <= EQUAL * least]
    return max(equal, key=lambda holds: sum(one.end - one.start for one in holds) / len(holds))


def _without(holds: Sequence[Hold], odd: Hold) -> list[Hold]:
    """The holds at other times."""
    return [hold for hold in holds if hold.end <= odd.start or hold.start >= odd.end]


def _directions(holds: Sequence[Hold]) -> tuple[int, float]:
    """How many clearly different readings there are, and for how long in all."""
    means = np.array([hold.accelerometer for hold in holds]).reshape(-1, 3)
    leaders: list[FloatArray] = []
    reach = 0.2 * float(np.ptp(means, axis=0).max()) if len(means) else 0.0
    for mean in means:
        if all(np.linalg.norm(mean - leader) > reach for leader in leaders):
            leaders.append(mean)
    return len(leaders), sum(hold.end - hold.start for hold in holds)
