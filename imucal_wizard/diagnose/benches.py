"""The benches of one session, and the order among them: the accelerometer must pass first.

Gravity, as the accelerometer sees it, is the gyroscope's reference. A second-order term of 3 mg/g²
left out of the accelerometer tilts that reference by 0.07°, twice the noise of a rotation, and the
gyroscope would be blamed for it. Of the magnetometer's rows only the dip rests on gravity; it is
not looked at before.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import Readings
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.floors import Rounding, rounding_of, rounding_while_turning
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.accelerometer import AccelerometerExperiment, accelerometer_experiment
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment, gyroscope_experiment
from imucal_wizard.estimate.magnetometer.body_frame import in_body_frame
from imucal_wizard.estimate.magnetometer.experiment import MagnetometerExperiment
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.measurement.holds import Hold
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    GYROSCOPE,
    MAGNETOMETER,
    Circumstances,
    Effect,
)
from imucal_wizard.model.effects.misalignment import Misalignment

ALIGNED = Misalignment.name


class Benches:
    """A bench for each sensor of a session.

    Args:
        report: the plain fit of a recording, or of what the wizard has collected.
        readings: the recording, where there is one: the session's beginning, temperature,
            vibration, and the step of the readings.
        base: terms of the base model by sensor; all of them where none are given.
        own: effects of the user's own.
        before: the benches of the same session with less data; the models found there are kept.

    Raises:
        DataError: the holds do not carry the accelerometer's base model, or nothing is fitted.
    """

    def __init__(
        self,
        report: FitReport,
        readings: Readings | None = None,
        base: Mapping[str, Sequence[str]] | None = None,
        own: Sequence[Effect] = (),
        before: "Benches | None" = None,
    ) -> None:
        self.report = report
        self.readings = readings
        self._base: Mapping[str, Sequence[str]] = (base or {}) if before is None else before._base
        self._own: tuple[Effect, ...] = tuple(own) if before is None else before._own
        self._accelerometer = self._first(before)
        self._gyroscope: Bench | None = None if before is None else before._gyroscope
        self._magnetometer: Bench | None = None if before is None else before._magnetometer
        self._under: dict[str, SensorFit | None] = {}

    def _first(self, before: "Benches | None") -> Bench | None:
        """The accelerometer's bench; a recording in which a device only tumbles has none."""
        if ACCELEROMETER not in self.report.sensors and self._has_field:
            return None
        fit = self.report.sensors.get(ACCELEROMETER)
        if fit is None:
            raise DataError("there is no fitted accelerometer to go on from")
        known_experiment, holds = fit.experiment, self.report.holds
        if (
            isinstance(known_experiment, AccelerometerExperiment)
            and known_experiment.readings is self.readings
            and _same_means(known_experiment.holds, holds)
        ):
            measured = known_experiment
        else:
            gravity = self.report.gravity
            measured = accelerometer_experiment(holds, gravity, fit.bias_unit, self.readings)
        known = None if before is None else before._accelerometer
        return self._renewed(ACCELEROMETER, measured, known)

    @property
    def accelerometer(self) -> Bench:
        """The accelerometer's bench.

        Raises:
            DataError: it is not calibrated.
        """
        if self._accelerometer is None:
            raise DataError("the accelerometer is not calibrated")
        return self._accelerometer

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensors that have a bench."""
        inertial = tuple(n for n in (ACCELEROMETER, GYROSCOPE) if n in self.report.sensors)
        return (*inertial, MAGNETOMETER) if self._has_field else inertial

    @property
    def _has_field(self) -> bool:
        readings = self.readings
        there = readings is not None and readings.magnetometer is not None
        return there and self.report.magnetic is not None

    @property
    def passed(self) -> bool:
        """Whether the data carry the accelerometer's model, and it leaves only noise."""
        if self._accelerometer is None:
            return False
        complete = self.accelerometer.look().opinion.verdict is Verdict.COMPLETE
        return complete and not self.accelerometer.undetermined

    @property
    def gyroscope(self) -> Bench | None:
        """The gyroscope's bench on the accelerometer as it is modelled now; None without one.

        When the accelerometer's model changes, the gyroscope is measured anew against it and keeps
        the effects it has been given.

        Raises:
            DataError: the rotations do not carry its base model.
        """
        if GYROSCOPE not in self.report.sensors:
            return None
        under = self.accelerometer.fit
        if self._gyroscope is None or self._under.get(GYROSCOPE) is not under:
            measured = self._rotations_under(under)
            self._gyroscope = self._renewed(GYROSCOPE, measured, self._gyroscope)
            self._under[GYROSCOPE] = under
        return self._gyroscope

    def _rotations_under(self, accelerometer: SensorFit) -> GyroscopeExperiment:
        """The rotations, with gravity as this fit of the accelerometer sees it."""
        fit = self.report.sensors[GYROSCOPE]
        known = fit.experiment
        if not isinstance(known, GyroscopeExperiment):
            holds, rotations = self.report.holds, self.report.rotations
            unit, readings = fit.bias_unit, self.readings
            return gyroscope_experiment(holds, rotations, accelerometer, unit, readings)
        if known.readings is self.readings and known.of is accelerometer.reference:
            return known
        if accelerometer.reference is None:
            raise DataError("there is no fitted accelerometer to go on from")
        return known.under(accelerometer.reference, self.readings)

    @property
    def magnetometer(self) -> Bench | None:
        """The magnetometer's bench, with the dip once the accelerometer has passed.

        Raises:
            DataError: its samples do not carry its base model.
        """
        if self.readings is None or not self._has_field:
            return None
        under = self.accelerometer.fit if self.passed else None
        if self._magnetometer is None or self._under.get(MAGNETOMETER, ...) is not under:
            report, readings = self.report, self.readings
            assert report.magnetic is not None  # noqa: S101 (narrows the type)
            up = None if under is None else under.reference
            measured = report.magnetic.experiment(readings, report.holds, up, report.second_stage)
            self._magnetometer = self._renewed(MAGNETOMETER, measured, self._magnetometer)
            self._begin_aligned(self._magnetometer)
            self._under[MAGNETOMETER] = under
        return self._magnetometer

    def _begin_aligned(self, bench: Bench) -> None:
        """Put into the model the misalignment that the plain fit has: it is not missing there.

        It stays a suspect where data held out do not confirm it, or the still poses do not carry it
        with the magnitudes. What the user has taken out stays out.
        """
        fitted = ALIGNED in self.report.sensors[MAGNETOMETER].model
        known = any(ALIGNED in rung.model for rung in bench.ladder)
        if not fitted or known or bench.fit.base != bench.whole:
            return
        with suppress(DataError):
            bench.add(ALIGNED)
            if not bench.confirmed():
                bench.undo()

    def waits(self, sensor: str) -> bool:
        """Whether the accelerometer's model must be complete before this sensor's can be judged."""
        return sensor == GYROSCOPE and not self.passed

    def models(self) -> dict[str, tuple[SensorFit, Circumstances]]:
        """Models with effects that the plain fit lacks, with the circumstances of their data.

        The magnetometer's is in the accelerometer's frame where that is known.
        """
        gyroscope = None if self._gyroscope is None else self.gyroscope
        magnetometer = None if self._magnetometer is None else self.magnetometer
        return {
            bench.sensor: (self._usable(bench), bench.measured.circumstances)
            for bench in (self._accelerometer, gyroscope, magnetometer)
            if bench is not None and self.found(bench.sensor)
        }

    def found(self, sensor: str) -> tuple[str, ...]:
        """Effects in the model of a sensor that its plain fit lacks; its mounting may be one."""
        bench = self.bench(sensor)
        if bench is None:
            return ()
        fitted = self.report.sensors[sensor].model
        return tuple(term.name for term in bench.fit.terms if term.name not in fitted)

    def _usable(self, bench: Bench) -> SensorFit:
        if not isinstance(bench.measured, MagnetometerExperiment):
            return bench.fit
        stage = self.report.second_stage
        rotation = None if stage is None else stage.alignment.rotation
        return in_body_frame(bench.fit, bench.measured.data, rotation)

    def bench(self, sensor: str) -> Bench | None:
        """The bench of a sensor, or None where it has none."""
        if sensor == MAGNETOMETER:
            return self.magnetometer
        return self._accelerometer if sensor == ACCELEROMETER else self.gyroscope

    def _made(self, sensor: str, measured: Experiment) -> Bench:
        base, plain = self._base.get(sensor), self.report.sensors[sensor]
        if plain.frame != measured.frame and self.report.magnetic is not None:
            plain = self.report.magnetic.fit  # in its own frame, as it was fitted
        same = plain.experiment is measured and (base is None or tuple(base) == plain.base)
        first = plain if same else None
        return Bench(sensor, measured, base, self._own, self._rounding(sensor), first)

    def _renewed(self, sensor: str, measured: Experiment, before: Bench | None) -> Bench:
        bench = self._made(sensor, measured)
        if before is not None:
            bench.retrace(before)
        return bench

    def _rounding(self, sensor: str) -> Rounding | None:
        readings = self.readings
        series = None if readings is None else getattr(readings, sensor)
        if series is not None and sensor == MAGNETOMETER:
            return rounding_while_turning(series, self.report.sensors[sensor].matrix)
        gain = float(np.linalg.norm(self.report.sensors[sensor].matrix, ord=2))
        return rounding_of(series, self.report.holds, gain)


def _same_means(first: Sequence[Hold], second: Sequence[Hold]) -> bool:
    """Whether these are the same holds; what is known of their noise may differ."""
    return len(first) == len(second) and all(
        np.array_equal(one.accelerometer, other.accelerometer)
        for one, other in zip(first, second, strict=True)
    )
