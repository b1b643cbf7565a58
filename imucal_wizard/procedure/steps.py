"""The procedure at work: a state machine fed with readings, that nobody has to press a key for."""

from collections.abc import Callable

from imucal_wizard.procedure.collected import Collected
from imucal_wizard.procedure.commands import Commands
from imucal_wizard.procedure.conductor import Conductor
from imucal_wizard.procedure.moments import MomentMaker
from imucal_wizard.procedure.overview import overview
from imucal_wizard.procedure.plan import Procedure, Step, standard
from imucal_wizard.procedure.scales import Scales
from imucal_wizard.procedure.state import Event, Status, StepKind
from imucal_wizard.procedure.stillness import Noise
from imucal_wizard.readings import Readings
from imucal_wizard.units import STANDARD_GRAVITY

__all__ = ["Listener", "Machine", "Procedure", "Step", "standard"]

Listener = Callable[[Status, int], None]
"""Told of the status and of how many samples are behind it."""


class Machine:
    """Leads through a procedure.

    All decisions are made block by block in sample time: the same samples and commands give the
    same holds to the last bit, however the samples are cut and however fast they come.

    Args:
        procedure: the steps and their needs.
        rate: samples per second.
        accelerometer_unit: ``m/s^2`` or ``count``.
        gyroscope_unit: ``rad/s`` or ``count``.
        gravity: local gravity, m/s².
        gyroscope_range: full scale of the gyroscope in its unit, or None when not known.
        noise: of the device at rest, where it is known already: then nothing is settled first.
        listener: told of the status after each block and each command, however they are cut.
    """

    def __init__(
        self,
        procedure: Procedure | None = None,
        *,
        rate: float,
        accelerometer_unit: str = "m/s^2",
        gyroscope_unit: str = "rad/s",
        gravity: float = STANDARD_GRAVITY,
        gyroscope_range: float | None = None,
        noise: Noise | None = None,
        listener: Listener | None = None,
    ) -> None:
        units = Scales(accelerometer_unit, gyroscope_unit, gravity)
        self._moments = MomentMaker(rate)
        self._conductor = Conductor(procedure or Procedure(), units, gyroscope_range, noise)
        self._commands = Commands(self._conductor)
        self._status: Status | None = None
        self._listener = listener
        self._judged = 0

    def feed(self, readings: Readings) -> tuple[Event, ...]:
        """Take the next readings; what happened in them."""
        for moment in self._moments.feed(readings):
            self._conductor.follow(moment)
            self._judged += len(moment.time)
            self._changed()
        return self._conductor.scene.drain()

    def command(self, name: str, argument: str = "") -> tuple[Event, ...]:
        """Obey the operator; what happened.

        Args:
            name: ``start``, ``skip``, ``undo``, ``repeat``, ``goto``, ``back``, ``loosen``,
                ``take``, ``remeasure``, ``count-faces``, ``enough``, ``validate``, ``save`` or
                ``measure``.
            argument: the step's name for ``goto``; for ``measure`` what ``asked.to_text`` made.

        Raises:
            UsageError: there is no such command or step.
        """
        self._commands.obey(name, argument)
        self._changed()
        return self._conductor.scene.drain()

    def flush(self) -> tuple[Event, ...]:
        """The data have ended: a hold still running is complete as it is."""
        self._conductor.end()
        self._changed()
        return self._conductor.scene.drain()

    def _changed(self) -> None:
        self._status = None
        if self._listener is not None:
            self._listener(self.status(), self._judged)

    def status(self) -> Status:
        """Everything a screen shows, frozen."""
        if self._status is None:
            self._status = overview(self._conductor)
        return self._status

    @property
    def step(self) -> StepKind:
        """The step at work; sooner told than the whole status."""
        return self._conductor.route.step

    @property
    def makeshift(self) -> Noise | None:
        """The noise of a rest that was shorter than asked for, where that had to do; else None."""
        settle = self._conductor.route.settle
        return settle.noise if settle.makeshift else None

    def collected(self) -> Collected:
        """What has been measured; a hold that still grows is as long as it is by now."""
        return self._conductor.collected()
