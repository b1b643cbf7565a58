"""From a fit to the misfit that the bench asks its questions of."""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.bench.misfit import Candidate, Misfit, RowKind
from imucal_wizard.effects.effect import Circumstances, Effect
from imucal_wizard.solver.extended.linear import Linear

KINDS = {kind.name.lower(): kind for kind in RowKind}


def misfit_of(
    linear: Linear,
    sensor: str,
    holds: Circumstances,
    effects: Sequence[Effect],
) -> Misfit:
    """What a fit leaves, whitened by the noise alone, with every effect that may explain it.

    Args:
        linear: the fit made linear.
        sensor: whose.
        holds: circumstances of the holds, in the order of the fit's indices.
        effects: those that may explain it.
    """
    ratio = (linear.sigma / linear.floor)[:, None]
    kind = np.array([KINDS[row.kind] for row in linear.rows], np.int64)
    source = np.array([row.index for row in linear.rows], np.int64)
    axis = np.array([-1 if row.axis is None else row.axis for row in linear.rows], np.int64)
    direction, lever = _seen(linear, holds, kind, source, axis)
    candidates = [
        candidate
        for effect in effects
        for candidate in _candidates(linear, sensor, holds, effect, ratio)
    ]
    return Misfit(
        residual=linear.residual * ratio[:, 0],
        base=_with_priors(linear, ratio),
        kind=kind,
        source=source,
        direction=direction,
        axis=np.where(kind == RowKind.STILL, axis, -1),
        time=linear.order,
        sigma=linear.floor,
        group=linear.groups,
        visit=linear.visits,
        lever=lever,
        candidates=tuple(candidates),
    )


def _seen(
    linear: Linear, holds: Circumstances, kind: np.ndarray, source: np.ndarray, axis: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Direction of each row, and how it moves with the biases."""
    if linear.seen is not None:
        return linear.seen.direction, linear.seen.shown
    up = holds.force / np.linalg.norm(holds.force, axis=1)[:, None]
    direction = np.full((len(kind), 3), np.nan)
    at_rest = kind != RowKind.ROTATION
    direction[at_rest] = up[source[at_rest]]
    return direction, _lever(linear, direction, axis)


def _lever(linear: Linear, direction: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """How rows move with the biases; without biases in the model, those at rest alone."""
    at_rest = np.isfinite(direction).all(axis=1)
    names = [f"bias_{letter}" for letter in "xyz"]
    if not set(names) <= set(linear.names):
        still = np.eye(3)[np.maximum(axis, 0)] * (axis >= 0)[:, None]
        return np.where(at_rest[:, None], np.where((axis >= 0)[:, None], still, direction), 0.0)
    columns = linear.base[:, [linear.names.index(name) for name in names]]
    moved = columns * linear.sigma[:, None]
    # in counts, or dimensionless: a mean at rest moves by one
    return np.asarray(moved / np.median(np.linalg.norm(moved[at_rest], axis=1)))


def _with_priors(linear: Linear, ratio: np.ndarray) -> np.ndarray:
    """The columns of what is fitted already; a column that only its prior holds is left out."""
    columns = linear.base * ratio
    strength = (columns**2).sum(axis=0)
    return np.asarray(columns[:, strength > linear.precision])


def _candidates(
    linear: Linear, sensor: str, holds: Circumstances, effect: Effect, ratio: np.ndarray
) -> list[Candidate]:
    parameters = effect.parameters(sensor)
    return [
        Candidate(
            term=effect.name,
            family=effect.family or effect.name,
            variant=variant,
            names=tuple(parameter.name for parameter in parameters),
            # an effect of size s leaves what adding −s to the model would take away
            columns=-linear.lift(effect, variant) * ratio,
            typical=np.array([parameter.typical for parameter in parameters]),
            unit=parameters[0].unit,
        )
        for variant in effect.variants(holds)
    ]
