"""Rows of numbers to Readings: SI units or counts, and a time for every sample."""

import numpy as np

from imucal_wizard import units
from imucal_wizard.devices.blanks import Blanks
from imucal_wizard.devices.clock import DeviceClock, SampleCounter
from imucal_wizard.devices.formats.base import Column, Rows
from imucal_wizard.devices.host_clock import HostClock
from imucal_wizard.devices.rate import period_of, quantum_of
from imucal_wizard.devices.resolve import places_of
from imucal_wizard.devices.torn import TornTimes
from imucal_wizard.readings import FloatArray, Readings, Series


class Assembler:
    """Gives every row its units and its time.

    Args:
        columns: resolved columns, every sensor's with its unit.
        first: first rows, shape (n, columns), from which the device's period is taken.
        rate: samples per second where the stream carries no time and it is known.

    Attributes:
        blanks: the rows that were left out because they lack a number.
    """

    def __init__(
        self, columns: tuple[Column, ...], first: FloatArray, rate: float | None = None
    ) -> None:
        self.columns = columns
        self.samples = 0
        self._places = {s: places_of(columns, s) for s in _SENSORS}
        self._factors = {s: self._factor(s, p) for s, p in self._places.items() if p}
        where = {c.channel: i for i, c in enumerate(columns) if c.channel}
        self._beside = _beside(columns, where)
        self._load = "current" if "current" in self._beside else "throttle"
        self._time = where.get("t")
        self._count = where.get("counter") if self._time is None else None
        self.blanks = Blanks(columns, self._needed())
        self._counter = SampleCounter()
        self._host = HostClock(rate)
        self._torn: TornTimes | None = None
        self._device = self._device_clock(first)
        self._waiting = np.zeros((0, len(columns)))
        self._index = 0.0
        self._fields = 0

    def _factor(self, sensor: str, places: list[int]) -> FloatArray:
        return np.array([units.factor(sensor, self.columns[p].unit) for p in places])

    def _device_clock(self, first: FloatArray) -> DeviceClock | None:
        if self._time is None:
            return None
        factor = units.factor("time", self.columns[self._time].unit)
        ticks = first[np.isfinite(first[:, self._time]), self._time] * factor
        period, quantum = period_of(ticks), quantum_of(ticks)
        self._device_period = period
        self._torn = TornTimes(self._time, (1.5 * period + quantum) / factor)
        return DeviceClock(factor, period, quantum)

    @property
    def device(self) -> DeviceClock | None:
        """The device's clock, where the stream carries time."""
        return self._device

    @property
    def period(self) -> float:
        """Seconds per sample as known now; 0 before it is known."""
        return self._device_period if self._device is not None else self._host.period

    @property
    def lost(self) -> int:
        """Samples missing by the device's time or count, or by the host's clock."""
        by_device = self._device.lost if self._device is not None else self._host.lost
        return by_device + self._counter.lost

    @property
    def fieldless(self) -> bool:
        """Whether there are columns of a magnetometer, and never a number in all of them."""
        return bool(self._places["magnetometer"]) and not self._fields

    @property
    def torn(self) -> int:
        """Rows left out because their time is a piece of two lines."""
        return self._torn.count if self._torn is not None else 0

    @property
    def dropped(self) -> int:
        """Those of the lost samples that went missing while the device was there."""
        clock = self._device if self._device is not None else self._host
        return self.lost - clock.away

    def feed(self, rows: Rows, arrival: float) -> Readings | None:
        """The samples whose time can be told now; None when there are none."""
        values = rows.values
        if not len(values):
            return None
        indices = self._indices(rows)
        good = self.blanks.sift(values)
        if not good.all():
            values, indices = values[good], indices[good]
            if not len(values):
                return None
        if self._torn is not None:
            return self._timed(self._torn.feed(values))
        if self._count is not None:
            indices = self._counter.feed(values[:, self._count])
        self._waiting = np.concatenate((self._waiting, values))
        return self._released(self._host.feed(indices, arrival))

    def flush(self) -> Readings | None:
        """What still waits for its time, at the end of the stream."""
        if self._torn is not None:
            held = self._torn.flush()
            return None if held is None else self._timed(held)
        return self._released(self._host.flush())

    def _timed(self, values: FloatArray) -> Readings | None:
        """Samples that carry their time."""
        if self._device is None or self._time is None:
            return None
        return self._readings(self._device.feed(values[:, self._time]), values)

    def _released(self, times: FloatArray) -> Readings | None:
        values, self._waiting = self._waiting[: len(times)], self._waiting[len(times) :]
        return self._readings(times, values)

    def _indices(self, rows: Rows) -> FloatArray:
        steps = np.ones(len(rows.values))
        if rows.skipped:
            steps += rows.skipped
        indices: FloatArray = self._index + np.cumsum(steps) - 1.0
        self._index = float(indices[-1]) + 1.0
        return indices

    def _needed(self) -> list[int]:
        extra = [i for i in (self._time, self._count) if i is not None]
        return self._places["accelerometer"] + self._places["gyroscope"] + extra

    def _readings(self, times: FloatArray, values: FloatArray) -> Readings | None:
        if not len(times):
            return None
        self.samples += len(times)
        return Readings(
            self._series("accelerometer", times, values),
            self._series("gyroscope", times, values) if self._places["gyroscope"] else None,
            self._field(times, values) if self._places["magnetometer"] else None,
            self._slow("temperature", times, values),
            current=self._slow(self._load, times, values),
        )

    def _series(self, sensor: str, times: FloatArray, values: FloatArray) -> Series:
        places = self._places[sensor]
        unit = units.si_unit(sensor, self.columns[places[0]].unit)
        return Series(times, values[:, places] * self._factors[sensor], unit)

    def _field(self, times: FloatArray, values: FloatArray) -> Series:
        """The magnetometer is slower than the others: absent in most rows of some devices."""
        there = np.isfinite(values[:, self._places["magnetometer"]]).all(axis=1)
        self._fields += int(there.sum())
        return self._series("magnetometer", times[there], values[there])

    def _slow(self, name: str, times: FloatArray, values: FloatArray) -> Series | None:
        """What stands beside the sensors: a temperature, a current, a throttle."""
        if name not in self._beside:
            return None
        place, factor = self._beside[name]
        own = values[:, place : place + 1] * factor
        there = np.isfinite(own[:, 0])
        return Series(times[there], own[there], units.SI_UNIT[name])


def _beside(columns: tuple[Column, ...], where: dict[str, int]) -> dict[str, tuple[int, float]]:
    """Column and factor of what stands beside the sensors; a temperature without unit is in °C."""
    found = {"temperature": (where["temp"], 1.0)} if "temp" in where else {}
    for name in ("current", "throttle"):
        unit = columns[where[name]].unit if name in where else ""
        if unit in units.FACTORS[name]:
            found[name] = (where[name], units.FACTORS[name][unit])
    return found


_SENSORS = ("accelerometer", "gyroscope", "magnetometer")
