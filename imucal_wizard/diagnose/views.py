"""Pictures of a fit: what the model leaves, and measurement beside model, against each influence.

A picture has a name, so that a command can print it: ``force-x`` shows what is left of each hold
over the force along x, ``model-x-force-x`` the reading of the x axis beside the model's,
``suspect-second-order`` what that effect would explain (the added-variable plot).
"""

from collections.abc import Iterator

import numpy as np

from imucal_wizard.core.poses import AXES, DIRECTIONS, POSE_TOLERANCE_DEG, nearest_pose
from imucal_wizard.core.quantities import number, readable, true_minus, with_unit
from imucal_wizard.core.readings import FloatArray, IntArray, Series, distinct
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import COUNT, STANDARD_GRAVITY
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.residuals import RowKind, WhitenedResiduals, place_of
from imucal_wizard.diagnose.suspects import Suspect
from imucal_wizard.estimate.accelerometer import BASE, AccelerometerExperiment
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.magnetometer.experiment import MagnetometerExperiment
from imucal_wizard.estimate.magnetometer.field_data import FIELD_BASE
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.estimate.slow_noise import complement
from imucal_wizard.model.rows.table import ResidualTable
from imucal_wizard.model.terms import Terms

HOLDS, ROTATIONS = "holds", "rotations"
HEADINGS = "rotations about the vertical, against the field"
MAGNITUDES = "magnitude of the field"
STILL = tuple(f"at rest, {axis} axis" for axis in AXES)
COMPARED = tuple(f"{axis} axis" for axis in AXES)
"""Parts of the data, each with pictures of its own; the last set measurement beside model."""
_PREFIX = {
    HOLDS: "",
    ROTATIONS: "",
    HEADINGS: "heading-",
    MAGNITUDES: "",
    **{part: f"rest-{axis}-" for part, axis in zip(STILL, AXES, strict=True)},
    **{part: f"model-{axis}-" for part, axis in zip(COMPARED, AXES, strict=True)},
}
"""With what the names of a part's pictures begin."""
_LOOK_FOR = {
    "force": "A curve that is odd in the force speaks for a second-order term or an asymmetry, an "
    "even one for a third-order or odd-quadratic term.",
    "field": "A curve speaks for soft iron that is not in the model, or for iron nearby.",
    "pose": "Repeats of a pose share a column: no effect of orientation explains their scatter. "
    "Errors at corners alone speak for a product of all three axes.",
    "number": "A trend or a jump speaks for a bias that changes, or for a disturbed hold.",
    "time": "A slope or a curve speaks for a slow bias (drift, warm-up, temperature); a jump for a "
    "bias step.",
    "temperature": "A slope speaks for a bias or a scale that follows the temperature.",
    "previous": "A slope speaks for hysteresis: the reading depends on the pose before.",
    "vibration": "A slope speaks for vibration rectification.",
    "current": "A straight line through zero speaks for the field of the board's own current.",
    "rate": "An angle that grows with the rate speaks for a scale that depends on rate or sense.",
    "up": "A dependence on the direction before the rotation speaks for a g-sensitivity.",
    "model": "Where × lies apart from ∘ by more than the noise, the model lacks something.",
    "suspect": "Points along the line speak for the effect; a cloud about zero speaks against it.",
}
"""What the eye should look for, by the first word of the abscissa's name."""


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
        source: index of each point's hold, rotation or row, shape (n,).
        look_for: what the eye should look for.
        error: what the noise alone makes of each y, one standard deviation, shape (n,), or None.
        slope: y per x of a line through the origin, or None.
        model: what the model says, shape (n,), where the points are what was measured; or None.
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

    @property
    def floor(self) -> float | None:
        """What the noise alone makes of y, rms over the points; None where it is not known."""
        return None if self.error is None else float(np.sqrt(np.mean(self.error**2)))


@dataclass(frozen=True, eq=False)
class Influence:
    """Something that residuals may depend on.

    Attributes:
        name: ``force-x``.
        label: with its unit.
        values: per row, NaN where it is not known, shape (n,).
    """

    name: str
    label: str
    values: FloatArray


def views_of(fit: SensorFit, measured: Experiment) -> tuple[ResidualView, ...]:
    """All pictures of what a fit leaves, then measurement beside model, by part of the data."""
    left = (view for part in parts_of(fit) for view in _residual_views(fit, measured, part))
    return (*left, *_beside_model(fit, measured))


