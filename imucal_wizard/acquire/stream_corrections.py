"""What a file shows as a whole, corrected in a stream from the sample on that shows it.

The rules are those of ``files.whole_recording``. A stream cannot wait for its end: what its samples
so far do not show stays as it is. How the bytes were divided does not matter.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from imucal_wizard.acquire.silent_samples import FIELD, INERTIAL, SilenceFilter
from imucal_wizard.core.limits.data_quality import GRAVITY_BLOCK_SECONDS
from imucal_wizard.core.readings import BoolArray, FloatArray, Readings, Series, join_readings
from imucal_wizard.core.units import COUNT
from imucal_wizard.measurement.repeats import (
    MAX_SINGLE_RUN_SHARE,
    MIN_RUNS,
    repeat_period,
    repeats_note,
    run_starts,
)
from imucal_wizard.measurement.unsigned_counts import SignWatch, signs_note, twos_complement

_MAX_SILENT = 50
"""Consecutive samples that read zero after which the sensor is silent."""
_MAX_REPEATS_WAIT = 5.0
"""Seconds in which the beginning shows whether measurements are repeated: 50 at 10 Hz."""


class StreamCorrections:
    """Drops what is no measurement, and restores the sign of counts.

    Attributes:
        dropped: number of samples that were left out.
        signs: bits of the unsigned numbers, by the sensors of which they are read as signed.
        signed_since: time of the sample that showed the newest of them, s.
    """

    def __init__(self) -> None:
        self._silence = SilenceFilter()
        self._beside: list[Readings] = []
        self._repeats: RepeatFilter | None = None
        self._watches = {name: SignWatch() for name in (*INERTIAL, FIELD)}
        self._notes: dict[str, str] = {}
        self._plain = False
        self.dropped = 0
        self.signs: dict[str, int] = {}
        self.signed_since = 0.0

    @property
    def notes(self) -> tuple[str, ...]:
        """What was corrected, each kind once."""
        return tuple(self._notes.values())

    @property
    def problem(self) -> str:
        """Why no samples are left; "" otherwise."""
        if self._silence.watches["accelerometer"].running < _MAX_SILENT:
            return ""
        return (
            "The accelerometer reads exactly zero on all axes: it does not answer, or the device "
            "removes gravity. Check its wiring, and let the device send the raw acceleration."
        )

    @property
    def repeated(self) -> float:
        """How often each measurement of the inertial sensors arrives."""
        return 1.0 if self._repeats is None else self._repeats.period

    def feed(self, readings: Readings, period: float) -> Readings | None:
        """The corrected samples that are known now; None if there are none.

        Args:
            readings: new samples.
            period: sampling period, s.
        """
        field = readings.magnetometer
        if (
            self._plain
            and readings.accelerometer.values.all()
            and (field is None or field.values.all())
        ):
            return readings  # the usual stream, of which nothing is corrected
        before, repeats = len(readings), self._repeats
        heard = self._silence.feed(readings)
        for name in self._silence.left_out:
            self._note(
                f"silent {name}",
                f"samples of the {name} that read exactly zero on all axes are left out: the "
                "sensor did not answer, or had no new reading",
            )
        if repeats is None:
            repeats = self._repeats = RepeatFilter(period)
        once = None
        self._beside.append(heard)
        if len(heard):  # what other sensors read while it was silent goes with the next samples
            parts, self._beside = self._beside, []
            once = repeats.feed(join_readings(parts) if len(parts) > 1 else heard)
        if repeats.period != 1.0:
            name = "accelerometer and the gyroscope" if repeats.sensors > 1 else "accelerometer"
            self._note("repeats", *repeats_note(name, repeats.period))
        watches = self._silence.watches.items()
        there = [one for name, one in watches if getattr(readings, name) is not None]
        usual = repeats.period == 1.0 and not (self._watches or self.signs)
        self._plain = repeats.decided and usual and all(one.answers for one in there)
        return self._counted(once, before)

    def flush(self) -> Readings | None:
        """The samples that still wait, at the end of the stream."""
        return self._counted(None if self._repeats is None else self._repeats.flush(), 0)

    def _counted(self, readings: Readings | None, before: int) -> Readings | None:
        if readings is None or not len(readings):
            self.dropped += before
            return None
        self.dropped += before - len(readings)
        return self._signed(readings) if self._watches or self.signs else readings

    def _note(self, key: str, *texts: str) -> None:
        for text in texts:
            self._notes.setdefault(key, text)

    def _signed(self, readings: Readings) -> Readings:
        """With the negative numbers of counts that were sent as unsigned ones."""
        shown: list[tuple[float, str, float, int]] = []
        for name, watch in list(self._watches.items()):
            series = getattr(readings, name)
            if series is None or series.unit != COUNT:
                del self._watches[name]
                continue
            largest, bits = watch.largest, watch.add(series.values)
            if bits.any():
                row = int(np.flatnonzero(bits)[0])
                largest = max(largest, float(series.values[: row + 1].max()))
                shown.append((float(series.time[row]), name, largest, int(bits[row])))
            elif not watch.possible:
                del self._watches[name]
        if shown:
            self.signed_since, name, read, length = min(shown)
            self._note("signs", signs_note(name, read, read - 2.0**length))
            # one sensor shows how the device writes the numbers of all
            self.signs = dict.fromkeys(
                (one for one, watch in self._watches.items() if watch.holds(length)), length
            )
            self._watches.clear()
        return with_signs(readings, self.signs)


def with_signs(readings: Readings, signs: Mapping[str, int]) -> Readings:
    """The readings with the unsigned numbers of some sensors as signed ones.

    Args:
        readings: samples; those with signs stay as they are.
        signs: bits by sensor.
    """
    for name, bits in signs.items():
        series = getattr(readings, name)
        if series is not None:
            meant = replace(series, values=twos_complement(series.values, bits))
            readings = replace(readings, **{name: meant})
    return readings


class RepeatFilter:
    """Keeps each measurement of the inertial sensors once, where a faster loop repeats it.

    The first samples wait until they show it, because the sampling rate follows from it. Noise
    shows within a few samples that nothing is repeated; readings that never change show nothing.

    Args:
        interval: time from one sample to the next, s.

    Attributes:
        period: samples from one measurement to the next; 1 if none is repeated, or not yet known.
        sensors: number of sensors that are read together.
    """

    def __init__(self, interval: float) -> None:
        self._interval = interval
        self._waiting: list[Readings] | None = []
        self._last: list[FloatArray] = []
        self._run = 0
        self.period = 1.0
        self.sensors = 1

    @property
    def decided(self) -> bool:
        """Whether it is known if measurements are repeated."""
        return self._waiting is None

    def feed(self, readings: Readings) -> Readings | None:
        """The samples that are known now; None while all wait.

        Args:
            readings: new samples, at least one.
        """
        if self._waiting is None:
            return readings if self.period == 1.0 else self._once(readings)
        self._waiting.append(readings)
        period = self._decided(join_readings(self._waiting))
        if period is None:
            return None
        self.period = period
        whole = self.flush()
        return whole if whole is None or period == 1.0 else self._once(whole)

    def flush(self) -> Readings | None:
        """The samples that wait."""
        waiting, self._waiting = self._waiting, None
        return join_readings(waiting) if waiting else None

    def _decided(self, readings: Readings) -> float | None:
        """The period by the first samples that show it; None if these do not."""
        values = _together(readings)
        self.sensors = len(values)
        starts = run_starts(*values)
        lengths = np.diff(starts)
        singles = np.flatnonzero(lengths[1:] == 1)
        allowed = int(MAX_SINGLE_RUN_SHARE * MIN_RUNS)
        if len(singles) > allowed and singles[allowed] < MIN_RUNS:
            return 1.0
        if len(lengths) > MIN_RUNS:
            return repeat_period(lengths[1 : 1 + MIN_RUNS], at_rest=True) or 1.0
        longest = max(int(lengths.max(initial=0)), len(readings) - int(starts[-1]))
        rests = longest * self._interval > GRAVITY_BLOCK_SECONDS
        return 1.0 if rests or len(readings) * self._interval > _MAX_REPEATS_WAIT else None

    def _once(self, readings: Readings) -> Readings:
        """One sample for each measurement; equal ones that follow one another keep their number."""
        values, time = _together(readings), readings.accelerometer.time
        before = self._last or [np.full((1, 3), np.nan)] * len(values)
        joined = [np.concatenate(pair) for pair in zip(before, values, strict=True)]
        starts = run_starts(*joined)[1:] - 1
        places = np.arange(len(time))
        begun = np.full(len(time), -1)
        begun[starts] = starts
        begun = np.maximum.accumulate(begun)
        place = np.where(begun < 0, places + self._run, places - begun)
        number = np.maximum(np.round((place + 1) / self.period), 1.0)
        kept = (place == 0) | (number > np.maximum(np.round(place / self.period), 1.0))
        self._last = [one[-1:] for one in values]
        self._run = int(place[-1]) + 1
        late = (place - (number - 1.0) * self.period) * self._interval
        return _inertial_rows(readings, kept, time - late)


def _together(readings: Readings) -> list[FloatArray]:
    """The values of the sensors that are read together."""
    gyroscope = readings.gyroscope
    own = [readings.accelerometer.values]
    return own if gyroscope is None else [*own, gyroscope.values]


def _rows(series: Series, rows: BoolArray, time: FloatArray | None = None) -> Series:
    return replace(
        series, time=(series.time if time is None else time)[rows], values=series.values[rows]
    )


def _inertial_rows(readings: Readings, rows: BoolArray, time: FloatArray | None = None) -> Readings:
    """Some samples of accelerometer and gyroscope, perhaps at other times."""
    accelerometer = _rows(readings.accelerometer, rows, time)
    gyroscope = readings.gyroscope
    if gyroscope is not None:
        gyroscope = replace(gyroscope, time=accelerometer.time, values=gyroscope.values[rows])
    return replace(readings, accelerometer=accelerometer, gyroscope=gyroscope)


def since(readings: Readings, first: float) -> Readings:
    """The samples from a time on, s."""

    def later(series: Series | None) -> Series | None:
        return None if series is None else _rows(series, series.time >= first)

    own = readings.accelerometer
    return replace(
        _inertial_rows(readings, np.asarray(own.time >= first)),
        magnetometer=later(readings.magnetometer),
        temperature=later(readings.temperature),
        current=later(readings.current),
    )
