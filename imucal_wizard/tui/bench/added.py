"""The added-variable plot: what is left against what a suspect would make of it.

Residual ``r`` and the pattern of the suspect's largest parameter are both freed from all that the
model and the suspect's other parameters can absorb. What remains lies on a line through the origin
whose slope is the parameter's size, if the suspect is right; on a cloud, if it is not.
"""

import numpy as np

from imucal_wizard.bench.misfit import Misfit, RowKind
from imucal_wizard.readings import FloatArray
from imucal_wizard.solver.slow_noise import complement
from imucal_wizard.tui.bench.entries import Entry
from imucal_wizard.tui.bench.model_rows import unit_words
from imucal_wizard.tui.bench.views import HOLDS, STILL, TURNS, View
from imucal_wizard.tui.report_rows import SHOWN
from imucal_wizard.tui.text import number

_PARTS = {RowKind.HOLD: (HOLDS, "m/s^2"), RowKind.STILL: (STILL[0], "rad/s"),
          RowKind.ROTATION: (TURNS, "rad")}  # fmt: skip


def added_view(misfit: Misfit, entry: Entry) -> View | None:
    """The added-variable plot of a suspect; None for what has no pattern."""
    if entry.suspect is None or entry.suspect.candidate is None:
        return None
    candidate, place = entry.suspect.candidate, entry.largest
    others = np.delete(candidate.columns, place, axis=1)
    residual, pattern = freed(misfit, others, candidate.columns[:, place])
    strength = float(pattern @ pattern)
    if strength <= 0.0:
        return None
    slope = float(pattern @ residual) / strength
    name = candidate.names[place]
    kind = _clearest(misfit, pattern)
    rows = np.flatnonzero(misfit.kind == kind)
    part, unit = _PARTS[kind]
    if kind == RowKind.STILL:
        axis = max(range(3), key=lambda k: float((pattern[misfit.axis == k] ** 2).sum()))
        rows, part = rows[misfit.axis[rows] == axis], STILL[axis]
    factor, shown = SHOWN[unit]
    x, y = (values[rows] * misfit.sigma[rows] * factor for values in (pattern, residual))
    order = np.argsort(x, kind="stable")
    size = f"{number(slope)} {unit_words(candidate.unit)}"
    return View(
        part=part,
        title=f"does {entry.term} {name} explain it? It would be {size}",
        x_label=f"what 1 {candidate.unit} of {entry.term} {name} would leave here, {shown}",
        unit=shown,
        x=x[order],
        y=y[order],
        source=misfit.source[rows][order],
        floor=factor * float(np.sqrt(np.mean(misfit.sigma[rows] ** 2))),
        slope=slope,
    )


def freed(misfit: Misfit, others: FloatArray, pattern: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Residual and pattern without what the base and other columns absorb, whitened, (n,) each."""
    base = np.concatenate([misfit.base, others], axis=1)
    length = np.linalg.norm(base, axis=0)
    across = complement(base[:, length > 0.0] / length[length > 0.0])
    return across @ (across.T @ misfit.residual), across @ (across.T @ pattern)


def _clearest(misfit: Misfit, pattern: FloatArray) -> RowKind:
    """The kind of rows in which the pattern shows most."""
    kinds = [RowKind(int(kind)) for kind in np.unique(misfit.kind)]
    return max(kinds, key=lambda kind: float((pattern[misfit.kind == kind] ** 2).sum()))