def pictures(said: Diagnosis) -> tuple[ResidualView, ...]:
    """All pictures of a sensor: what is left, measured beside model, what each suspect explains."""
    bench = said.bench
    if bench is None:
        return ()
    findings = bench.look()
    explained = (suspect_view(findings.misfit, one) for one in findings.suspects)
    views = views_of(bench.fit, bench.measured)
    return (*views, *(view for view in explained if view is not None))


def parts_of(fit: SensorFit) -> tuple[str, ...]:
    """The parts of the data that a fit has rows of."""
    table = _table(fit)
    found = {_part(str(kind), axis) for kind, axis in zip(table.kind, table.axis, strict=True)}
    return tuple(part for part in (HOLDS, ROTATIONS, HEADINGS, *STILL, MAGNITUDES) if part in found)


def _table(fit: SensorFit) -> ResidualTable:
    assert fit.rows is not None, "a published method has no residual table"  # noqa: S101 (narrows)
    return fit.rows


def _part(kind: str, axis: int) -> str:
    if kind == "still":
        return STILL[axis]
    return {"hold": HOLDS, "field": MAGNITUDES, "heading": HEADINGS}.get(kind, ROTATIONS)


def _residual_views(fit: SensorFit, measured: Experiment, part: str) -> Iterator[ResidualView]:
    """What is left of one part; of a rotation the length of its two components."""
    table = _table(fit)
    parts = [_part(str(kind), axis) for kind, axis in zip(table.kind, table.axis, strict=True)]
    wanted = np.flatnonzero([one == part for one in parts])
    factor, unit = readable("rad/s" if part in STILL else fit.unit)
    left = table.residual[wanted] * factor
    error = table.floor[wanted] * factor
    source = table.index[wanted]
    title = "what is left"
    if part == ROTATIONS:
        title = "the angle by which each rotation does not close"
        source, place = np.unique(source, return_inverse=True)
        left, error = (np.sqrt(np.bincount(place, one**2)) for one in (left, error))
    for over in influences(measured, part, source):
        order = _in_order(over.values)
        if len(order):
            yield ResidualView(
                _PREFIX[part] + over.name, part, title, over.label, unit,
                over.values[order], left[order], source[order],
                _LOOK_FOR[over.name.partition("-")[0]], error[order],
            )  # fmt: skip


def _in_order(values: FloatArray) -> IntArray:
    """Places of the values that are known, by size; none where they do not differ."""
    seen = np.isfinite(values)
    least = 1e-9 * max(1.0, float(np.abs(values[seen]).max(initial=0.0)))
    if seen.sum() < 2 or np.ptp(values[seen]) < least:
        return np.zeros(0, np.int64)
    return np.flatnonzero(seen)[np.argsort(values[seen], kind="stable")]


def influences(measured: Experiment, part: str, source: IntArray) -> Iterator[Influence]:
    """What the residuals of a part may depend on; values of shape (n,) like ``source``."""
    known = measured.circumstances
    if isinstance(measured, MagnetometerExperiment):
        for k, axis in enumerate(AXES):
            yield Influence(f"field-{axis}", f"field along {axis}, µT", known.magnetic[source, k])
        yield Influence("time", "time, min", known.time[source] / 60.0)
        yield Influence("temperature", "temperature, °C", known.temperature[source])
        yield Influence("current", f"current, {known.current_unit}", known.current[source])
        return
    row = source
    if isinstance(measured, GyroscopeExperiment):
        if part in (ROTATIONS, HEADINGS):
            yield from _of_rotations(measured, source)
            return
        row = np.searchsorted(measured.rest.labels.index[::3], source)
    force, before = known.force[row] / STANDARD_GRAVITY, known.previous[row] / STANDARD_GRAVITY
    for k, axis in enumerate(AXES):
        yield Influence(f"force-{axis}", f"force along {axis}, g", force[:, k])
    yield Influence("pose", "pose: 6 faces, 12 edges, 8 corners", _poses(force))
    yield Influence("number", "number of the pose", np.asarray(source + 1.0, np.float64))
    yield Influence("time", "time, min", known.time[row] / 60.0)
    yield Influence("temperature", "temperature, °C", known.temperature[row])
    for k, axis in enumerate(AXES):
        label = f"force along {axis} in the pose before, g"
        yield Influence(f"previous-{axis}", label, before[:, k])
    vibration = np.sqrt(known.vibration[row]) / STANDARD_GRAVITY * 1e3
    yield Influence("vibration", "vibration, mg rms", vibration)


