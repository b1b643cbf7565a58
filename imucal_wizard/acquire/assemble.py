"""Assembles rows of numbers to Readings in SI units or counts, with a time for every sample."""

import numpy as np

from imucal_wizard.acquire.clock import DeviceClock, SampleCounter, TimeSmoother
from imucal_wizard.acquire.decode.base import Column, DecodedRows
from imucal_wizard.acquire.decode.vocabulary import LETTER_OF_SENSOR
from imucal_wizard.acquire.even_times import JitterFilter
from imucal_wizard.acquire.host_clock import (
    BurstClock,
    HostClock,
    burst_pause,
    long_tick,
    sampling_period,
    time_quantum,
)
from imucal_wizard.acquire.resolve import sensor_places
from imucal_wizard.acquire.row_order import COPY_SECONDS, RowOrder
from imucal_wizard.core import units
from imucal_wizard.core.limits.data_quality import RESTART_GAP_SECONDS
from imucal_wizard.core.readings import BoolArray, FloatArray, Readings, Series, join_readings

_MIN_BARREN = 50
"""Consecutive rows without a needed number after which the column counts as empty."""
BURSTS = (
    "The times jitter as if they were taken on arrival, in bursts: the samples are spread evenly "
    "over them. Let the device print its own time."
)
SHARED_TIMES = (
    "Several samples share each time: they are spread evenly over the times. Let the device print "
    "the time of each sample."
)
"""What is said of times of bursts, and of times that are as coarse as bursts but do not jitter."""
_MIN_COMPLETE = 0.7
"""Share of complete rows, from which on the others lack single numbers."""
_MIN_TOGETHER = 0.9
"""Share of the incomplete rows that lack each of some columns, if these are empty together."""
_HELP = "check the sensor's wiring and the sketch"
_NO_ACCELEROMETER = Series(np.zeros(0), np.zeros((0, 3)), units.SI_UNIT["accelerometer"])


