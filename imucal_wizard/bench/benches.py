"""The benches of one session, and the order among them: the accelerometer must pass first.

Gravity, as the accelerometer sees it, is the gyroscope's reference. A second-order term of 3 mg/g²
left out of the accelerometer tilts that reference by 0.07°, twice the noise of a rotation, and the
gyroscope would be blamed for it. Of the magnetometer's rows only the dip rests on gravity; it is
not looked at before.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress

import numpy as np

from imucal_wizard.bench.floors import Rounding, rounding_of, rounding_while_turning
from imucal_wizard.bench.lacking import lacking_base
from imucal_wizard.bench.session import Bench
from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.effects.effect import (
    ACCELEROMETER,
    GYROSCOPE,
    MAGNETOMETER,
    Circumstances,
    Effect,
)
from imucal_wizard.effects.terms.misalignment import Misalignment
from imucal_wizard.errors import DataError
from imucal_wizard.readings import Readings
from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.field_frame import in_body_frame
from imucal_wizard.solver.extended.fit import (
    Measured,
    measured_accelerometer,
    measured_gyroscope,
    measured_magnetometer,
)
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.result import FitReport

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
        self._under: dict[str, Extended | None] = {}

    def _first(self, before: "Benches | None") -> Bench | None:
        """The accelerometer's bench; a recording in which a device only tumbles has none."""
        if ACCELEROMETER not in self.report.sensors and self._has_field:
            return None
        measured = measured_accelerometer(self.report, self.readings)
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
        return complete and not lacking_base(self.accelerometer)

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
            measured = measured_gyroscope(self.report, under, self.readings)
            self._gyroscope = self._renewed(GYROSCOPE, measured, self._gyroscope)
            self._under[GYROSCOPE] = under
        return self._gyroscope

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
            measured = measured_magnetometer(self.report, self.readings, under)
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

    def models(self) -> dict[str, tuple[Extended, Circumstances]]:
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

    def _usable(self, bench: Bench) -> Extended:
        if not isinstance(bench.measured, FieldData):
            return bench.fit
        stage = self.report.second_stage
        rotation = None if stage is None else stage.alignment.rotation
        return in_body_frame(bench.fit, bench.measured, rotation)

    def bench(self, sensor: str) -> Bench | None:
        """The bench of a sensor, or None where it has none."""
        if sensor == MAGNETOMETER:
            return self.magnetometer
        return self._accelerometer if sensor == ACCELEROMETER else self.gyroscope

    def _made(self, sensor: str, measured: Measured) -> Bench:
        return Bench(sensor, measured, self._base.get(sensor), self._own, self._rounding(sensor))

    def _renewed(self, sensor: str, measured: Measured, before: Bench | None) -> Bench:
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