def _poses(force: FloatArray) -> FloatArray:
    """Place of each hold's pose among the named ones from 1 on; NaN between them, shape (n,)."""
    names = [nearest_pose(one, DIRECTIONS, POSE_TOLERANCE_DEG) for one in force]
    order = list(DIRECTIONS)
    return np.array([np.nan if name is None else order.index(name) + 1.0 for name in names])


def _of_rotations(measured: GyroscopeExperiment, source: IntArray) -> Iterator[Influence]:
    place = np.searchsorted(measured.rotations.usable, source)
    motion, offsets = measured.closure.motion, measured.closure.samples.offsets
    rate = np.degrees(motion.rate)
    fastest = np.maximum.reduceat(np.linalg.norm(rate, axis=1), offsets[:-1])
    mean = np.add.reduceat(rate, offsets[:-1]) / np.diff(offsets)[:, None]
    yield Influence("rate", "fastest rate, °/s", fastest[place])
    for k, axis in enumerate(AXES):
        yield Influence(f"rate-{axis}", f"mean rate about {axis}, °/s", mean[place, k])
    yield Influence("number", "number of the rotation", np.asarray(source + 1.0, np.float64))
    yield Influence("time", "time, min", motion.time[offsets[:-1]][place] / 60.0)
    yield Influence("temperature", "temperature, °C", motion.temperature[offsets[:-1]][place])
    for k, axis in enumerate(AXES):
        label = f"{axis} part of up before the rotation, g"
        yield Influence(f"up-{axis}", label, measured.closure.before[place, k])


def _beside_model(fit: SensorFit, measured: Experiment) -> Iterator[ResidualView]:
    """Measurement and model of each axis, over its own input first.

    What was read beyond the true input. The true force of a hold is gravity in the direction that
    the model finds (with a part of the base left out: that the whole base finds); at rest the true
    rate is zero. So a model of nothing is a flat line, a bias lifts it, a scale tilts it, and what
    the model lacks lies between the two signs.
    """
    source = np.arange(len(measured.circumstances))
    if isinstance(measured, AccelerometerExperiment):
        title, (read, model) = "read beyond the true force", _holds_beside(fit, measured)
        factor, unit = readable("m/s^2")
    elif isinstance(measured, MagnetometerExperiment):
        title, (read, model) = "read beyond the true field", _field_beside(fit, measured)
        factor, unit = readable("uT")
    else:
        assert isinstance(measured, GyroscopeExperiment)  # noqa: S101 (narrows the type)
        title, (read, model) = "read at rest", _stills_beside(fit, measured)
        factor, unit = readable("rad/s")
        source = measured.rest.labels.index[::3]
    for k, part in enumerate(COMPARED):
        over = list(influences(measured, part, source))
        for one in (over[k], *over[:k], *over[k + 1 :]):
            order = _in_order(one.values)
            if len(order):
                yield ResidualView(
                    _PREFIX[part] + one.name, part, f"{title}: ∘ measured, × model", one.label,
                    unit, one.values[order], read[order, k] * factor, source[order],
                    _LOOK_FOR["model"], model=model[order, k] * factor,
                )  # fmt: skip


def _holds_beside(
    fit: SensorFit, measured: AccelerometerExperiment
) -> tuple[FloatArray, FloatArray]:
    """What an accelerometer read beyond the true force, and the model's reading, m/s², (n, 3)."""
    y = np.array([hold.accelerometer for hold in measured.holds])
    where, sensor = measured.circumstances, fit
    if fit.base == BASE:
        corrected = fit.correct(y, where)
        size = np.linalg.norm(corrected, axis=1)[:, None]
        force = measured.gravity * corrected / size
        model = y - (corrected - force) @ np.linalg.inv(sensor.matrix).T
    else:
        force, model = where.force, _predicted(fit, measured, where.force)
    gain, offset = 1.0, np.zeros(3)
    if sensor.bias_unit == COUNT:
        gain = float(np.cbrt(abs(np.linalg.det(sensor.matrix))))
        offset = sensor.bias if "bias" in fit.base else y.mean(axis=0)
    return (y - offset) * gain - force, (model - offset) * gain - force


