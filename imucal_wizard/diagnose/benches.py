"""The benches of one session and their order: the accelerometer must be complete first.

Gravity as measured by the accelerometer is the gyroscope's reference. A second-order term of 3
mg/g² left out of the accelerometer tilts that reference by 0.07°, twice the noise of a rotation,
and the error would be attributed to the gyroscope. A magnetometer's magnitudes need no reference;
only its dip does.
"""

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import replace

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.notices import not_calibrated
from imucal_wizard.core.readings import Readings
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.floors import Rounding, rounding_of, rounding_while_turning
from imucal_wizard.diagnose.referee import Referee
from imucal_wizard.diagnose.verdict import Terms, Verdict
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.methods import methods_of
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE, MAGNETOMETER, SENSORS, Effect


class Benches:
    """A bench for each sensor of a session.

    The first rung of a bench is the sensor's fit in the report: there is no other one.

    Args:
        report: the fit of a recording, or of what the wizard has collected.
        readings: the recording, where there is one: the session's beginning, temperature,
            vibration, and the step of the readings.
        base: terms of the base model by sensor; all of them where none are given.
        own: effects of the user's own.
        before: the benches of the same session with less data; the models found there are kept.

    Raises:
        DataError: nothing is fitted.
    """

    def __init__(
        self,
        report: FitReport,
        readings: Readings | None = None,
        base: Mapping[str, Sequence[str]] | None = None,
        own: Sequence[Effect] = (),
        before: "Benches | None" = None,
    ) -> None:
        if not report.sensors:
            raise DataError("there is no fitted sensor to go on from")
        self.report = report
        self.readings = readings
        self._base: Mapping[str, Sequence[str]] = (base or {}) if before is None else before._base
        self._own: tuple[Effect, ...] = tuple(own) if before is None else before._own
        self._benches: dict[str, Bench] = {} if before is None else dict(before._benches)
        self._made: dict[str, SensorFit | None] = {}
        """The accelerometer's fit under which each bench here was made."""

    def copied(self) -> "Benches":
        """Other benches with the same models, on which something can be tried."""
        other = copy(self)
        other._benches = {sensor: bench.copied() for sensor, bench in self._benches.items()}
        other._made = dict(self._made)
        for bench in other._benches.values():
            bench.referee = other._referee if bench.referee is not None else None
        return other

    @property
    def accelerometer(self) -> Bench:
        """The accelerometer's bench.

        Raises:
            DataError: it is not calibrated.
        """
        bench = self.bench(ACCELEROMETER)
        if bench is None:
            raise DataError("the accelerometer is not calibrated")
        return bench

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensors that have a bench."""
        return tuple(name for name in SENSORS if name in self.report.sensors)

    @property
    def opened(self) -> dict[str, Bench]:
        """The benches that have been opened."""
        return dict(self._benches)

    @property
    def models(self) -> dict[str, tuple[str, ...]]:
        """The present model of each sensor whose bench has been opened."""
        return {name: bench.fit.model for name, bench in self.opened.items()}

    def changed(self, since: Mapping[str, Sequence[str]]) -> list[str]:
        """The models that differ from earlier ones, in words.

        Args:
            since: earlier models by sensor; the first one of its bench where none is given.
        """
        words = []
        for name, bench in self.opened.items():
            model, base = bench.fit.model, bench.ladder[0].model
            if tuple(since.get(name, base)) != model:
                added = [f" + {term}" for term in model if term not in base]
                without = [f" − {term}" for term in base if term not in model]
                words.append(name + ("".join(added + without) or " as it was at first"))
        return words

    @property
    def passed(self) -> bool:
        """Whether the data determine the accelerometer's model, and it leaves only noise."""
        bench = self.bench(ACCELEROMETER)
        if bench is None:
            return False
        return bench.look().opinion.verdict is Verdict.COMPLETE and not bench.undetermined

    def bench(self, sensor: str) -> Bench | None:
        """The bench of a sensor, or None where it has none.

        When the accelerometer's model changes, a sensor whose reference it is is measured anew
        against it and keeps the effects it has been given.

        Raises:
            DataError: the data do not determine its base model.
        """
        if sensor not in self.report.sensors:
            return None
        fit = self.report.sensors[sensor]
        under = None
        if sensor != SENSORS[0] and SENSORS[0] in self.report.sensors:
            under = self.accelerometer.fit
        if self._made.get(sensor, ...) is not under:
            reference = None if under is None else under.reference
            measured = self._experiment(sensor).under(reference, self.readings)
            base = self._base.get(sensor)
            same = fit.method not in methods_of(sensor) and fit.experiment is measured
            same = same and fit.rows is not None
            same = same and (base is None or tuple(base) == fit.base)
            rounding = self._rounding(sensor)
            bench = Bench(sensor, measured, base, self._own, rounding, fit if same else None)
            if bench.fit.reference is not None:
                bench.referee = self._referee
            before = self._benches.get(sensor)
            # known before its changes are made: the gyroscope, which is asked of them, rests on it
            self._benches[sensor], self._made[sensor] = bench, under
            if before is not None:
                bench.retrace(before.changes, before.catalogue)
        return self._benches[sensor]

    def _experiment(self, sensor: str) -> Experiment:
        """The rows behind a sensor's fit.

        Raises:
            DataError: there are none.
        """
        fit = self.report.sensors[sensor]
        if fit.experiment is None:
            raise DataError(f"the method {fit.method} has no rows to judge the {sensor} by")
        return fit.experiment

    def _referee(self) -> Referee | None:
        """The gyroscope under the accelerometer's present model, where it may judge others."""
        try:
            bench = self.bench(GYROSCOPE)
        except DataError:
            return None
        if bench is None or bench.undetermined or bench.fit.minimum is None:
            return None
        return Referee(bench.look().misfit)

    def hidden_in_reference(self, bench: Bench) -> Terms:
        """Effects of a complete accelerometer each of which alone explains another sensor's misfit.

        Its own data hardly show them, but they tilt gravity. Empty for sensors whose rows do not
        judge that, and where none does.
        """
        if bench is not self._benches.get(GYROSCOPE) or not self.passed:
            return ()
        heard = self.accelerometer.heard_of_each()
        return () if heard is None else tuple(one for (one,) in heard.enough)

    def waits(self, sensor: str) -> bool:
        """Whether the accelerometer's model must be complete before this sensor's can be judged.

        What that model lacks may be all that speaks against this one.
        """
        measured = self._experiment(sensor)
        if not any(one.needs_reference for one in measured.sources) or self.passed:
            return False
        bench = None if measured.needs_reference else self.bench(sensor)
        return bench is None or bench.look().rejected_by_reference

    def fitted(self) -> FitReport:
        """The report with the benches' fits: of models with effects, and against their reference.

        Effects added to the accelerometer change the gravity that the other sensors are fitted to.
        One that cannot be fitted to it has no fit in the report, and a warning says why.
        """
        moved = ACCELEROMETER in self._benches and bool(self.accelerometer.fit.terms)
        sensors, warnings = dict(self.report.sensors), list(self.report.warnings)
        for name, before in self.report.sensors.items():
            follows = moved and before.rows is not None  # a paper's method has its own reference
            if before.experiment is None or not (follows or name in self._benches):
                continue
            try:
                bench = self.bench(name)
            except DataError as error:
                del sensors[name]
                warnings.append(not_calibrated(name, error))
                continue
            if bench is None:
                continue
            smaller = bench.fit.base != bench.whole
            moved_too = follows and bench.measured is not before.experiment
            if bench.fit.terms or smaller or moved_too:
                fitted = replace(bench.fit, warnings=before.warnings)
                sensors[name] = bench.measured.validated(fitted, self.report.validation)
        report = replace(self.report, sensors=sensors, warnings=tuple(warnings))
        aligned = MAGNETOMETER in sensors
        return report if aligned else replace(report, magnetic=None, second_stage=None)

    def _rounding(self, sensor: str) -> Rounding | None:
        readings = self.readings
        series = None if readings is None else getattr(readings, sensor)
        matrix = self.report.sensors[sensor].matrix
        if series is not None and not self._experiment(sensor).at_rest:
            return rounding_while_turning(series, matrix)
        return rounding_of(series, self.report.holds, float(np.linalg.norm(matrix, ord=2)))
