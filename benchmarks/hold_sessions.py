"""Sessions of holds with known truth and known noise, drawn sample by sample.

A sensor reads ``y = S x + b``; in every hold white noise is added to each sample, an offset to the
whole hold, and a bias that wanders through the session. No formula is shared with the estimator:
flicker noise is shaped by a Fourier transform, a random walk is a sum of steps, and the bound on
the scatter of parameters follows from numerical derivatives of the magnitude at the truth.
"""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.measurement.blocks import BlockCutter
from imucal_wizard.measurement.holds import Hold, hold_from

GRAVITY = 9.80665
MG = 1e-3 * GRAVITY
MOVED = 4.0
"""Seconds from one hold to the next."""
STEP = 0.1
"""Seconds between the moments at which a wandering bias is drawn."""
FACES = [[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]
EDGES = [[i, j, 0] for i in (1, -1) for j in (1, -1)]
EDGES = [np.roll(edge, turn).tolist() for turn in range(3) for edge in EDGES]
CORNERS = [[i, j, k] for i in (1, -1) for j in (1, -1) for k in (1, -1)]
DESIGNS = {
    "18": np.array(FACES + EDGES, float),
    "26 + 12": np.array(FACES + EDGES + CORNERS + FACES + EDGES[:6], float),
}
"""Poses in their order: the second design measures twelve of them a second time."""


@dataclass(frozen=True)
class Noise:
    """What is added to the readings of an ideal sensor.

    Attributes:
        white: standard deviation of a sample, m/s².
        uneven: standard deviation of the logarithm of that from hold to hold.
        scatter: standard deviation of an offset of each hold on each axis, m/s².
        flicker: Allan deviation at 10 s of a bias with the power spectrum 1/f, m/s².
        walk: of a bias that walks at random, m/s²/√s.
        across_chip: white noise of z over that of x and y.
    """

    white: float = 0.75 * MG
    uneven: float = 0.0
    scatter: float = 0.0
    flicker: float = 0.0
    walk: float = 0.0
    across_chip: float = 1.0


@dataclass(frozen=True, eq=False)
class Session:
    """What was measured, and the truth.

    Attributes:
        holds: still periods.
        readings: their samples.
        sensitivity: S, upper triangular, shape (3, 3).
        bias: b and the mean of the wandering over the session, shape (3,).
        up: directions of gravity, shape (n, 3).
        variance: of each component of each hold's mean by white noise and offsets, shape (n, 3).
        noise: what was added.
    """

    holds: list[Hold]
    readings: Readings
    sensitivity: FloatArray
    bias: FloatArray
    up: FloatArray
    variance: FloatArray
    noise: Noise

    def new_readings(self, number: int, rng: np.random.Generator) -> FloatArray:
        """Means of new holds as long as those of the session, anywhere, shape (number, 3).

        Slow noise is left out: of it new holds have what another session has.
        """
        up = rng.standard_normal((number, 3))
        up /= np.linalg.norm(up, axis=1)[:, None]
        sigma = self.noise.white * np.exp(self.noise.uneven * rng.standard_normal(number))
        samples = np.median([hold.samples for hold in self.holds])
        off = sigma[:, None] * [1.0, 1.0, self.noise.across_chip] / np.sqrt(samples)
        off = np.hypot(off, self.noise.scatter) * rng.standard_normal((number, 3))
        return np.asarray(GRAVITY * up @ self.sensitivity.T + self.bias + off)

    @property
    def truth(self) -> FloatArray:
        """The nine parameters in the order of the report."""
        return parameters(np.asarray(np.linalg.inv(self.sensitivity), np.float64), self.bias)

    def bound(self) -> FloatArray:
        """Least standard deviation of each parameter by any unbiased estimator, shape (9,)."""
        matrix = np.linalg.inv(self.sensitivity)
        places = np.triu_indices(3)
        start = np.concatenate([self.bias, matrix[places]])
        readings = GRAVITY * self.up @ self.sensitivity.T + self.bias

        def model(x: FloatArray) -> tuple[FloatArray, FloatArray]:
            inverse = np.zeros((3, 3))
            inverse[places] = x[3:]
            return np.linalg.norm((readings - x[:3]) @ inverse.T, axis=1), parameters(
                inverse, x[:3]
            )

        magnitudes, named = np.empty((len(self.up), 9)), np.empty((9, 9))
        for k in range(9):
            ahead, behind = (model(start + sign * 1e-5 * np.eye(9)[k]) for sign in (1.0, -1.0))
            magnitudes[:, k] = (ahead[0] - behind[0]) / 2e-5
            named[:, k] = (ahead[1] - behind[1]) / 2e-5
        along = ((self.up @ matrix) ** 2 * self.variance).sum(axis=1)
        covariance = np.linalg.inv(magnitudes.T @ (magnitudes / along[:, None]))
        return np.sqrt(np.diag(named @ covariance @ named.T))


def parameters(matrix: FloatArray, bias: FloatArray) -> FloatArray:
    """Biases, sensitivities and the three angles of ``M = K T`` (Qureshi and Golnaraghi, eq. 8)."""
    zy = matrix[1, 2] / matrix[1, 1]
    yz = matrix[0, 1] / matrix[0, 0]
    y = yz * zy - matrix[0, 2] / matrix[0, 0]
    return np.array([*bias, *(1.0 / np.diag(matrix)), yz, y, zy])


NAMES = (
    *(f"bias_{axis}" for axis in "xyz"),
    *(f"sensitivity_{axis}" for axis in "xyz"),
    *("theta_yz", "theta_zy", "theta_zx"),
)


def session(
    design: FloatArray,
    noise: Noise,
    rng: np.random.Generator,
    seconds: float = 3.0,
    rest: float = 0.0,
    rate: float = 50.0,
) -> Session:
    """One session with a sensor drawn anew.

    Args:
        design: directions of gravity as planned; a hand misses each by about a degree.
        noise: of the sensor.
        rng: where chance comes from.
        seconds: duration of each hold.
        rest: duration of a long rest in the last direction after all, s; 0 for none.
        rate: samples per second.
    """
    up = design / np.linalg.norm(design, axis=1)[:, None]
    up = up + np.radians(1.0) * rng.standard_normal(up.shape)
    durations = np.full(len(up), seconds)
    if rest:
        up, durations = np.concatenate([up, up[-1:]]), np.append(durations, rest)
    up /= np.linalg.norm(up, axis=1)[:, None]
    matrix = np.diag(rng.uniform(0.95, 1.05, 3))
    matrix[np.triu_indices(3, 1)] = rng.uniform(-0.035, 0.035, 3)
    sensitivity, bias = np.asarray(np.linalg.inv(matrix), np.float64), rng.uniform(-0.6, 0.6, 3)
    starts = np.concatenate([[0.0], np.cumsum(durations + MOVED)])[:-1]
    moments = round((starts[-1] + durations[-1]) / STEP)
    wandering = wander(noise, moments, rng)
    sigma = noise.white * np.exp(noise.uneven * rng.standard_normal(len(up)))
    sigma = sigma[:, None] * [1.0, 1.0, noise.across_chip]
    holds, parts, variance = [], [], np.empty((len(up), 3))
    for k, start in enumerate(starts):
        count = round(durations[k] * rate)
        time = start + np.arange(count) / rate
        slow = wandering[np.minimum((time / STEP).astype(int), moments - 1)]
        offset = noise.scatter * rng.standard_normal(3)
        values = sensitivity @ (GRAVITY * up[k]) + bias + offset + slow
        values = values + sigma[k] * rng.standard_normal((count, 3))
        readings = Readings(Series(time, values, "m/s^2"))
        hold = hold_from(BlockCutter(rate).feed(readings))
        variance[k] = sigma[k] ** 2 / hold.samples + noise.scatter**2
        holds.append(hold)
        parts.append(readings.accelerometer)
    whole = Series(
        np.concatenate([part.time for part in parts]),
        np.concatenate([part.values for part in parts]),
        "m/s^2",
    )
    bias = bias + wandering.mean(axis=0)
    return Session(holds, Readings(whole), sensitivity, bias, up, variance, noise)


def wander(noise: Noise, moments: int, rng: np.random.Generator) -> FloatArray:
    """The wandering bias of each axis, every ``STEP`` seconds, shape (moments, 3)."""
    steps = noise.walk * np.sqrt(STEP) * rng.standard_normal((moments, 3))
    out = np.cumsum(steps, axis=0)
    if noise.flicker:
        # four times as long, so that the ends of the session do not know of each other
        frequencies = np.fft.rfftfreq(4 * moments, STEP)[1:]
        spectrum = rng.standard_normal((len(frequencies), 3, 2)) @ np.array([1.0, 1.0j])
        # Allan deviation of the power h/f is √(2 ln 2 · h) (IEEE 952, annex C)
        size = noise.flicker / np.sqrt(2.0 * np.log(2.0))
        # one-sided power h/f; irfft divides by the number of moments
        shaped = spectrum * size / np.sqrt(frequencies)[:, None]
        shaped *= 0.5 * np.sqrt(4 * moments / STEP)
        whole = np.fft.irfft(np.concatenate([np.zeros((1, 3)), shaped]), 4 * moments, axis=0)
        out = out + whole[:moments]
    return np.asarray(out)
