"""The non-linear setting of an effect (time constant, moment), refined between the trial values.

A warm-up is looked for with a handful of time constants; the one that fits lies between them. If
the error is a hundred times the noise, the nearest trial value leaves more than noise, and the rest
would be attributed to another effect.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import Minimum, report
from imucal_wizard.estimate.result import Parameter, SensorFit
from imucal_wizard.model.terms import Term

GOLDEN = 0.5 * (5.0**0.5 - 1.0)
GOLDEN_STEPS = 9
"""Each narrows by the golden section: together by a factor of 76."""
MIN_SETTING_DIFFERENCE = 0.04
"""Settings that differ by less than this share are one: two trial values a factor of 3 apart are
narrowed to a factor of 1.04."""
MIN_MOMENT_DIFFERENCE = 0.05
"""Seconds down to which the moment of a step is looked for among the suspects."""
ASIDE = 0.08
"""How far to either side the fall of the likelihood is measured, in the logarithm."""

Fit = Callable[[Term], Minimum[Experiment]]
"""The minimum with a term. All figures of a fit take as long as the fit: only the best has them."""


def most_likely_setting(fit: Fit, term: Term, variants: Sequence[float | None]) -> SensorFit:
    """The likeliest fit between the settings on either side of the one given.

    By the golden section in its logarithm and the likelihood of what each fit leaves.

    Args:
        fit: of the model with this term.
        term: with the likeliest of the settings tried.
        variants: the settings tried.

    Returns:
        The fit with the best setting; with the one given, where the effect has no setting between
        two of those tried.
    """
    grid = _grid(term, variants)
    if not grid:
        return report(fit(term))
    tried = _Tried(lambda at: fit(replace(term, variant=float(np.exp(at)))))
    settle(tried.unlikely, grid, float(np.log(term.variant or 1.0)))
    best = tried.best
    spread, found = _spread(tried.unlikely, best), report(tried.found(best))
    if not spread:
        return found
    return _with_doubt(found, report(tried.found(best + ASIDE)), ASIDE / spread)


def most_likely_moment(
    fit: Fit,
    term: Term,
    moments: Sequence[float],
    times: Sequence[float],
    reference: Callable[[Minimum[Experiment]], float] | None = None,
) -> Minimum[Experiment]:
    """The likeliest fit with a step.

    Args:
        fit: of the model with this term.
        term: with one of the moments to begin at.
        moments: half way between holds, in order, s.
        times: middles of the holds, in order, s: the moment is settled inside a hold or a rotation,
            too, of which a part then lies after the step.
        reference: twice the negative logarithm of the likelihood of what rests on the fit.
    """
    tried = _Tried(lambda at: fit(replace(term, variant=at)), reference)
    begin = [*moments].index(term.variant or moments[0])
    first, last = _likeliest(tried.unlikely, moments, begin)
    before = max(int(np.searchsorted(times, moments[first])) - 1, 0)
    after = min(int(np.searchsorted(times, moments[last])), len(times) - 1)
    # the golden section comes back to places, up to rounding
    _narrow(lambda at: tried.unlikely(round(at, 3)), times[before], times[after], 0.0)
    return tried.found(tried.best)


class _Tried:
    """Fits of one term with different settings; one that does not converge is no candidate.

    Args:
        fit: with a setting.
        reference: see ``most_likely_moment``.
    """

    def __init__(
        self,
        fit: Callable[[float], Minimum[Experiment]],
        reference: Callable[[Minimum[Experiment]], float] | None = None,
    ) -> None:
        self._fit, self._reference = fit, reference
        self._unlikely: dict[float, float] = {}
        self._problem: DataError | None = None
        self._found: dict[float, Minimum[Experiment]] = {}

    def unlikely(self, at: float) -> float:
        """See ``unlikeliness``; infinite where the fit does not converge."""
        if at not in self._unlikely:
            self._unlikely[at] = np.inf
            try:
                self._found[at] = self._fit(at)
            except DataError as error:
                self._problem = error
            else:
                self._unlikely[at] = unlikeliness(self._found[at])
                if self._reference is not None:
                    self._unlikely[at] += self._reference(self._found[at])
        return self._unlikely[at]

    @property
    def best(self) -> float:
        """The likeliest setting.

        Raises:
            DataError: no fit converges.
        """
        if not self._found and self._problem is not None:
            raise self._problem
        return min(self._found, key=lambda at: self._unlikely[at])

    def found(self, at: float) -> Minimum[Experiment]:
        """The fit with a setting that was tried."""
        return self._found[at]


def settle(
    unlikely: Callable[[float], float],
    grid: Sequence[float],
    begin: float,
    least: float = MIN_SETTING_DIFFERENCE,
) -> None:
    """Try settings until the best one is enclosed; ``unlikely`` keeps what it was asked for.

    Args:
        unlikely: of a setting, or of its logarithm, see ``unlikeliness``.
        grid: the settings to begin with, in order.
        begin: the one to begin at.
        least: difference of two settings that is not halved any more.
    """
    first, last = _likeliest(unlikely, grid, grid.index(begin))
    _narrow(unlikely, grid[max(first - 1, 0)], grid[min(last + 1, len(grid) - 1)], least)


def unlikeliness(found: Minimum[Experiment]) -> float:
    """Twice the negative logarithm of the likelihood of a fit's rows."""
    variance = found.balance.variance
    return float((found.system.residual**2 / variance + np.log(variance)).sum())


