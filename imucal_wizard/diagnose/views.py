"""Plots of a fit: residuals, and measurement beside model, against each influence.

A picture has a name, so that a command can print it: ``force-x`` shows what is left of each hold
over the force along x, ``model-x-force-x`` the reading of the x axis beside the model's,
``suspect-second-order`` what that effect would explain (the added-variable plot).
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.quantities import number, readable, size_with_unit, with_unit
from imucal_wizard.core.readings import FloatArray, IntArray, Series
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import complement, root_mean_square
from imucal_wizard.diagnose.bench import BenchFindings
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.free_curves import shape_of
from imucal_wizard.diagnose.residuals import WhitenedResiduals
from imucal_wizard.diagnose.suspects import Suspect
from imucal_wizard.estimate.experiment import Beside
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.model.effect import Effect
from imucal_wizard.model.lesson import picture
from imucal_wizard.model.rows.source import RowSource
from imucal_wizard.model.rows.table import ResidualTable
from imucal_wizard.model.unknown_shape import UnknownShape

COMPARED = tuple(f"{axis} axis" for axis in AXES)
"""Parts that set measurement beside model."""
_LOOK_FOR = {
    "force": "A curve that is odd in the force indicates a second-order term or an asymmetry, an "
    "even curve a third-order or odd-quadratic term.",
    "rest-force": "A straight line indicates a g-sensitivity, a curve that is even in the force a "
    "sensitivity to the square of the force.",
    "rest-pose": "Repeats of a pose share a column: no effect of orientation explains their "
    "scatter. Errors at edges and corners only indicate a product of two forces.",
    "field": "A curve indicates soft iron that is not in the model, or iron nearby.",
    "pose": "Repeats of a pose share a column: no effect of orientation explains their scatter. "
    "Errors at corners only indicate a product of all three axes.",
    "number": "A trend or a jump indicates a bias that changes, or a disturbed hold.",
    "time": "A slope or a curve indicates a slow bias (drift, warm-up, temperature), a jump a "
    "bias step.",
    "temperature": "A slope indicates a bias or a scale that depends on the temperature.",
    "previous": "A slope indicates hysteresis: the reading depends on the pose before.",
    "vibration": "A slope indicates vibration rectification.",
    "current": "A straight line through the points of one direction indicates the field of the "
    "board's own current.",
    "rate": "An angle that grows with the rate indicates a scale that depends on rate or sense.",
    "up": "A dependence on the direction before the rotation indicates a g-sensitivity.",
    "model": "If × and ∘ differ by more than the noise, the model lacks something.",
    "curve": "The curve is known only up to what the base model absorbs; the bars are its standard "
    "errors, widest where no pose was held.",
    "suspect": "Points along the line support the effect; a cloud about zero does not.",
}
"""What the eye should look for, by the first word of the abscissa's name, after that of its rows
where they show other effects than those of the accelerometer."""


@dataclass(frozen=True, eq=False)
class ResidualView:
    """Points to draw.

    Attributes:
        name: under which a command prints it, ``force-x``.
        part: which part of the data.
        title: what is drawn.
        x_label: what it is drawn over, with its unit.
        unit: of y, as people read it.
        x: shape (n,), in order.
        y: shape (n,).
        source: number of each point's hold, rotation or group of samples, from 0, shape (n,).
        look_for: what the eye should look for.
        error: what the noise alone makes of each y, one standard deviation, shape (n,), or None.
        slope: y per x of a line through the origin, or None.
        model: what the model says, shape (n,), where the points are what was measured; or None.
        predicted: what a suspect would leave of each point after the base parameters have absorbed
            what they can, shape (n,), or None.
        suspect: name of that suspect, or "".
        rows: the kind of rows that the points belong to, and which of them; None of a drawing.
        together: each y is the length of all components of its rotation.
    """

    name: str
    part: str
    title: str
    x_label: str
    unit: str
    x: FloatArray
    y: FloatArray
    source: IntArray
    look_for: str
    error: FloatArray | None = None
    slope: float | None = None
    model: FloatArray | None = None
    predicted: FloatArray | None = None
    suspect: str = ""
    rows: tuple[RowSource, IntArray] | None = None
    together: bool = False

    @property
    def legend(self) -> str:
        """What the signs of the picture mean: noise band and suspect."""
        word = (
            "standard error" if self.rows is None else f"{noise_word(self.rows[0])} of each point"
        )
        band = "" if self.band is None else f"▒ {word} ±{size_with_unit(self.band, self.unit)}"
        return "  ".join(one for one in (band, self.suspect and f"━ {self.suspect}") if one)

    @property
    def band(self) -> float | None:
        """What the noise alone makes of y, rms over the points; None where it is not known."""
        return None if self.error is None else float(np.sqrt(np.mean(self.error**2)))


def pictures(said: Diagnosis) -> tuple[ResidualView, ...]:
    """All pictures of a sensor: what is left, measured beside model, what each suspect explains."""
    bench = said.bench
    if bench is None:
        return ()
    findings = said.findings
    if findings is None or findings.fit is not bench.fit:  # those of the model before
        findings = bench.look()
    explained = (suspect_view(findings, one) for one in findings.suspects)
    first = None if said.settled else next(iter(findings.suspects), None)
    left = (misfit_curve(findings, view, first) for view in views_of(bench.fit))
    return (*left, *(view for view in explained if view is not None), *_free_curves(findings))


def noise_word(source: RowSource) -> str:
    """What the noise of rows contains: with a reference, also what that is wrong by."""
    return "noise and reference error" if source.needs_reference else "noise"


def _free_curves(findings: BenchFindings) -> Iterator[ResidualView]:
    """The free curves of the model, and those that may be added, each with its standard errors."""
    free = [one.name for one in findings.fit.terms if one.effect.free]
    free += [one.term for one in findings.suspects if one.candidate and one.candidate.effect.free]
    for term in free:
        shape = shape_of(findings.fit, term, findings.suspects)
        if shape is None:
            continue
        title = f"error of {shape.axis} by the free curve {term}"
        yield ResidualView(
            f"curve-{term}", "free curve", title, f"{shape.over}, {shape.x_unit}", shape.unit,
            shape.x, shape.y, np.arange(len(shape.x)),
            f"{_LOOK_FOR['curve']} Here it is {shape.words()}.",
            error=shape.standard_error,
        )  # fmt: skip


def views_of(fit: SensorFit) -> tuple[ResidualView, ...]:
    """All pictures of what a fit leaves, then measurement beside model, by part of the data."""
    table, experiment = fit.rows, fit.experiment
    assert table is not None and experiment is not None  # noqa: S101, PT018 (narrows the types)
    views = list[ResidualView]()
    for part in sorted(_parts(table), key=lambda one: not one.source.moving):
        views += _left_over(table, part)
    return (*views, *_beside_model(experiment.beside(fit)))


def misfit_curve(
    findings: BenchFindings, view: ResidualView, suspect: Suspect | None
) -> ResidualView:
    """A picture of what is left, with what a suspect predicts there.

    The prediction is the least-squares fit of all the suspect's parameters to the residuals, both
    freed from what the base parameters absorb: of a second-order term, a W instead of a parabola.
    Other pictures are returned as they are.
    """
    table, misfit = findings.fit.rows, findings.misfit
    if suspect is None or suspect.candidate is None or table is None or view.rows is None:
        return view
    if view.model is not None or view.slope is not None:
        return view
    across = _across(misfit.base)
    columns, residual = across.T @ suspect.candidate.columns, across.T @ misfit.residual
    sizes = np.linalg.lstsq(columns, residual, rcond=None)[0]
    if suspect.trial is not None and suspect.candidate.effect.free:
        sizes = suspect.trial.size  # without its prior a free curve would follow the noise
    source, at = view.rows
    first = 0
    for one in table.sources:
        if one is source:
            break
        first += len(one.labels)
    predicted = misfit.measured(across @ (columns @ sizes)) * readable(source.unit)[0]
    own = predicted[first : first + len(source.labels)]
    drawn = own[at]
    if view.together:  # the components of one length
        lengths = np.sqrt(np.bincount(source.labels.index, own**2))
        drawn = lengths[source.labels.index[at]]
    return replace(view, predicted=drawn, suspect=suspect.term)


def clearest(
    findings: BenchFindings, views: Sequence[ResidualView], suspect: Suspect
) -> ResidualView | None:
    """The picture of what is left over whose abscissa a suspect's prediction follows best.

    Pictures of rows that the suspect hardly moves are left out: an effect of the rate at rest.
    """
    drawn = [misfit_curve(findings, view, suspect) for view in views]
    sizes = [_size_over_noise(one) for one in drawn]
    best, most = None, -np.inf
    for one, size in zip(drawn, sizes, strict=True):
        if one.predicted is not None and size >= MIN_SHARE_OF_LARGEST * max(sizes):
            share = _explained(replace(one, y=one.predicted))
            if share > most:
                best, most = one, share
    return best


MIN_SHARE_OF_LARGEST = 0.5
"""Of the largest prediction, in units of the noise: rows with less show the effect less clearly."""


def _size_over_noise(view: ResidualView) -> float:
    if view.predicted is None or view.error is None:
        return 0.0
    return root_mean_square(view.predicted / view.error)


def views_over(
    views: Sequence[ResidualView], effect: Effect, sensor: str
) -> Sequence[ResidualView]:
    """The pictures over what an effect depends on, as its lesson has; all if there is none."""
    over = _quantity(picture(effect, sensor).x_label)
    return [view for view in views if _quantity(view.x_label) == over] or views


def _quantity(label: str) -> str:
    """What a label is of: "mean rate about x, °/s" is a rate, like "rate about x, °/s"."""
    words = label.partition(",")[0].split()
    if words[0] == "force" and "before" in words:
        return "force before"
    return "rate" if "rate" in words else words[0]


def opening_view(
    diagnosis: Diagnosis, views: Sequence[ResidualView], effects: Sequence[Effect]
) -> int:
    """Place of the picture to begin with: over what the missing effect depends on.

    A misfit that follows the course of a current may run along another quantity by chance.
    Without a name for the misfit, the picture that explains most of it.
    """
    named = diagnosis.explanations[0] if diagnosis.explanations else ()
    free = [one.candidate.effect for one in diagnosis.suspects[:1] if one.candidate]
    if free and free[0].free:  # nothing with a name explains as much as this curve
        effects, named = free, (free[0].name,)
    for one in diagnosis.suspects:
        effect = next((effect for effect in effects if effect.name == one.term), None)
        if one.term in named and effect is not None and diagnosis.findings is not None:
            own = views_over(views, effect, diagnosis.sensor)
            drawn = clearest(diagnosis.findings, own, one)
            if drawn is not None:
                return [view.name for view in views].index(drawn.name)
    return most_telling(views)


def most_telling(views: Sequence[ResidualView]) -> int:
    """Place of the picture whose abscissa explains most of the misfit.

    What is left of each point, divided by its noise, is fitted by a curve of fourth degree in the
    abscissa. The share of the variance that the curve explains, less what as many free numbers
    explain of noise, decides.
    """
    shares = [_explained(view) for view in views]
    return int(np.argmax(shares)) if shares else 0


CURVE_DEGREE = 4
"""A term of second or third order leaves up to four bends once bias and scale have taken theirs."""


def _explained(view: ResidualView) -> float:
    """Adjusted share of the variance that a curve explains; −inf where there is no misfit curve."""
    free = len(view.x) - CURVE_DEGREE - 1
    if view.error is None or view.slope is not None or free < 1:
        return -np.inf
    at = view.x - view.x.mean()
    at /= max(float(np.abs(at).max()), 1e-300)
    left = view.y / view.error
    total = float(((left - left.mean()) ** 2).sum())
    curve = np.polynomial.legendre.legvander(at, CURVE_DEGREE)
    if total <= 0.0 or np.linalg.matrix_rank(curve) <= CURVE_DEGREE:
        return -np.inf
    rest = left - curve @ np.linalg.lstsq(curve, left, rcond=None)[0]
    return 1.0 - float(rest @ rest) / total * (len(at) - 1) / free


@dataclass(frozen=True, eq=False)
class _Part:
    """Rows that are drawn together.

    Attributes:
        source: which kind.
        name: of the part.
        prefix: with what the names of its pictures begin.
        rows: of the source, shape (n,).
        first: row of the table that the source begins with.
    """

    source: RowSource
    name: str
    prefix: str
    rows: IntArray
    first: int


def _parts(table: ResidualTable) -> Iterator[_Part]:
    first = 0
    for source in table.sources:
        axes = source.labels.axis
        for axis, name, prefix in source.axes():
            rows = np.flatnonzero((axes == axis) | (axis < 0))
            yield _Part(source, name, prefix, rows, first)
        first += len(axes)


def _left_over(table: ResidualTable, part: _Part) -> Iterator[ResidualView]:
    """What is left of one part; components of one length are drawn as that."""
    source, rows, first = part.source, part.rows, part.first
    factor, unit = readable(source.unit)
    own, place = np.unique(source.labels.index[rows], return_index=True, return_inverse=True)[1:]
    left, error = table.residual[first + rows], table.floor[first + rows]
    together = len(own) < len(rows)
    if together:
        left, error = (np.sqrt(np.bincount(place, one**2)) for one in (left, error))
        rows = rows[own]
    for over in source.influences():
        chosen, word = _in_order(over.values[rows]), over.name.partition("-")[0]
        if len(chosen):
            at = rows[chosen]
            yield ResidualView(
                part.prefix + over.name, part.name, source.left, over.label, unit, over.values[at],
                left[chosen] * factor, source.labels.index[at],
                _LOOK_FOR.get(source.prefix + word) or _LOOK_FOR[word], error[chosen] * factor,
                rows=(source, at), together=together,
            )  # fmt: skip


def _beside_model(found: Beside) -> Iterator[ResidualView]:
    """Measurement and model of each axis, over its own input first."""
    factor, unit = readable(found.unit)
    source, over = found.source, found.source.influences()
    title = f"{found.title}: ∘ measured, × model"
    for k, part in enumerate(COMPARED):
        for one in (over[k], *over[:k], *over[k + 1 :]):
            chosen = _in_order(one.values[found.rows])
            if len(chosen):
                at = found.rows[chosen]
                read, model = (values[chosen, k] * factor for values in (found.read, found.model))
                yield ResidualView(
                    f"model-{AXES[k]}-{one.name}", part, title, one.label, unit, one.values[at],
                    read, source.labels.index[at], _LOOK_FOR["model"], model=model,
                    rows=(source, at),
                )  # fmt: skip


def _in_order(values: FloatArray) -> IntArray:
    """Places of the values that are known, by size; none where they do not differ."""
    seen = np.isfinite(values)
    least = 1e-9 * max(1.0, float(np.abs(values[seen]).max(initial=0.0)))
    if seen.sum() < 2 or np.ptp(values[seen]) < least:
        return np.zeros(0, np.int64)
    return np.flatnonzero(seen)[np.argsort(values[seen], kind="stable")]


def suspect_view(findings: BenchFindings, suspect: Suspect) -> ResidualView | None:
    """The added-variable plot of a suspect; None for what has no pattern.

    Residual and the pattern of the suspect's largest parameter are both freed from all that the
    model and the suspect's other parameters can absorb. What remains lies on a line through the
    origin whose slope is the parameter's size, if the suspect is right. A free curve, which has no
    such parameter, is drawn over what it depends on.
    """
    misfit, table = findings.misfit, findings.fit.rows
    if suspect.candidate is None or table is None:
        return None
    curve = suspect.candidate.effect
    if isinstance(curve, UnknownShape):
        over = curve.influence(findings.fit.sensor)
        views = {view.name: view for view in views_of(findings.fit)}
        for name in (f"rest-{curve.letter}-{over}", over):
            view = views.get(name)
            if view is not None:
                drawn = misfit_curve(findings, view, suspect)
                look_for = _LOOK_FOR["suspect"]
                return replace(drawn, name=f"suspect-{suspect.term}", look_for=look_for)
        return None
    candidate, place = suspect.candidate, suspect.largest
    others = np.delete(candidate.columns, place, axis=1)
    residual, pattern = freed(misfit, others, candidate.columns[:, place])
    strength = float(pattern @ pattern)
    if strength <= 0.0:
        return None
    slope = float(pattern @ residual) / strength
    # of several kinds of rows, the one in which the pattern shows most
    part = max(_parts(table), key=lambda one: float((pattern[one.first + one.rows] ** 2).sum()))
    rows, unit = part.first + part.rows, part.source.unit
    factor, shown = readable(unit)
    x, y = (factor * misfit.measured(values)[rows] for values in (pattern, residual))
    order = np.argsort(x, kind="stable")
    name = f"{suspect.term} {candidate.names[place]}"
    size = with_unit(number(slope), candidate.unit)
    return ResidualView(
        name=f"suspect-{suspect.term}",
        part=part.name,
        title=f"does {name} explain it? It would be {size}",
        x_label=f"left by {with_unit('1', candidate.unit)} of {name}, {shown}",
        unit=shown,
        x=x[order],
        y=y[order],
        source=table.index[rows][order],
        rows=(part.source, part.rows[order]),
        look_for=_LOOK_FOR["suspect"],
        error=factor * misfit.sigma[rows][order],
        slope=slope,
    )


def freed(
    misfit: WhitenedResiduals, others: FloatArray, pattern: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Residual and pattern without what the base and other columns absorb, whitened, (n,) each.

    A parameter that a prior holds absorbs what its prior allows.
    """
    count, priors = len(misfit), np.diag(misfit.held)[misfit.held > 0.0]
    rows = np.block([[misfit.base, others], [priors, np.zeros((len(priors), others.shape[1]))]])
    across = _across(rows)[:count]
    return across @ (across.T @ misfit.residual), across @ (across.T @ pattern)


