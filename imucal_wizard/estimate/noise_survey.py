"""Noise of all sensors of a device that rests for hours, with the temperature.

The readings come in pieces, from a file or a port, and are not kept.
"""

from dataclasses import replace

import numpy as np

from imucal_wizard.core.errors import DataError, RecordingError
from imucal_wizard.core.gravity import median_magnitude
from imucal_wizard.core.limits.stillness import MIN_SLOW_MOMENT
from imucal_wizard.core.quantities import plural
from imucal_wizard.core.readings import (
    FloatArray,
    Readings,
    Series,
    join_readings,
    origin_of_times,
)
from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.noise_coefficients import NoiseFit, fit_noise
from imucal_wizard.measurement.allan_variance import AllanVariance
from imucal_wizard.measurement.data_quality import check_recording
from imucal_wizard.measurement.resting_sensor import MovedPart, RestingSensor
from imucal_wizard.model.effect import SENSORS

CHECKED_SAMPLES = 5000
"""First samples, whose quality is checked."""
MAX_MOVED_SHARE = 0.5
"""Largest share of the seconds of a recording of a device at rest that show motion."""
MAX_COURSE = 1024
"""Most points of the temperature over time; if there are more, neighbours are averaged."""
MAX_COURSE_PIECES = 16
"""Most points from one piece of readings."""
FEELS_GRAVITY = ("accelerometer",)
KNOWN_WELL = 0.1
"""Relative standard error from which on an Allan deviation is well known."""


_MOVED = (
    "the device did not rest: the {} shows motion in {:.0f} % of the recording. Put it on a firm "
    "table, away from fans and footsteps, and leave it alone"
)


@dataclass(frozen=True, eq=False)
class SensorAtRest:
    """The noise of one sensor.

    Attributes:
        unit: of the readings.
        period: s between samples.
        allan: Allan variances of the three axes.
        fits: of each axis; empty if the recording is too short.
        disturbances: parts that were left out.
        rest: share of the recording at rest.
    """

    unit: str
    period: float
    allan: AllanVariance
    fits: list[NoiseFit]
    disturbances: tuple[MovedPart, ...]
    rest: float

    @property
    def taus(self) -> FloatArray:
        """τ of the Allan variances, s, shape (t,)."""
        return np.asarray(self.allan.lengths * self.period)

    @property
    def seconds(self) -> float:
        """Time at rest that counts, s."""
        return sum(self.allan.segments) * self.period

    def seconds_until_known(self, tau: float) -> float:
        """Time at rest after which the Allan deviation at τ has a relative error of 10 %, s.

        The relative error falls with the root of the time beyond 2τ. Beyond the longest τ that has
        an error the same number of τ is needed as there.
        """
        longest = max(self.allan.segments, default=0) * self.period
        known = np.flatnonzero(self.taus <= longest / 4.0)
        if not self.fits or not len(known):
            return 0.5 / KNOWN_WELL**2 * tau + tau  # IEEE 952: 1/√(2 (T/τ − 1))
        row = known[np.abs(np.log(self.taus[known] / tau)).argmin()]
        deviations = np.sqrt(self.allan.variance[row])
        relative = max(
            float(fit.error[row] / deviation) if deviation > 0.0 else 0.0
            for fit, deviation in zip(self.fits, deviations, strict=True)
        )
        near = float(self.taus[row])
        needed = 2.0 * near + (self.seconds - 2.0 * near) * (relative / KNOWN_WELL) ** 2
        return max(needed, 4.0 * near) * tau / near


@dataclass(frozen=True, eq=False)
class NoiseResult:
    """The noise of a device.

    Attributes:
        sensors: by name.
        seconds: length of the recording, s.
        temperature: times and temperatures, s and °C, shape (k, 2); k may be 0.
        warnings: messages to the user.
    """

    sensors: dict[str, SensorAtRest]
    seconds: float
    temperature: FloatArray
    warnings: tuple[str, ...]


