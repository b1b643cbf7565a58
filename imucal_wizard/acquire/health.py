"""Checks of a live stream; collects each warning once."""

from collections import deque

from imucal_wizard.acquire.assemble import Assembler
from imucal_wizard.acquire.host_clock import RateFit
from imucal_wizard.acquire.resolve import sensor_places
from imucal_wizard.core import units
from imucal_wizard.core.readings import Readings, join_readings
from imucal_wizard.measurement import clipping, data_quality

_CHECKED_SECONDS = 2.0
"""Length of the checked windows, s: long enough for a rest, short enough for a timely warning."""
_DEAD_AXIS_WINDOWS = 5
"""Windows without any change after which an axis is dead."""
_MIN_RATE_SECONDS = 8.0
"""Seconds of arrivals after which the rate of arrival is accurate enough for a comparison."""
MAX_ARRIVAL_GAP_SECONDS = 0.5
"""s; after a longer gap in the arrivals, the rate of arrival is measured again."""
_MIN_DAMAGED = 5
"""Damaged samples below which there is no warning."""
_MIN_FIELDLESS_SAMPLES = 500
"""Samples after which a sensor without any number is missing and not just slow."""
_MAX_DAMAGED_SHARE = 0.01
"""Share of lost or malformed samples above which there is a warning."""
_MAX_RATE_RATIO = 1.05
"""Ratio of the device's rate to that of arrival above which its clock or unit is wrong."""
_MIN_SHARE_SAMPLES = 100
"""Samples needed before a share can cause a warning."""


class StreamHealth:
    """The checks of a live stream. The windows are cut by sample, never by chunk.

    Args:
        assembler: source of the samples; its counters are checked.
        compare_arrivals: compare the device's time with the host's; False if a recording is played,
            or played faster.
        values: check the values as well; False if the whole recording is checked later.
        losses: count what was lost and damaged as well; False for a recording.
    """

    def __init__(
        self,
        assembler: Assembler,
        compare_arrivals: bool = True,
        *,
        values: bool = True,
        losses: bool = True,
    ) -> None:
        self._assembler = assembler
        self._losses = losses
        self._values = values
        self._compare = compare_arrivals and assembler.device is not None
        self._fit = RateFit()
        self._arrival = 0.0
        self._waiting: list[Readings] = []
        self._count = 0
        self._windows: deque[Readings] = deque(maxlen=_DEAD_AXIS_WINDOWS)
        self._notes: dict[str, str] = {}
        self._decimals: tuple[int, ...] = ()
        self._size = 0

    @property
    def notes(self) -> tuple[str, ...]:
        """The warnings so far, each kind once, in order."""
        return tuple(self._notes.values())

    def signs_known(self) -> None:
        """The signs of counts are known: take back the warning that they may be wrong."""
        self._notes.pop(data_quality.unsigned_counts.__name__, None)

    def feed(self, readings: Readings, arrival: float, since: float) -> None:
        """Check new samples.

        Args:
            readings: the samples.
            arrival: arrival of the last bytes, s.
            since: arrival of the first bytes, s.
        """
        if self._values:
            self._waiting.append(Readings(readings.accelerometer, readings.gyroscope))
            self._count += len(readings)
            self._size = self._size or max(
                _MIN_SHARE_SAMPLES, round(_CHECKED_SECONDS / self._assembler.period)
            )
            if self._count >= self._size:
                self._cut(self._size)
        if self._compare:
            if since - self._arrival > MAX_ARRIVAL_GAP_SECONDS:  # the device was away
                self._fit = RateFit()
            self._arrival = arrival
            self._fit.add(self._assembler.samples + self._assembler.lost, arrival)

    def count(self, malformed: int, decimals: tuple[int, ...]) -> None:
        """Check the numbers of lost and malformed samples, and the printed digits."""
        self._clock()
        total = self._assembler.samples
        missing = self._assembler.missing
        if total >= _MIN_FIELDLESS_SAMPLES and self._assembler.fieldless:
            self._note("field", _FIELDLESS)
        if not self._losses:
            return
        if (
            total >= _MIN_SHARE_SAMPLES
            and malformed
            and malformed + missing.count >= max(_MIN_DAMAGED, _MAX_DAMAGED_SHARE * total)
        ):
            self._note("malformed", _MALFORMED)
        if missing.count >= _MIN_DAMAGED:
            self._note("nan", missing.note)
        # a split line also damages its neighbour, and both are missing by the device's time
        dropped = self._assembler.dropped - 2 * malformed - missing.count
        if total >= _MIN_SHARE_SAMPLES and dropped >= max(_MIN_DAMAGED, _MAX_DAMAGED_SHARE * total):
            self._note("lost", _LOST)
        self._decimals = decimals

    def _cut(self, size: int) -> None:
        """Check the complete windows, and keep the rest."""
        whole = join_readings(self._waiting)
        used = len(whole) // size * size
        for start in range(0, used, size):
            self._look(whole.inertial_part(start, start + size))
        rest = whole.inertial_part(used, len(whole))
        self._waiting = [rest] if len(rest) else []
        self._count = len(rest)

    def _look(self, window: Readings) -> None:
        for check in data_quality.READINGS_CHECKS:
            self._note(check.__name__, check(window))
        for sensor, series in data_quality.inertial_sensors(window):
            self._note(f"clipped {sensor}", clipping.clipped_range(sensor, series, short=True))
            if not self._windows:
                text = data_quality.coarse_steps(sensor, series, self._printed_step(sensor))
                self._note(f"coarse {sensor}", text)
        self._windows.append(window)
        if len(self._windows) < _DEAD_AXIS_WINDOWS:
            return
        joined = join_readings(list(self._windows))
        for sensor, series in data_quality.inertial_sensors(joined):
            if f"coarse {sensor}" not in self._notes:  # a coarse axis may be constant
                self._note(f"dead {sensor}", data_quality.dead_axes(sensor, series))

    def _printed_step(self, sensor: str) -> float | None:
        """The step of the printed digits in the unit of the samples; None if not text."""
        columns = self._assembler.columns
        places = [p for p in sensor_places(columns, sensor) if p < len(self._decimals)]
        most = max((self._decimals[p] for p in places), default=-1)
        if most < 0:
            return None
        return float(10.0**-most * units.unit_factor(sensor, columns[places[0]].unit))

    def _clock(self) -> None:
        device = self._assembler.device
        if self._assembler.counter_restarts:
            self._note("counter", _COUNTER)
        if device is None:
            return
        for count, key in (
            (device.wraps, "wrap"),
            (device.restarts, "restart"),
            (device.jumps, "jump"),
        ):
            if count:
                self._note(key, _TIME[key])
        if self._compare and self._fit.span > _MIN_RATE_SECONDS:
            text = _wrong_clock(1.0 / self._assembler.period, self._fit.rate)
            if text:
                self._note("clock", text)

    def _note(self, key: str, text: str) -> None:
        if text:
            self._notes.setdefault(key, text)


