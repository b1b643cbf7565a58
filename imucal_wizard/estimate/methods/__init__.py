"""The published calibration methods: one file each, found by discovery.

A module of this package that defines ``METHODS`` adds the methods in it to ``fit``, ``compare`` and
the table of methods. Nothing is imported before a name is looked up, so that the default fit of a
sensor, which is no method of this package, does not pay for them.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cache
from importlib import import_module
from pkgutil import iter_modules
from typing import TYPE_CHECKING, Any

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.records import dataclass

if TYPE_CHECKING:
    from imucal_wizard.estimate.result import SensorFit

DEFAULTS = {"accelerometer": "least_squares", "gyroscope": "vector", "magnetometer": "orthogonal"}
"""Name of the fit of rows and terms, the default of each sensor."""
PAPERS = ("Q", "N", "")
"""Order in which methods are listed: Qureshi and Golnaraghi, Niespodziany, others."""


@dataclass(frozen=True)
class Method:
    """A published method.

    Attributes:
        name: as the user types it.
        sensors: the sensors that it calibrates.
        title: what it does, in a few words.
        paper: ``Q``, ``N``, or "" for neither.
        run: makes the result from ``method_data.Magnitudes`` (accelerometer, magnetometer) or
            ``method_data.GyroscopeData`` (gyroscope).
        each_axis_alone: it fits no angles between the axes.
    """

    name: str
    sensors: tuple[str, ...]
    title: str
    paper: str
    run: "Callable[[Any], SensorFit]"
    each_axis_alone: bool = False


@cache
def methods_of(sensor: str) -> dict[str, Method]:
    """All methods of a sensor by name, those of the papers first."""
    modules = (import_module(f"{__name__}.{found.name}") for found in iter_modules(__path__))
    methods: list[Method] = [one for module in modules for one in getattr(module, "METHODS", ())]
    methods.sort(key=lambda one: PAPERS.index(one.paper))
    return {one.name: one for one in methods if sensor in one.sensors}


def method_of(sensor: str, name: str) -> Method:
    """The method of that name.

    Raises:
        UsageError: the sensor has no such method.
    """
    if name not in methods_of(sensor):
        names = ", ".join(MethodNames(sensor))
        raise UsageError(f"{name!r} is no method of the {sensor}; choose one of {names}")
    return methods_of(sensor)[name]


class MethodNames(Sequence[str]):
    """The names that a user may choose from, the default first; looked up when first needed."""

    def __init__(self, sensor: str) -> None:
        self._sensor = sensor

    def __iter__(self) -> Iterator[str]:
        return iter((DEFAULTS[self._sensor], *methods_of(self._sensor)))

    def __contains__(self, name: object) -> bool:
        return name == DEFAULTS[self._sensor] or name in methods_of(self._sensor)

    def __len__(self) -> int:
        return 1 + len(methods_of(self._sensor))

    def __getitem__(self, index: Any) -> Any:
        return tuple(self)[index]