class Assembler:
    """Gives every row its units and its time.

    Args:
        columns: resolved columns; those of sensors have a unit.
        first: first rows, shape (n, columns), which give the device's sampling period.
        rate: samples per second, if known, for a stream without time.
        recording: whether the rows are a whole recording: the device's own origin of time is kept,
            and sensors may have separate rows.

    Attributes:
        missing: the rows dropped because a number is missing.
    """

    def __init__(
        self,
        columns: tuple[Column, ...],
        first: FloatArray,
        rate: float | None = None,
        *,
        recording: bool = False,
    ) -> None:
        self.columns = columns
        self._recording = recording
        self.samples = 0
        self._places = {s: sensor_places(columns, s) for s in LETTER_OF_SENSOR}
        self._factors = {s: self._factor(s, p) for s, p in self._places.items() if p}
        where = {c.channel: i for i, c in enumerate(columns) if c.channel}
        self._beside = _beside(columns, where)
        self._load = "current" if "current" in self._beside else "throttle"
        self._time = where.get("t")
        self._count = where.get("counter") if self._time is None else None
        self._apart = recording and self._are_apart(first)
        self.missing = MissingValues(columns, self._needed())
        self._counter = SampleCounter()
        self._host = HostClock(rate)
        self._order: RowOrder | None = None
        self._jitter: JitterFilter | None = None
        self._burst_note = ""
        self._bursts = self._burst_clock(first, rate) if recording else None
        self._device = None if self._bursts else self._device_clock(first)
        self._waiting = np.zeros((0, len(columns)))
        self._index = 0.0
        self._fields = 0

    def _factor(self, sensor: str, places: list[int]) -> FloatArray:
        return np.array([units.unit_factor(sensor, self.columns[p].unit) for p in places])

    def _device_clock(self, first: FloatArray) -> DeviceClock | None:
        if self._time is None:
            return None
        factor = units.unit_factor("time", self.columns[self._time].unit)
        ticks = first[np.isfinite(first[:, self._time]), self._time] * factor
        period, quantum = sampling_period(ticks), time_quantum(ticks)
        self._device_period = period
        if not self._recording and not quantum:
            jitter = JitterFilter(ticks)
            self._jitter = jitter if jitter.open else None
        self._order = RowOrder(
            self._time,
            (1.5 * period + quantum) / factor,
            round(COPY_SECONDS / period) if period else 1,
            coarse=quantum > 0.0,
        )
        return DeviceClock(factor, period, quantum, from_zero=not self._recording)

    def _burst_clock(self, first: FloatArray, rate: float | None) -> BurstClock | None:
        """The clock of a recording whose samples arrived in bursts; None for any other one."""
        together = [p for s in ("accelerometer", "gyroscope") for p in self._places[s]]
        together = together or self._places["magnetometer"]
        if self._time is None:
            return None
        complete = np.isfinite(first[:, [self._time, *together]]).all(axis=1)
        if complete.mean() < _MIN_COMPLETE:  # the sensors have separate rows
            return None
        factor = units.unit_factor("time", self.columns[self._time].unit)
        seconds = first[np.isfinite(first[:, self._time]), self._time] * factor
        pause = burst_pause(seconds)
        self._burst_note = BURSTS if pause else ""
        if not pause:
            pause = long_tick(seconds)
            self._burst_note = SHARED_TIMES if pause else ""
        return BurstClock(factor, pause, rate) if pause else None

    @property
    def device(self) -> DeviceClock | None:
        """The device's clock; None if the stream carries no time."""
        return self._device if self._bursts is None else self._bursts.device

    @property
    def period(self) -> float:
        """Current estimate of the sampling period, s; 0 while unknown."""
        if self._device is not None:
            even = self._jitter
            return self._device_period if even is None or not even.period else even.period
        return (self._bursts or self._host).period

    @property
    def lost(self) -> int:
        """Number of lost samples by the device's time or counter, or by the host's clock."""
        return self._clock.lost + self._counter.lost

    @property
    def counter_restarts(self) -> int:
        """Number of restarts of the device's sample counter."""
        return self._counter.restarts

    @property
    def fieldless(self) -> bool:
        """Whether the magnetometer's columns have never held a complete sample."""
        return bool(self._places["magnetometer"]) and not self._fields

    @property
    def misplaced(self) -> int:
        """Number of rows dropped because their time does not fit those around them."""
        return self._order.wrong if self._order is not None else 0

    @property
    def dropped(self) -> int:
        """Number of lost samples without those lost while the device was away."""
        return self.lost - self._clock.away

    @property
    def time_notes(self) -> tuple[str, ...]:
        """What the user should know of the device's times."""
        jitter = "" if self._jitter is None else self._jitter.note
        order = () if self._order is None else self._order.notes(counted=self._recording)
        return (*filter(None, (self._burst_note, jitter)), *order)

    @property
    def _clock(self) -> DeviceClock | BurstClock | HostClock | TimeSmoother:
        if self._jitter is not None and self._jitter.smoother is not None:
            return self._jitter.smoother
        return self._device or self._bursts or self._host

    def feed(self, rows: DecodedRows, arrival: float) -> Readings | None:
        """The samples whose time can be determined now; None if there are none."""
        values = rows.values
        if not len(values):
            return None
        good = self.missing.sift(values)
        if self._bursts is not None and self._time is not None:  # which counts every sample
            values = values[np.isfinite(values[:, self._time])]
            self._waiting = np.concatenate((self._waiting, values))
            return self._released(self._bursts.feed(values[:, self._time]))
        values = values if good.all() else values[good]
        if self._order is not None:
            return self._timed(self._order.feed(values)) if len(values) else None
        indices = self._indices(rows)[good]
        if not len(values):
            return None
        if self._count is not None:
            period = self._host.period
            gap = RESTART_GAP_SECONDS / period if period else 1.0
            indices = self._counter.feed(values[:, self._count], gap)
        self._waiting = np.concatenate((self._waiting, values))
        return self._released(self._host.feed(indices, arrival))

    def flush(self) -> Readings | None:
        """The samples that still wait for their time, at the end of the stream."""
        if self._order is not None:
            parts = [self._timed(self._order.flush())]
            if self._jitter is not None:
                parts.append(self._released(self._jitter.flush()))
            there = [part for part in parts if part is not None]
            return join_readings(there) if there else None
        return self._released((self._bursts or self._host).flush())

    def _timed(self, values: FloatArray) -> Readings | None:
        """Samples that carry their own time."""
        if self._device is None or self._time is None or not len(values):
            return None
        times = self._device.feed(values[:, self._time])
        if self._jitter is None:
            return self._readings(times, values)
        self._waiting = np.concatenate((self._waiting, values)) if len(self._waiting) else values
        return self._released(self._jitter.feed(times))

    def _released(self, times: FloatArray) -> Readings | None:
        values, self._waiting = self._waiting[: len(times)], self._waiting[len(times) :]
        if self._bursts is not None:
            good = self.missing.complete(values)
            times, values = times[good], values[good]
        return self._readings(times, values)

    def _indices(self, rows: DecodedRows) -> FloatArray:
        steps = np.ones(len(rows.values))
        if rows.skipped:
            steps += rows.skipped
        indices: FloatArray = self._index + np.cumsum(steps) - 1.0
        self._index = float(indices[-1]) + 1.0
        return indices

    def _needed(self) -> list[int]:
        extra = [i for i in (self._time, self._count) if i is not None]
        if self._apart:
            return extra
        return self._places["accelerometer"] + self._places["gyroscope"] + extra

    def _are_apart(self, first: FloatArray) -> bool:
        """Whether accelerometer and gyroscope have separate rows."""
        places = self._places["accelerometer"], self._places["gyroscope"]
        if not all(places):
            return False
        one, other = (np.isfinite(first[:, place]).all(axis=1) for place in places)
        return bool((one & other).sum() < 0.5 * min(one.sum(), other.sum()))

    def _readings(self, times: FloatArray, values: FloatArray) -> Readings | None:
        if not len(times):
            return None
        self.samples += len(times)
        accelerometer = self._series("accelerometer", times, values)
        field = self._series("magnetometer", times, values)
        self._fields += 0 if field is None else len(field)
        return Readings(
            _NO_ACCELEROMETER if accelerometer is None else accelerometer,
            self._series("gyroscope", times, values),
            field,
            self._slow("temperature", times, values),
            current=self._slow(self._load, times, values),
        )

    def _series(self, sensor: str, times: FloatArray, values: FloatArray) -> Series | None:
        """The samples of a sensor; a slower sensor is absent in most rows."""
        places = self._places[sensor]
        if not places:
            return None
        unit = units.si_unit(sensor, self.columns[places[0]].unit)
        own = values[:, places]
        if self._apart or sensor == "magnetometer":
            there = np.isfinite(own).all(axis=1)
            times, own = times[there], own[there]
        return Series(times, own * self._factors[sensor], unit)

    def _slow(self, name: str, times: FloatArray, values: FloatArray) -> Series | None:
        """Samples of an auxiliary quantity: temperature, current or throttle."""
        if name not in self._beside:
            return None
        place, factor = self._beside[name]
        own = values[:, place : place + 1] * factor
        there = np.isfinite(own[:, 0])
        return Series(times[there], own[there], units.SI_UNIT[name])


