"""The gyroscope on a rate table or turntable: steps of known rate, turns of known angle.

The rate or angle of the table is known; the axis in the device is not. Each step is therefore one
row, ``|∫ M (y − b) dt| = θ`` (``model.rows.known_rotation``), beside the rates at rest. These rows
do not change if M is multiplied from the left by a rotation or a reflection. Without other rows, M
is upper triangular: the frame is the gyroscope's own, right-handed; its x axis alone reads a rate
about x, its x and y axes one about y. M then gives the scale of each axis and the angles between
the axes, but not how the axes lie in the housing or relative to the accelerometer. With rotations
between rests, which close against gravity, all nine gains are determined in the accelerometer's
frame.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, cast

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.notices import NoticeKind, not_calibrated
from imucal_wizard.core.quantities import quantity
from imucal_wizard.core.readings import FloatArray, IntArray, Readings, Series, distinct
from imucal_wizard.core.units import COUNT, SI_UNIT
from imucal_wizard.estimate.accelerometer import BASE, ENTRY_OF
from imucal_wizard.estimate.experiment import Beside, Directions, Experiment
from imucal_wizard.estimate.fit import Minimum, minimum, report
from imucal_wizard.estimate.fit_warnings import scale_notes
from imucal_wizard.estimate.gyroscope import (
    MIN_REST_NOISE,
    GyroscopeExperiment,
    Movable,
    in_session_by_rests,
)
from imucal_wizard.estimate.gyroscope_fit import (
    determined_entries,
    of_determined,
)
from imucal_wizard.estimate.gyroscope_report import noise_notes
from imucal_wizard.estimate.noise import rest_of
from imucal_wizard.estimate.parameters import (
    nominal_angle,
    triangular_parameters,
    unit_of,
)
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.estimate.rounded import rate_shift
from imucal_wizard.estimate.slow_noise import spans_of
from imucal_wizard.estimate.slow_rests import long_rest
from imucal_wizard.estimate.table_rows import (
    circumstances_during,
    known_rotations,
)
from imucal_wizard.estimate.table_steps import (
    KnownRates,
    TableData,
    assign_rates,
    same_assignment,
    starting_points,
    why_no_match,
)
from imucal_wizard.estimate.variance_components import determined
from imucal_wizard.measurement.constant_rates import constant_rates
from imucal_wizard.measurement.rounding import resolution_of
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE, SENSORS
from imucal_wizard.model.effects.earth_rate import EARTH_RATE
from imucal_wizard.model.nominal_gains import Nominal, datasheet_precision
from imucal_wizard.model.rows.rate_at_rest import RateAtRest
from imucal_wizard.model.rows.source import BIAS, ENTRIES, Parameters, RowLabels

if TYPE_CHECKING:  # that module imports this one where there is a table
    from imucal_wizard.estimate.recording import FitOptions

ENTRY_NAMES = {
    0: "sensitivity_x",
    1: "theta_yz",
    2: "theta_zy",
    4: "sensitivity_y",
    5: "theta_zx",
    8: "sensitivity_z",
    9: "bias_x",
    10: "bias_y",
    11: "bias_z",
}
"""Parameter of each free entry of a triangular M and of b."""
MAX_ASSIGNMENTS = 6
"""Fits after which the assignment of steps to rates no longer changes."""


class RateTableExperiment(Movable):
    """Steps of known rate, turns of known angle and rests of a gyroscope, in its own frame.

    Args:
        data: what was measured.
        unit: of the readings, ``rad/s`` or ``count``.
        start: matrix and bias to begin from.
        free: which of the twelve entries are fitted, of a triangular M.
        series: all readings of the gyroscope.
        readings: the recording, for temperature and force; None where it is not at hand.
        force: from mean readings of the accelerometer to specific force; None where it is unknown.
    """

    sensor, error_unit, frame, method = GYROSCOPE, "rad", "own", "rate table"
    base_terms, at_rest = BASE, False
    gravity, guided = 0.0, False

    def __init__(
        self,
        data: TableData,
        unit: str,
        start: Parameters,
        free: Sequence[int],
        series: Series,
        readings: Readings | None = None,
        force: Parameters | None = None,
    ) -> None:
        self.data = self.on_table = data
        self.unit, self.free, self.series = unit, tuple(free), series
        self._start, self.readings, self.force = start, readings, force
        self.nominal = Nominal(known=unit != COUNT)
        self.table = known_rotations(data, series, start, readings, force, judged=True)
        self.circumstances = self.table.circumstances
        self.sources = (self.table,)
        if data.rests:
            self.rest = self._rests()
            where, of_table = self.rest.circumstances, self.table.circumstances
            self.circumstances = where.joined(of_table)
            own = replace(
                of_table,
                reference_time=where.reference_time,
                reference_temperature=where.reference_temperature,
            )
            self.table = replace(self.table, circumstances=own)  # one reference in all rows
            self.sources = (self.rest, self.table)

    def _rests(self) -> RateAtRest:
        rests, matrix = self.data.rests, self._start.matrix
        shift = rate_shift(rests, resolution_of(self.series.values))
        noise, number = rest_of(rests, matrix).mean, np.arange(len(rests))
        span = spans_of(rests)
        where = circumstances_during(span, self.series, self.readings, self.force)
        return RateAtRest(
            reading=np.array([hold.gyroscope for hold in rests]),
            noise=np.maximum(noise, MIN_REST_NOISE**2),
            circumstances=where,
            labels=RowLabels(
                index=np.repeat(number, 3),
                axis=np.tile([0, 1, 2], len(rests)),
                group=np.repeat(self._mountings(span), 3),
                visit=np.repeat(number, 3),
                time=np.repeat(where.time, 3),
                span=np.repeat(span, 3, axis=0),
                component=np.tile([0, 1, 2], len(rests)),
            ),
            rounding=shift if (shift > 0.01 * noise.mean()).any() else np.zeros(3),
            group_word=self.table.group_word,
        )

    def _mountings(self, spans: FloatArray) -> IntArray:
        """Mounting of each rest, that of the nearest step; −1 if all rests have the same one."""
        middle, steps = spans.mean(axis=1), self.table.labels.span.mean(axis=1)
        nearest = np.abs(middle[:, None] - steps).argmin(axis=1)
        found = self.table.labels.group[nearest]
        return found if len(distinct(found)) > 1 else np.full(len(found), -1)

    def moved(self, start: Parameters, free: Sequence[int]) -> "RateTableExperiment":
        """The same experiment from another start, with other entries determined."""
        args = self.series, self.readings, self.force
        return RateTableExperiment(self.data, self.unit, start, free, *args)

    def under(self, reference: object, readings: Readings | None) -> "RateTableExperiment":
        """See ``Experiment``: these rows need no gravity."""
        del reference, readings
        return self

    def directions(self, base: Sequence[str]) -> Directions:
        """See ``Experiment``."""
        wanted = set(range(BIAS.start, ENTRIES)) if "bias" in base else set()
        wanted |= set(self.nominal.scales) if "scale" in base else set()
        wanted |= {1, 2, 5} if "non-orthogonality" in base else set()
        free = [entry for entry in self.free if entry in wanted]
        columns = np.zeros((ENTRIES, len(free)))
        columns[free, range(len(free))] = 1.0
        dropped = tuple(ENTRY_NAMES[entry] for entry in ENTRY_OF if entry not in free)
        missing = [ENTRY_NAMES[entry] for entry in ENTRY_OF if entry not in self.free]
        reason = ""
        if missing and set(base) == set(BASE):
            reason = (
                f"these mountings do not determine {', '.join(missing)}: nominal values are used. "
                "Mount the device with each face and with each edge between two faces along the "
                "table's axis"
            )
        return Directions(
            columns, tuple(ENTRY_NAMES[entry] for entry in free), tuple(base), dropped, reason
        )

    def begin(self, base: Sequence[str]) -> Parameters:
        """See ``Experiment``."""
        free = np.flatnonzero(self.directions(base).columns.any(axis=1)).tolist()
        matrix = self.nominal.filled(self._start.matrix, free)
        if self.unit == COUNT:
            size = float(np.cbrt(abs(np.linalg.det(self._start.matrix))))
            fixed = [entry for entry in self.nominal.scales if entry not in free]
            matrix.flat[fixed] = size
        bias = self._start.bias if "bias" in base else self.before().bias
        return self.constrained(Parameters(matrix, bias), base)

    def before(self) -> Parameters:
        """See ``Experiment``: of counts, one common scale and the bias found first."""
        if self.unit != COUNT:
            return Parameters(np.eye(3), np.zeros(3))
        size = float(np.cbrt(abs(np.linalg.det(self._start.matrix))))
        return Parameters(size * np.eye(3), self.data.start.bias)

    def constrained(self, calibration: Parameters, base: Sequence[str]) -> Parameters:
        """See ``Experiment``: M_xz where its angle is nominal."""
        if "non-orthogonality" not in base or 2 in self.free:
            return calibration
        return replace(calibration, matrix=nominal_angle(calibration.matrix))

    def named(self, matrix: FloatArray, bias: FloatArray) -> dict[str, float]:
        """See ``Experiment``."""
        return triangular_parameters(matrix, bias)

    def unit_of(self, name: str) -> str:
        """See ``Experiment``."""
        return unit_of(name, self.unit, SI_UNIT[GYROSCOPE])

    def in_session(self, found: Minimum[Experiment]) -> FloatArray | None:
        """See ``Experiment``."""
        rests = self.data.rests
        if not rests:
            return None
        longest = long_rest(self.series, rests, self._start.matrix)
        return in_session_by_rests(found, rests, longest)

    def left_nominal(self, found: Minimum[Experiment]) -> FloatArray:
        """See ``Experiment``: gains that the mountings do not determine."""
        left = [entry for entry in ENTRY_OF if entry < BIAS.start and entry not in self.free]
        usual = datasheet_precision(self.nominal, found.calibration.matrix)[left] ** -0.5
        return np.eye(ENTRIES)[:, left] * usual

    def beside(self, found: SensorFit) -> Beside:
        """See ``Experiment``."""
        table = self.table
        read = table.means(table.reading)
        rates = table.means(found.correct(table.reading, table.circumstances))
        true = table.rate[:, None] * unit_vectors(rates)
        model = read - (rates - true) @ np.linalg.inv(found.matrix).T
        gain, offset = 1.0, np.zeros(3)
        if self.unit == COUNT:
            gain = float(np.cbrt(abs(np.linalg.det(found.matrix))))
            offset = found.bias if "bias" in found.base else self.before().bias
        read, model = ((one - offset) * gain - true for one in (read, model))
        rows = np.arange(len(read))
        return Beside("read beyond the rate of the table", "rad/s", read, model, table, rows)


def find_table(series: Series, given: KnownRates) -> TableData:
    """The steps, turns and rests in a gyroscope's readings.

    Args:
        series: readings of the gyroscope.
        given: what the table did.

    Raises:
        DataError: nothing in the recording has the listed rates or angles.
    """
    holds = constant_rates(series)
    starts = list(starting_points(holds, series, given)) if holds else []
    if not starts:
        shown = "reads only one steady rate" if holds else "is never steady for a second"
        raise DataError(
            f"the gyroscope {shown}: let the table rest, and let it rotate at each rate for some "
            "seconds"
        )
    found = min(
        (assign_rates(holds, series, given, start, calibrated=False) for start in starts),
        key=lambda one: (len(one.left_out), -len(one.rests), -len(one.turned), one.misfit),
    )
    for _ in range(MAX_ASSIGNMENTS):
        if len(found.turned) < 2 or len(found.left_out) >= len(found.turned):
            raise DataError(why_no_match(found, given, series.unit))
        before, start = found, _first_fit(found, series).calibration
        found = assign_rates(holds, series, given, start, calibrated=True)
        if same_assignment(found, before):
            break
    return found


def _first_fit(
    data: TableData,
    series: Series,
    readings: Readings | None = None,
    force: Parameters | None = None,
) -> Minimum[RateTableExperiment]:
    """A fit with priors from data sheets, for which the mountings need not determine everything."""
    rough = RateTableExperiment(data, series.unit, data.start, ENTRY_OF, series, readings, force)
    precision = datasheet_precision(rough.nominal, data.start.matrix)[list(ENTRY_OF)]
    return minimum(rough, directions=replace(rough.directions(BASE), precision=precision))


def fit_rate_table(
    data: TableData,
    series: Series,
    readings: Readings | None = None,
    force: Parameters | None = None,
) -> SensorFit:
    """The gyroscope by the table alone, in its own frame.

    Args:
        data: steps, turns and rests.
        series: all readings of the gyroscope.
        readings: the recording.
        force: calibration of its accelerometer.

    Raises:
        DataError: they do not determine a calibration.
    """
    first = _first_fit(data, series, readings, force)
    found = of_determined(first, first.experiment.nominal)
    normal = found.system.columns.T @ (found.system.columns / found.balance.variance[:, None])
    if not determined(normal + np.diag(found.system.precision)):
        raise DataError(
            "these steps do not determine the gyroscope's biases: record the table at rest, too, "
            "or turn it in both senses in each mounting"
        )
    fit = report(found)
    return replace(fit, warnings=(*fit.warnings, *_earth_notes(fit)))


def _earth_notes(fit: SensorFit) -> list[str]:
    """That the biases contain the Earth's rate, where they are known better than that.

    How the table's axis lies on the Earth, and where the table stops, is not known.
    """
    if fit.covariance is None or "bias" not in fit.base:
        return []
    by_bias = fit.matrix @ fit.covariance[BIAS, BIAS] @ fit.matrix.T
    if np.sqrt(np.diag(by_bias)).min() >= EARTH_RATE:
        return []
    rate = quantity(EARTH_RATE, "rad/s", 2)
    return [
        f"a rate table's fit takes the Earth's rate for zero: the biases contain up to {rate} of it"
    ]


def with_rate_table(
    experiment: GyroscopeExperiment,
    data: TableData,
    series: Series,
    force: Parameters | None,
) -> SensorFit | None:
    """The gyroscope by closures and table together, in the accelerometer's frame.

    Args:
        experiment: rests and closures.
        data: steps and turns.
        series: all readings of the gyroscope.
        force: calibration of the accelerometer.

    Returns:
        None if the closures do not show how the gyroscope lies relative to the accelerometer.
    """
    every = tuple(range(ENTRIES))
    start = experiment.begin(BASE)
    table = known_rotations(data, series, start, experiment.readings, force, judged=False)
    both = experiment.with_rows(experiment.rotations, [table], every)
    whole = both.directions(BASE)
    precision = datasheet_precision(both.nominal, start.matrix)
    found = minimum(both, directions=replace(whole, precision=precision))
    if determined_entries(found, both.nominal, every) != every:
        return None
    both.method = "vector + table"
    together = report(minimum(both.moved(found.calibration, every)))
    return replace(together, warnings=(*together.warnings, *noise_notes(both)))


def fit_with_table(
    readings: Readings,
    options: "FitOptions",
    fit_without: "Callable[[Readings, FitOptions], FitReport]",
) -> FitReport:
    """Fit a recording on a rate table: the gyroscope by the table, the other sensors without it.

    If rotations between rests show how the gyroscope lies relative to the accelerometer, they and
    the table are fitted together, in the accelerometer's frame; else, or where this fails, the
    table alone.

    Args:
        readings: of all sensors; the accelerometer may have no samples.
        options: with the rates or angles of the table.
        fit_without: fits a recording without a table.

    Raises:
        DataError: the table's part does not determine a calibration.
    """
    series = readings.gyroscope
    if series is None or not len(series):
        raise DataError("the recording has no gyroscope, which a rate table calibrates")
    data = find_table(series, KnownRates(options.rates, options.turns))
    other = replace(options, rates=(), turns=(), left_out=tuple(data.steady))
    rates = {GYROSCOPE: series.rate}
    try:
        report = fit_without(readings, other)
    except DataError as error:
        notes = readings.warnings
        if len(readings):
            notes = (*notes, not_calibrated("accelerometer", error))
        report = FitReport(options.gravity, rates, (), (), {}, warnings=notes)
    force = _force_of(report, readings)
    gyroscope = report.sensors.get(GYROSCOPE)
    found, apart = None, list[str]()
    if gyroscope is not None and gyroscope.experiment is not None:
        closures = cast("GyroscopeExperiment", gyroscope.experiment)
        try:
            found = with_rate_table(closures, data, series, force)
        except DataError as error:
            apart = [
                f"the rotations do not fit together with the table, which is used alone: {error}"
            ]
    # what was said of the fit without the table, which is not the result
    replaced: set[str] = set(report.warned(GYROSCOPE, NoticeKind.NOT_CALIBRATED))
    if gyroscope is not None:
        replaced.update(gyroscope.warnings)
    notes = tuple(text for text in report.warnings if text not in replaced)
    odd = dict(report.outlier_notes)
    if found is None:
        found = fit_rate_table(data, series, readings, force)
        odd.pop(GYROSCOPE, None)
    wrong: list[str] = []
    if series.unit != COUNT:
        wrong = scale_notes(float(np.linalg.norm(found.matrix) / np.sqrt(3.0)), 0.0)
    sensors = {**report.sensors, GYROSCOPE: found}
    return replace(
        report,
        rates={**report.rates, **rates},
        sensors={name: sensors[name] for name in SENSORS if name in sensors},
        warnings=(*notes, *apart, *wrong, *found.warnings, *_table_notes(data)),
        outlier_notes=odd,
    )


def _force_of(report: FitReport, readings: Readings) -> Parameters | None:
    """The accelerometer's calibration; the nominal one if only its unit is known."""
    fit = report.sensors.get(ACCELEROMETER)
    if fit is not None:
        return Parameters(fit.matrix, fit.bias)
    known = len(readings) and readings.accelerometer.unit != COUNT
    return Parameters(np.eye(3), np.zeros(3)) if known else None


def _table_notes(data: TableData) -> list[str]:
    """A note about steady stretches at none of the listed rates."""
    if not data.left_out:
        return []
    places = ", ".join(
        f"{quantity(rate, 'rad/s', 3)} at {start:.0f} s" for start, rate in data.left_out[:3]
    )
    count = len(data.left_out)
    more = f" and {count - 3} more" if count > 3 else ""
    return [f"not used, since none of the listed rates fits: {places}{more}"]
