"""The settings of a procedure; they are stored in the session, so that it can be resumed."""

from dataclasses import field
from typing import Any

import msgspec

from imucal_wizard.core.errors import SessionError
from imucal_wizard.core.readings import Readings
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import SI_UNIT, STANDARD_GRAVITY
from imucal_wizard.guide.plan import Procedure
from imucal_wizard.guide.state_machine import Listener, StateMachine
from imucal_wizard.guide.steps.recheck import Planner
from imucal_wizard.measurement.stillness import Noise


@dataclass(frozen=True)
class ProcedureSettings:
    """The choices made before the first sample.

    Attributes:
        procedure: the steps and what each needs.
        gravity: local gravity, m/s².
        gyroscope_range: full scale of the gyroscope, rad/s, or None; not used for counts.
    """

    procedure: Procedure = field(default_factory=Procedure)
    gravity: float = STANDARD_GRAVITY
    gyroscope_range: float | None = None

    def machine(
        self,
        readings: Readings,
        rate: float,
        noise: Noise | None,
        listener: Listener | None,
        planner: Planner | None = None,
    ) -> StateMachine:
        """A procedure for a stream that begins with these samples.

        Args:
            readings: the first samples, which contain the units.
            rate: samples per second.
            noise: noise of the device at rest, if already known.
            listener: receives every instruction.
            planner: chooses the poses of a recheck.
        """
        gyroscope = readings.gyroscope
        known = gyroscope is not None and gyroscope.unit == SI_UNIT["gyroscope"]
        return StateMachine(
            self.procedure,
            rate=rate,
            accelerometer_unit=readings.accelerometer.unit,
            gyroscope_unit=SI_UNIT["gyroscope"] if gyroscope is None else gyroscope.unit,
            gravity=self.gravity,
            gyroscope_range=self.gyroscope_range if known else None,
            noise=noise,
            listener=listener,
            planner=planner,
        )

    def to_json(self) -> dict[str, Any]:
        """A value that the ``json`` module writes."""
        value: dict[str, Any] = msgspec.to_builtins(self)
        return value

    @classmethod
    def from_json(cls, value: object) -> "ProcedureSettings":
        """The settings that ``to_json`` wrote.

        Raises:
            SessionError: they are not settings.
        """
        try:
            return msgspec.convert(value, cls)
        except msgspec.ValidationError as error:
            raise SessionError(
                f"the settings in the session cannot be read ({error}); begin a new session"
            ) from error