def _stills_beside(fit: SensorFit, measured: GyroscopeExperiment) -> tuple[FloatArray, FloatArray]:
    """What a gyroscope read at rest, and the model's reading, rad/s, shape (h, 3)."""
    table, sensor = _table(fit), fit
    left = table.residual[table.kind == "still"].reshape(-1, 3)
    read = measured.rest.reading
    if sensor.bias_unit == COUNT:
        offset = sensor.bias if "bias" in fit.base else read.mean(axis=0)
        read = (read - offset) * float(np.cbrt(abs(np.linalg.det(sensor.matrix))))
    return read, read - left


def _field_beside(
    fit: SensorFit, measured: MagnetometerExperiment
) -> tuple[FloatArray, FloatArray]:
    """What was read beyond the true field, and the model's reading, shape (k, 3)."""
    where, sensor = measured.circumstances, fit
    y = measured.data.pieces.mean(measured.data.pieces.reading)
    if fit.base == FIELD_BASE:
        corrected = fit.correct(y, where)
        left = _table(fit).residual[:, None]
        along = left * corrected / np.linalg.norm(corrected, axis=1)[:, None]
        field, model = corrected - along, y - along @ np.linalg.inv(sensor.matrix).T
    else:
        field, model = where.magnetic, _predicted(fit, measured, where.magnetic)
    gain = measured.data.gain if measured.unit == COUNT else 1.0
    offset = sensor.bias if measured.unit == COUNT else np.zeros(3)
    return (y - offset) * gain - field, (model - offset) * gain - field


def _predicted(fit: SensorFit, measured: Experiment, true: FloatArray) -> FloatArray:
    """The model's reading of a true input, reading unit, shape (n, 3)."""
    sensor, sizes = fit, np.concatenate([np.zeros(0), *fit.sizes])
    felt = true + Terms(sensor.sensor, fit.terms).columns(measured.circumstances) @ sizes
    return np.asarray(felt @ np.linalg.inv(sensor.matrix).T + sensor.bias)


_SUSPECT_PARTS = {
    RowKind.HOLD: (HOLDS, "m/s^2"),
    RowKind.ROTATION: (ROTATIONS, "rad"),
    RowKind.FIELD: (MAGNITUDES, "uT"),
}


def suspect_view(misfit: WhitenedResiduals, suspect: Suspect) -> ResidualView | None:
    """The added-variable plot of a suspect; None for what has no pattern.

    Residual and the pattern of the suspect's largest parameter are both freed from all that the
    model and the suspect's other parameters can absorb. What remains lies on a line through the
    origin whose slope is the parameter's size, if the suspect is right.
    """
    if suspect.candidate is None:
        return None
    candidate, place = suspect.candidate, suspect.largest
    others = np.delete(candidate.columns, place, axis=1)
    residual, pattern = freed(misfit, others, candidate.columns[:, place])
    strength = float(pattern @ pattern)
    if strength <= 0.0:
        return None
    slope = float(pattern @ residual) / strength
    # of several kinds of rows, the one in which the pattern shows most
    kind = max(
        (RowKind(int(kind)) for kind in distinct(misfit.kind)),
        key=lambda kind: float((pattern[misfit.kind == kind] ** 2).sum()),
    )
    rows = np.flatnonzero(misfit.kind == kind)
    if kind == RowKind.STILL:
        axis = max(range(3), key=lambda k: float((pattern[misfit.axis == k] ** 2).sum()))
        rows, part, unit = rows[misfit.axis[rows] == axis], STILL[axis], "rad/s"
    else:
        part, unit = _SUSPECT_PARTS[kind]
    factor, shown = readable(unit)
    x, y = (values[rows] * misfit.sigma[rows] * factor for values in (pattern, residual))
    order = np.argsort(x, kind="stable")
    name = f"{suspect.term} {candidate.names[place]}"
    size = with_unit(number(slope), candidate.unit)
    return ResidualView(
        name=f"suspect-{suspect.term}",
        part=part,
        title=f"does {name} explain it? It would be {size}",
        x_label=f"what {with_unit('1', candidate.unit)} of {name} would leave here, {shown}",
        unit=shown,
        x=x[order],
        y=y[order],
        source=misfit.source[rows][order],
        look_for=_LOOK_FOR["suspect"],
        error=factor * misfit.sigma[rows][order],
        slope=slope,
    )