def _beside(columns: tuple[Column, ...], where: dict[str, int]) -> dict[str, tuple[int, float]]:
    """Column and factor of each auxiliary quantity; a temperature without unit is in °C."""
    found = {"temperature": (where["temp"], 1.0)} if "temp" in where else {}
    for name in ("current", "throttle"):
        unit = columns[where[name]].unit if name in where else ""
        if unit in units.UNIT_FACTORS[name]:
            found[name] = (where[name], units.UNIT_FACTORS[name][unit])
    return found


class MissingValues:
    """Drops rows in which a needed column holds no number, and counts them.

    Args:
        columns: the columns of the stream.
        needed: indices of the columns that every sample needs.

    Attributes:
        count: number of rows dropped.
    """

    def __init__(self, columns: tuple[Column, ...], needed: list[int]) -> None:
        self._columns = [columns[place] for place in needed]
        self._needed = needed
        self._each = np.zeros(len(needed), np.int64)
        self._running = 0
        self.count = 0

    def complete(self, values: FloatArray) -> BoolArray:
        """Which rows are complete, shape (n,)."""
        return np.asarray(np.isfinite(values[:, self._needed]).all(axis=1), np.bool_)

    def sift(self, values: FloatArray) -> BoolArray:
        """Which rows are complete, shape (n,); the others are counted."""
        there = np.isfinite(values[:, self._needed])
        if there.all():
            self._running = 0
            return np.ones(len(values), np.bool_)
        good = np.asarray(there.all(axis=1), np.bool_)
        self.count += int((~good).sum())
        self._each += (~there).sum(axis=0)
        numbered = np.flatnonzero(good)
        before = self._running if not len(numbered) else -1 - int(numbered[-1])
        self._running = before + len(good)
        return good

    @property
    def where(self) -> str:
        """The columns with most of the missing numbers, like "the accelerometer's x axis"."""
        worst = self._each >= 0.5 * max(int(self._each.max(initial=0)), 1)
        return _named([c for c, bad in zip(self._columns, worst, strict=True) if bad])

    @property
    def lacking(self) -> str:
        """Where a row has no number, in words: in the same columns, or one here and one there.

        Single lines that are cut short lack other columns, too, and count with those of most.
        """
        each = self._each[self._each >= 0.5 * max(int(self._each.max(initial=0)), 1)]
        if len(each) == 1 or each.min(initial=self.count) >= _MIN_TOGETHER * self.count:
            return f"for {self.where}"
        columns = [c for c, bad in zip(self._columns, self._each > 0, strict=True) if bad]
        names = ", ".join(c.channel or c.name for c in columns)
        return f"in one or more of the columns {names}"

    @property
    def note(self) -> str:
        """Message about single incomplete rows."""
        return f"Some samples have no number (NaN or empty) {self.lacking}: {_HELP}."

    @property
    def problem(self) -> str:
        """Message if no row is complete any more; "" otherwise."""
        if self._running < _MIN_BARREN:
            return ""
        return (
            f"No numbers (NaN or empty) arrive for {self.where}, and nothing can be measured "
            f"without them: {_HELP}, or choose another column in the source step."
        )


def _named(columns: list[Column]) -> str:
    parts, letters = [], LETTER_OF_SENSOR.values()
    for sensor, letter in LETTER_OF_SENSOR.items():
        axes = [c.channel[1] for c in columns if len(c.channel) == 2 and c.channel[0] == letter]
        if axes:
            word = "axis" if len(axes) == 1 else "axes"
            parts.append(f"the {sensor}'s {' and '.join(axes)} {word}")
    parts += [f"column {c.name or c.channel}" for c in columns if c.channel[:1] not in letters]
    return " and ".join(parts)