def _grid(term: Term, variants: Sequence[float | None]) -> list[float]:
    """Logarithms of the settings tried, in order; none where there is nothing between them."""
    if not term.effect.graded or term.variant is None:
        return []
    return sorted({float(np.log(one)) for one in (*variants, term.variant) if one is not None})


def _likeliest(
    unlikely: Callable[[float], float], grid: Sequence[float], best: int
) -> tuple[int, int]:
    """Walk along the grid to the best place: the first and the last one that are as likely.

    The moments on either side of a row that a step does not change are equally likely.
    """
    while True:
        first = last = best
        while first > 0 and unlikely(grid[first - 1]) == unlikely(grid[best]):
            first -= 1
        while last < len(grid) - 1 and unlikely(grid[last + 1]) == unlikely(grid[best]):
            last += 1
        near = range(max(first - 1, 0), min(last + 2, len(grid)))
        better = min(near, key=lambda k: unlikely(grid[k]))
        if unlikely(grid[better]) == unlikely(grid[best]):
            return first, last
        best = better


def _narrow(
    unlikely: Callable[[float], float],
    begin: float,
    end: float,
    least: float = MIN_SETTING_DIFFERENCE,
    *,
    outwards: bool = False,
) -> None:
    """Try places between two by the golden section.

    With errors far above the noise the likelihood has a sharp cusp, which no parabola fits. Moments
    between which no row changes are equally likely: the best one lies on either side of them.

    Args:
        unlikely: of a place.
        begin: one end.
        end: the other end.
        least: distance of the ends that is not narrowed any more.
        outwards: from equally likely places at the beginning.
    """
    for _ in range(GOLDEN_STEPS):
        if abs(end - begin) < least:
            return
        near, far = end - GOLDEN * (end - begin), begin + GOLDEN * (end - begin)
        if unlikely(near) < unlikely(far):
            end = far
        elif outwards or unlikely(near) > unlikely(far):
            begin = near
        else:
            _narrow(unlikely, near, begin, least, outwards=True)
            _narrow(unlikely, far, end, least, outwards=True)
            return


def _spread(unlikely: Callable[[float], float], best: float) -> float:
    """Standard deviation of the setting's logarithm by how fast the likelihood falls; 0: none."""
    bend = unlikely(best - ASIDE) + unlikely(best + ASIDE) - 2.0 * unlikely(best)
    return float(np.sqrt(2.0 / bend)) * ASIDE if bend > 0.0 else 0.0


def _with_doubt(fit: SensorFit, moved: SensorFit, steps: float) -> SensorFit:
    """The fit with the doubt about one more unknown in its standard errors.

    To first order ``Var = Var(known setting) + d dᵀ``, ``d`` what the parameters move by when the
    setting moves by one standard deviation.

    Args:
        fit: with the likeliest setting.
        moved: the same model with the setting moved.
        steps: standard deviations that it was moved by.
    """
    if fit.size_covariance is None:
        return fit
    change = (_flat(moved) - _flat(fit)) / steps
    covariance = fit.size_covariance + np.outer(change, change)
    ends = np.cumsum([len(size) for size in fit.sizes])[:-1]
    values = {one.name: one.value for one in moved.parameters}
    parameters = tuple(_wider(one, values[one.name], steps) for one in fit.parameters)
    return replace(
        fit,
        parameters=parameters,
        size_errors=tuple(np.split(np.sqrt(np.diag(covariance)), ends)),
        size_covariance=covariance,
    )


def _flat(fit: SensorFit) -> FloatArray:
    return np.concatenate([np.zeros(0), *fit.sizes])


def _wider(one: Parameter, moved: float, steps: float) -> Parameter:
    if one.standard_error is None:
        return one
    wider = float(np.hypot(one.standard_error, (moved - one.value) / steps))
    return replace(one, standard_error=wider)