_FIELDLESS = (
    "No numbers (NaN or empty) arrive for the magnetometer: it is left out. Check the sensor's "
    "wiring and the sketch."
)
_MALFORMED = (
    "More than one line or frame in a hundred cannot be read (cut short, or damaged): check the "
    "cable and the speed, and that no other program reads the port."
)
_LOST = (
    "More than one sample in a hundred is missing: lower the sampling rate or raise the speed of "
    "the port, and print less per sample."
)
_COUNTER = (
    "The sample counter went back: the device has restarted, or recordings were joined. The "
    "following samples begin after a gap."
)
_TIME = {
    "wrap": "The device's time restarted at zero because its counter was full. Time "
    "continues without a gap.",
    "restart": "The device's time went back: it has restarted, its clock was set back, its counter "
    "began again, or recordings were joined. Time continues after a gap; a hold or rotation across "
    "it must be repeated.",
    "jump": "The device's time jumped by more than an hour: a garbled line, or a clock that was "
    "set. Time continues after a gap; a hold or rotation across it must be repeated.",
}


def _wrong_clock(device: float, host: float) -> str:
    """Warning if the device's rate contradicts the rate of arrival, or "".

    Samples that arrive faster than by the device's time are not a fault: the source may be played
    faster.
    """
    ratio = device / host if host else 1.0
    mistaken = (("ms", 1e-3), ("us", 1e-6))
    unit = next((name for name, size in mistaken if abs(ratio / size - 1) < 0.2), "")
    if ratio < _MAX_RATE_RATIO and not unit:
        return ""
    advice = (
        f"the time column is probably in {unit}: set its unit"
        if unit
        else "its clock or the unit of its time is wrong, which would make every angle wrong"
    )
    return (
        f"By its own time the device sends {device:.5g} samples/s, but {host:.5g} arrive: {advice}."
    )