class NoiseSurvey:
    """Collects the noise of a device at rest, piece by piece."""

    def __init__(self) -> None:
        self._rests: dict[str, RestingSensor] = {}
        self._units: dict[str, str] = {}
        self._first: list[Readings] = []
        self._checked: tuple[str, ...] | None = None
        self._finished: frozenset[str] = frozenset()
        self._begin, self._end = np.inf, -np.inf
        self._origin: float | None = None
        self._course: list[tuple[float, float]] = []

    @property
    def seconds(self) -> float:
        """Length so far, s."""
        return max(self._end - self._begin, 0.0)

    def next_file(self) -> None:
        """Announce another file of the same session, with other sensors."""
        self._finished = frozenset(self._rests)

    def feed(self, readings: Readings) -> None:
        """Add the readings that follow.

        Raises:
            RecordingError: an earlier file holds the same sensor.
        """
        for name in SENSORS:
            series: Series | None = getattr(readings, name)
            if series is None or not len(series):
                continue
            series = self._dated(series)
            if name in self._finished:
                raise RecordingError(
                    f"two files hold the {name}; files given together hold different sensors of one"
                    " session, so give these one at a time"
                )
            if name not in self._rests:
                if not series.rate:
                    continue  # a single sample has no rate
                self._rests[name] = RestingSensor(series.rate, _largest_sway(name, series))
                self._units[name] = series.unit
            self._rests[name].feed(series)
            self._begin = min(self._begin, float(series.time[0]))
            self._end = max(self._end, float(series.time[-1]))
        if readings.temperature is not None:
            self._warm(self._dated(readings.temperature))
        if self._checked is None:
            self._first.append(readings)
            if sum(rest.judged for rest in self._rests.values()) >= CHECKED_SAMPLES:
                self._check()

    def _dated(self, series: Series) -> Series:
        """The series with times since the first sample, if its clock counts from a date."""
        if self._origin is None and len(series):
            self._origin = origin_of_times(float(series.time[0]))
        return replace(series, time=series.time - self._origin) if self._origin else series

    def _check(self) -> None:
        together = join_readings(self._first) if self._first else None
        self._first = []
        self._checked = check_recording(together) if together and len(together) else ()

    def _warm(self, series: Series) -> None:
        for rows in np.array_split(np.arange(len(series)), MAX_COURSE_PIECES):
            if len(rows):
                mean = series.time[rows].mean(), series.values[rows, 0].mean()
                self._course.append((float(mean[0]), float(mean[1])))
        if len(self._course) >= MAX_COURSE:
            even = self._course[: len(self._course) // 2 * 2]
            pairs = np.array(even).reshape(-1, 2, 2).mean(axis=1)
            self._course = [(float(t), float(c)) for t, c in pairs]

    def result(self, *, ended: bool = True) -> NoiseResult:
        """The noise by the readings so far.

        Args:
            ended: whether no readings follow.

        Raises:
            DataError: there is too little, or the device moved most of the time.
        """
        if ended:
            for rest in self._rests.values():
                rest.finish()
        if self._checked is None:
            self._check()
        sensors = {
            name: _sensor(rest, self._units[name])
            for name, rest in self._rests.items()
            if rest.sums.readings
        }
        # a sensor that moved all the time has no noise, but it shows that the device did not rest
        moved = {n: rest.disturbed / rest.judged for n, rest in self._rests.items() if rest.judged}
        worst = max(moved, key=moved.__getitem__, default=None)
        nothing = ended and not any(one.fits for one in sensors.values())
        if worst is not None:
            # calm seconds beside disturbed ones are left out as well, and may be all
            too_little = nothing and _rest_share(self._rests[worst]) < 1.0 - MAX_MOVED_SHARE
            if moved[worst] > (0.0 if too_little else MAX_MOVED_SHARE):
                raise DataError(_MOVED.format(worst, 100.0 * moved[worst]))
        if nothing:
            raise DataError(
                f"{self.seconds:.0f} s are too short for an Allan deviation: record hours at rest, "
                "at least some minutes"
            )
        return NoiseResult(
            sensors,
            self.seconds,
            np.array(self._course).reshape(-1, 2),
            (*(self._checked or ()), *self._warnings(sensors)),
        )

    def _warnings(self, sensors: dict[str, SensorAtRest]) -> list[str]:
        found = []
        for name, rest in self._rests.items():
            if rest.filled:
                share = 100.0 * rest.filled / max(rest.judged, 1)
                found.append(
                    f"{rest.filled} samples of the {name} ({share:.2g} %) are missing and were "
                    "filled by straight lines"
                )
            if rest.gaps:
                found.append(
                    f"the {name} has {plural(rest.gaps, 'gap')} of more than "
                    f"{rest.longest_filled:g} s; nothing is joined across a gap"
                )
        for name, one in sensors.items():
            bad = [axis for axis, fit in zip("xyz", one.fits, strict=False) if fit.misfit_p < 0.01]
            if bad:
                found.append(
                    f"the {name}'s Allan deviation has more structure than white noise, bias "
                    f"instability, random walk and drift ({', '.join(bad)}), as by vibration, "
                    "warming up or steps of the bias. The standard errors allow for it"
                )
        return found


def _largest_sway(sensor: str, series: Series) -> float:
    """Sway of a hand that no table makes, reading units.

    It is known only of a sensor that feels gravity.
    """
    feels = sensor in FEELS_GRAVITY
    return MIN_SLOW_MOMENT * median_magnitude(series.values) if feels else np.inf


def _sensor(rest: RestingSensor, unit: str) -> SensorAtRest:
    allan = rest.sums.result()
    return SensorAtRest(
        unit=unit,
        period=rest.period,
        allan=allan,
        fits=fit_noise(allan, rest.period),
        disturbances=tuple(rest.disturbances),
        rest=_rest_share(rest),
    )


def _rest_share(rest: RestingSensor) -> float:
    """Share of the samples judged so far at rest."""
    return rest.sums.readings / max(rest.judged, 1)
