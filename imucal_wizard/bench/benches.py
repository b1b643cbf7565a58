"""The benches of one session, and the order among them: the accelerometer must pass first.

Gravity, as the accelerometer sees it, is the gyroscope's reference. A second-order term of 3 mg/g²
left out of the accelerometer tilts that reference by 0.07°, twice the noise of a rotation, and the
gyroscope would be blamed for it.
"""

from collections.abc import Sequence

import numpy as np

from imucal_wizard.bench.floors import Rounding, rounding_of
from imucal_wizard.bench.lacking import lacking_base
from imucal_wizard.bench.session import Bench
from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.effects.effect import ACCELEROMETER, GYROSCOPE, Circumstances, Effect
from imucal_wizard.readings import Readings
from imucal_wizard.solver.extended.fit import measured_accelerometer, measured_gyroscope
from imucal_wizard.solver.extended.hold_data import BASE
from imucal_wizard.solver.extended.result import Extended
from imucal_wizard.solver.result import FitReport


class Benches:
    """A bench for each sensor of a session.

    Args:
        report: the plain fit of a recording, or of what the wizard has collected.
        readings: the recording, where there is one: the session's beginning, temperature,
            vibration, and the step of the readings.
        base: terms of the base model, of both sensors.
        own: effects of the user's own.
        before: the benches of the same session with less data; the models found there are kept.

    Raises:
        DataError: the holds do not carry the accelerometer's base model.
    """

    def __init__(
        self,
        report: FitReport,
        readings: Readings | None = None,
        base: Sequence[str] = BASE,
        own: Sequence[Effect] = (),
        before: "Benches | None" = None,
    ) -> None:
        self.report = report
        self.readings = readings
        self._base: tuple[str, ...] = tuple(base) if before is None else before._base
        self._own: tuple[Effect, ...] = tuple(own) if before is None else before._own
        self.accelerometer = Bench(
            ACCELEROMETER,
            measured_accelerometer(report, readings),
            self._base,
            self._own,
            self._rounding(ACCELEROMETER),
        )
        if before is not None:
            self.accelerometer.retrace(before.accelerometer)
        self._gyroscope: Bench | None = None if before is None else before._gyroscope
        self._under: Extended | None = None

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensors that have a bench."""
        return tuple(name for name in (ACCELEROMETER, GYROSCOPE) if name in self.report.sensors)

    @property
    def passed(self) -> bool:
        """Whether the data carry the accelerometer's model, and it leaves only noise."""
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
        if self._gyroscope is None or self._under is not self.accelerometer.fit:
            self._gyroscope = self._renewed(self._gyroscope)
            self._under = self.accelerometer.fit
        return self._gyroscope

    def models(self) -> dict[str, tuple[Extended, Circumstances]]:
        """Sensors whose models have effects, with the circumstances they were fitted under."""
        gyroscope = None if self._gyroscope is None else self.gyroscope
        return {
            bench.sensor: (bench.fit, bench.measured.circumstances)
            for bench in (self.accelerometer, gyroscope)
            if bench is not None and bench.fit.terms
        }

    def bench(self, sensor: str) -> Bench | None:
        """The bench of a sensor, or None where it has none."""
        return self.accelerometer if sensor == ACCELEROMETER else self.gyroscope

    def _renewed(self, before: Bench | None) -> Bench:
        measured = measured_gyroscope(self.report, self.accelerometer.fit, self.readings)
        bench = Bench(GYROSCOPE, measured, self._base, self._own, self._rounding(GYROSCOPE))
        if before is not None:
            bench.retrace(before)
        return bench

    def _rounding(self, sensor: str) -> Rounding | None:
        readings = self.readings
        series = None if readings is None else getattr(readings, sensor)
        gain = float(np.linalg.norm(self.report.sensors[sensor].matrix, ord=2))
        return rounding_of(series, self.report.holds, gain)
