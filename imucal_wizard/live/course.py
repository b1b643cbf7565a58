"""The procedure as it takes its course on one stream: it begins with the first sample."""

from imucal_wizard.errors import UsageError
from imucal_wizard.live.settings import Settings
from imucal_wizard.procedure.collected import Collected
from imucal_wizard.procedure.state import Event, EventKind, Status, StepKind
from imucal_wizard.procedure.steps import Listener, Machine
from imucal_wizard.procedure.stillness import Noise
from imucal_wizard.readings import Readings

Events = tuple[Event, ...]
Order = tuple[str, str]
"""A command's name and its argument."""


class Course:
    """Before the first sample there is no machine, as rate and units are not known; orders wait.

    Args:
        settings: how the procedure is carried out.
        listener: told of the status after each block of samples and each command.
        noise: of the device at rest, where it is known already.
        waiting: what was ordered already.

    Attributes:
        samples: how many samples the procedure has been fed.
        time: time of the newest of them, s.
        waiting: what was ordered before the first sample.
    """

    def __init__(
        self,
        settings: Settings,
        listener: Listener | None = None,
        noise: Noise | None = None,
        waiting: tuple[Order, ...] = (),
    ) -> None:
        self._settings = settings
        self._listener = listener
        self._noise = noise
        self._machine: Machine | None = None
        self.waiting = waiting
        self.samples = 0
        self.time = 0.0

    @property
    def begun(self) -> bool:
        """Whether the first sample has come."""
        return self._machine is not None

    def begin(self, readings: Readings, rate: float) -> Events:
        """Rate and units are known: what is done of what was ordered before.

        Args:
            readings: the first samples, which tell the units.
            rate: samples per second.
        """
        machine = self._settings.machine(readings, rate, self._noise, self._listener)
        waiting, self.waiting, self._machine = self.waiting, (), machine
        return tuple(event for order in waiting for event in self._obey(machine, *order))

    def feed(self, readings: Readings) -> Events:
        """Take the next samples; what happened in them."""
        if self._machine is None:
            return ()
        self.samples += len(readings)
        self.time = float(readings.accelerometer.time[-1])
        return self._machine.feed(readings)

    def command(self, name: str, argument: str = "") -> Events:
        """Do what is ordered, or keep it until the first sample; what happened."""
        if self._machine is None:
            self.waiting = (*self.waiting, (name, argument))
            return ()
        return self._obey(self._machine, name, argument)

    def _obey(self, machine: Machine, name: str, argument: str) -> Events:
        try:
            return machine.command(name, argument)
        except UsageError as error:
            return (Event(EventKind.WARNING, self.time, str(error)),)

    def flush(self) -> Events:
        """The data have ended; what is complete by that."""
        return () if self._machine is None else self._machine.flush()

    @property
    def step(self) -> StepKind:
        """The step at work; sooner told than the whole status."""
        return StepKind.SOURCE if self._machine is None else self._machine.step

    def status(self) -> Status:
        """The procedure at this moment."""
        return Status() if self._machine is None else self._machine.status()

    @property
    def makeshift(self) -> Noise | None:
        """The noise of a rest that was shorter than asked for, where that had to do; else None."""
        return None if self._machine is None else self._machine.makeshift

    def collected(self) -> Collected:
        """What has been measured."""
        return Collected((), ()) if self._machine is None else self._machine.collected()