def freed(
    misfit: WhitenedResiduals, others: FloatArray, pattern: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Residual and pattern without what the base and other columns absorb, whitened, (n,) each."""
    base = np.concatenate([misfit.base, others], axis=1)
    length = np.linalg.norm(base, axis=0)
    across = complement(base[:, length > 0.0] / length[length > 0.0])
    return across @ (across.T @ misfit.residual), across @ (across.T @ pattern)


@dataclass(frozen=True, eq=False)
class Point:
    """What a point of a picture was measured from.

    Attributes:
        name: ``hold 7, +x up``, ``rotation 3 about x``, ``field along +x−y``.
        time: since the session's first sample, s.
        reading: mean reading; of a rotation the fastest rate, °/s; shape (3,).
        unit: of the reading.
        start: when its samples begin, s in the recording's own time; NaN where that is not known.
        end: when they end.
        at_rest: its samples were averaged at rest.
    """

    name: str
    time: float
    reading: FloatArray
    unit: str
    start: float
    end: float
    at_rest: bool


def point_of(fit: SensorFit, report: FitReport | None, view: ResidualView, place: int) -> Point:
    """What the point at this place of a picture was measured from.

    Args:
        fit: the sensor's fit.
        report: the fit of the recording: when its holds and rotations were.
        view: the picture.
        place: of the point in it.
    """
    index, unknown = int(view.source[place]), (np.nan, np.nan)
    measured, table = fit.experiment, fit.rows
    assert measured is not None and table is not None  # noqa: S101, PT018 (narrows the types)
    where, row = measured.circumstances, index
    if isinstance(measured, MagnetometerExperiment):
        pieces = measured.data.pieces
        time, name = float(where.time[index]), place_of(table, index)
        first, past = pieces.offsets[index : index + 2]
        span = float(pieces.time[first]), float(pieces.time[past - 1])
        return Point(
            name, time, pieces.mean(pieces.reading)[index], measured.unit, *span, at_rest=False
        )
    if isinstance(measured, GyroscopeExperiment) and view.part in (ROTATIONS, HEADINGS):
        turned = int(np.searchsorted(measured.rotations.usable, index))
        first, past = measured.closure.samples.offsets[turned : turned + 2]
        rate = np.degrees(measured.closure.motion.rate[first:past])
        fastest = rate[np.argmax(np.linalg.norm(rate, axis=1))]
        name, during = f"rotation {index + 1}", measured.closure.samples.time
        if report is not None and index < len(report.rotations) and report.rotations[index].axis:
            name += f" about {report.rotations[index].axis}"
        span = float(during[first]), float(during[past - 1])
        time = float(measured.closure.motion.time[first])
        return Point(name, time, fastest, "deg/s", *span, at_rest=False)
    if isinstance(measured, GyroscopeExperiment):
        row = int(np.searchsorted(measured.rest.labels.index[::3], index))
        reading = measured.rest.reading[row]
    else:
        assert isinstance(measured, AccelerometerExperiment)  # noqa: S101 (narrows the type)
        reading = measured.holds[index].accelerometer
    pose = nearest_pose(where.force[row], DIRECTIONS, POSE_TOLERANCE_DEG)
    name = f"hold {index + 1}, {true_minus(pose) + ' up' if pose else 'between poses'}"
    hold = None if report is None else report.holds[index]
    name += ", hand-held" if hold is not None and hold.hand_held else ""
    span = unknown if hold is None else (hold.start, hold.end)
    return Point(name, float(where.time[row]), reading, measured.unit, *span, at_rest=True)


def rotation_series(measured: Experiment, point: Point) -> Series | None:
    """The readings of a rotation, which are kept with the fit's data; None for another point."""
    if point.at_rest or not isinstance(measured, GyroscopeExperiment):
        return None
    samples = measured.closure.samples
    series = Series(samples.time, samples.reading, measured.unit)
    found = series.between(point.start, point.end + 1e-9)
    return found if len(found) > 1 else None
