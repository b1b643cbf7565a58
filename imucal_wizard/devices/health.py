"""Watches a stream and collects, each once, the warnings that say what to do."""

from collections import deque

import numpy as np

from imucal_wizard.devices import checks
from imucal_wizard.devices.assemble import Assembler
from imucal_wizard.devices.rate import RateFit
from imucal_wizard.devices.resolve import places_of
from imucal_wizard.readings import FloatArray, Readings

_WINDOW_SECONDS = 2.0
_DEAD_WINDOWS = 5
_CHECKS = (checks.frozen, checks.repeated, checks.gravity, checks.zero_rate, checks.clipped)
_RATE_AFTER = 8.0
_SILENCE = 0.5
_FEW = 5
_LONG = 500
"""Samples after which a sensor that has said nothing is not merely slow."""
_LEAST = 100
"""Samples below which no share is worth a warning."""


class Health:
    """The streaming checks. The windows are cut by sample, never by chunk.

    Args:
        assembler: what gives the samples their time; its counters are watched.
        compare_arrivals: compare the device's time with the host's; False where a recording is
            played, or time runs faster than it should.
    """

    def __init__(self, assembler: Assembler, compare_arrivals: bool = True) -> None:
        self._assembler = assembler
        self._compare = compare_arrivals and assembler.device is not None
        self._fit = RateFit()
        self._arrival = 0.0
        self._rows: list[tuple[FloatArray, FloatArray | None]] = []
        self._count = 0
        self._windows: deque[checks.Window] = deque(maxlen=_DEAD_WINDOWS)
        self._notes: dict[str, str] = {}
        self._digits_known = False
        self._size = 0

    @property
    def notes(self) -> tuple[str, ...]:
        """What was noticed, each kind once, in order."""
        return tuple(self._notes.values())

    def feed(self, readings: Readings, arrival: float) -> None:
        """Look at the samples that have just come out."""
        rate = None if readings.gyroscope is None else readings.gyroscope.values
        self._rows.append((readings.accelerometer.values, rate))
        self._count += len(readings)
        self._size = self._size or max(_LEAST, round(_WINDOW_SECONDS / self._assembler.period))
        if self._count >= self._size:
            self._cut(self._size, readings)
        if self._compare:
            if arrival - self._arrival > _SILENCE:  # the device was away: its time went on alone
                self._fit = RateFit()
            self._arrival = arrival
            self._fit.add(self._assembler.samples + self._assembler.lost, arrival)

    def count(self, malformed: int, decimals: tuple[int, ...]) -> None:
        """Look at what was lost and thrown away so far, and at the printed digits."""
        self._clock()
        total = self._assembler.samples
        blanks = self._assembler.blanks
        if total >= _LEAST and malformed and malformed + blanks.count >= max(_FEW, 0.01 * total):
            self._note("malformed", _MALFORMED)
        if blanks.count >= _FEW:
            self._note("nan", blanks.note)
        if total >= _LONG and self._assembler.fieldless:
            self._note("field", _FIELDLESS)
        # a line cut in two takes its neighbour with it, and both are missing by the device's time
        dropped = self._assembler.dropped - 2 * malformed - blanks.count
        if total >= _LEAST and dropped >= max(_FEW, 0.01 * total):
            self._note("lost", _LOST)
        if total >= _LEAST and decimals and not self._digits_known:
            self._digits_known = True
            self._digits(decimals)

    def _cut(self, size: int, readings: Readings) -> None:
        acceleration = np.concatenate([a for a, _ in self._rows])
        gyroscope = readings.gyroscope
        rates = [r for _, r in self._rows if r is not None]
        rate = np.concatenate(rates) if rates else None
        whole = len(acceleration) // size * size
        for start in range(0, whole, size):
            rows = slice(start, start + size)
            self._look(
                checks.Window(
                    acceleration[rows],
                    None if rate is None else rate[rows],
                    readings.accelerometer.unit,
                    gyroscope.unit if gyroscope is not None else "",
                )
            )
        self._rows = [(acceleration[whole:], None if rate is None else rate[whole:])]
        self._count = len(acceleration) - whole

    def _look(self, window: checks.Window) -> None:
        for check in _CHECKS:
            text = check(window)
            if text:
                self._note(check.__name__, text)
        self._windows.append(window)
        if len(self._windows) == _DEAD_WINDOWS:
            self._dead("accelerometer", [w.acceleration for w in self._windows])
            self._dead("gyroscope", [w.rate for w in self._windows if w.rate is not None])

    def _dead(self, sensor: str, parts: list[FloatArray]) -> None:
        if not parts or f"coarse {sensor}" in self._notes:
            return  # a quiet axis stands still between coarse steps
        dead = checks.dead_axes(np.concatenate(parts))
        if dead:
            axes = " and ".join(dead)
            self._note(
                f"dead {sensor}",
                f"The {sensor}'s {axes} axis never changes: it is dead, or another column was "
                f"taken for it. Check the columns and the sensor.",
            )

    def _digits(self, decimals: tuple[int, ...]) -> None:
        columns = self._assembler.columns
        for sensor in ("accelerometer", "gyroscope"):
            places = [p for p in places_of(columns, sensor) if p < len(decimals)]
            if places:
                most = max(decimals[p] for p in places)
                text = checks.too_few_digits(sensor, columns[places[0]].unit, most)
                if text:
                    self._note(f"coarse {sensor}", text)

    def _clock(self) -> None:
        device = self._assembler.device
        if device is None:
            return
        for count, key in (
            (device.wraps, "wrap"),
            (device.restarts, "restart"),
            (device.jumps, "jump"),
        ):
            if count:
                self._note(key, _TIME[key])
        if self._compare and self._fit.span > _RATE_AFTER:
            text = _wrong_clock(1.0 / self._assembler.period, self._fit.rate)
            if text:
                self._note("clock", text)

    def _note(self, key: str, text: str) -> None:
        self._notes.setdefault(key, text)


_FIELDLESS = (
    "No number (NaN, or nothing) comes for the magnetometer: it is left out; check the sensor's "
    "wiring and the sketch."
)
_MALFORMED = (
    "More than one line in a hundred cannot be read (cut short, columns missing): check the cable "
    "and the speed, and that no other program reads the port."
)
_LOST = (
    "More than one sample in a hundred is missing: lower the sampling rate or raise the speed of "
    "the port (--baud), and print less per sample."
)
_TIME = {
    "wrap": "The device's time began again at zero because its counter was full: that is "
    "understood and nothing is lost.",
    "restart": "The device's time went back: it has restarted. What was complete is kept; hold "
    "still again.",
    "jump": "The device's time jumped by more than an hour: a garbled line, or a clock that was "
    "set. Times go on after a gap; a hold or rotation across it is taken again.",
}


def _wrong_clock(device: float, host: float) -> str:
    """The device's rate against the rate at which its samples arrive.

    Samples that arrive faster than the device's time says are no fault: so does a source that
    is played faster than it was.
    """
    ratio = device / host if host else 1.0
    units = (("ms", 1e-3), ("us", 1e-6))
    unit = next((name for name, size in units if abs(ratio / size - 1) < 0.2), "")
    if ratio < 1.05 and not unit:
        return ""
    advice = (
        f"the time column is probably in {unit}: set its unit"
        if unit
        else "its clock or the unit of its time is wrong, and so would be every angle"
    )
    return (
        f"By its own time the device sends {device:.5g} samples/s, but {host:.5g} arrive: {advice}."
    )
