"""Where the bench's screen gets its benches from."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:  # scipy waits until a bench is opened
    from imucal_wizard.bench.session import Bench
    from imucal_wizard.solver.result import FitReport


class Benches(Protocol):
    """A bench for each sensor of a session; asked in a thread."""

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensors that have a bench."""

    def bench(self, sensor: str) -> "Bench | None":
        """The bench of a sensor as it is now."""


class Ready:
    """Benches that are there already.

    Args:
        benches: by sensor.
    """

    def __init__(self, benches: "Mapping[str, Bench]") -> None:
        self._benches = dict(benches)

    @property
    def sensors(self) -> tuple[str, ...]:
        """The sensors that have a bench."""
        return tuple(self._benches)

    def bench(self, sensor: str) -> "Bench | None":
        """The bench of a sensor."""
        return self._benches.get(sensor)


def benches_of(report: "FitReport") -> Benches:
    """The benches of what the wizard has collected and fitted.

    Raises:
        DataError: the holds do not carry the accelerometer's base model.
    """
    from imucal_wizard.bench.session import Bench
    from imucal_wizard.solver.extended.fit import measured_accelerometer, measured_gyroscope

    found = {"accelerometer": Bench("accelerometer", measured_accelerometer(report))}
    if "gyroscope" in report.sensors:
        measured = measured_gyroscope(report, found["accelerometer"].fit)
        found["gyroscope"] = Bench("gyroscope", measured)
    return Ready(found)