def _across(columns: FloatArray) -> FloatArray:
    """Orthonormal directions across these columns, shape (n, n − rank)."""
    length = np.linalg.norm(columns, axis=0)
    return complement(columns[:, length > 0.0] / length[length > 0.0])


@dataclass(frozen=True, eq=False)
class Point:
    """What a point of a picture was measured from.

    Attributes:
        name: ``hold 7, +x up``, ``rotation 3 about x``, ``field along +x−y``.
        time: since the session's first sample, s.
        reading: mean reading; of a rotation the fastest rate, °/s; shape (3,).
        unit: of the reading; "" for that of the sensor.
        start: when its samples begin, s in the recording's own time; NaN where that is not known.
        end: when they end.
        at_rest: its samples were averaged at rest.
        samples: its readings, where they are kept with the rows.
    """

    name: str
    time: float
    reading: FloatArray
    unit: str
    start: float
    end: float
    at_rest: bool
    samples: Series | None = None


def point_of(report: FitReport | None, view: ResidualView, place: int) -> Point:
    """What the point at this place of a picture was measured from.

    Args:
        report: the fit of the recording: which holds were held by hand, about which axis it turned.
        view: the picture.
        place: of the point in it.
    """
    assert view.rows is not None, "points of a fit have rows"  # noqa: S101 (narrows the type)
    source, row = view.rows[0], int(view.rows[1][place])
    item, name = source.item(row), source.place(row)
    if report is not None and source.at_rest:
        name += ", hand-held" * report.holds[item].hand_held
    if report is not None and source.moving and item < len(report.rotations):
        axis = report.rotations[item].axis
        name += f" about {axis}" if axis else ""
    reading, unit = source.measured(row)
    samples = source.samples_of(row)
    start, end = source.labels.span[row].tolist()
    return Point(
        name=name,
        time=float(source.labels.time[row]),
        reading=reading,
        unit=unit,
        start=start,
        end=end,
        at_rest=source.at_rest,
        samples=None if samples is None else Series(*samples, ""),
    )
