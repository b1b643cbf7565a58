"""The gyroscope on a rate table: Q's 18 configurations, and what its errors are worth.

``python -m benchmarks.rate_table`` records Q's two sensors in nine mountings (three faces, six
edges, each a few degrees off) at five rates up to 150 °/s in both senses, with white and flicker
noise and rounding, and fits each recording as ``fit --rates`` does. It prints, for each parameter,
mean and scatter over the recordings against the truth (Q's table III-B; the true bias is its mean
over the recording), the share of 95 % intervals that hold the truth, and the scatter over the bound
that white noise sets, which is that of the magnitudes and the rests.
"""

import argparse
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.q_cases import BNO055, RATE, XSENS, Case
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.units import STANDARD_GRAVITY
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.recording import FitOptions, fit_readings
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.simulate.noise import RandomStream, SensorNoise, generator
from imucal_wizard.simulate.sensor import DEGREE

RATES_DEG = (30.0, 60.0, 90.0, 120.0, 150.0)
STEP_SECONDS, REST_SECONDS, RAMP_SECONDS, CHANGE_SECONDS = 10.0, 5.0, 1.0, 10.0
MOUNTING_ERROR = 3.0 * DEGREE
PAPER = {
    "bias_x": (-0.0484, 0.0031), "bias_y": (0.0640, 0.0067), "bias_z": (0.0549, 0.0049),
    "scale_x": (0.9770, 0.0005), "scale_y": (0.9822, 0.0005), "scale_z": (0.9766, 0.0005),
}  # fmt: skip
"""Q's table III-B: mean and standard deviation; °/s and corrections."""


def mountings(rng: np.random.Generator) -> FloatArray:
    """The table's axis in the body: three faces and six edges, by hand, shape (9, 3)."""
    one = np.eye(3)
    edges = [one[k] + sign * one[(k + 1) % 3] for k in range(3) for sign in (1.0, -1.0)]
    found = np.array([*one, *edges])
    found /= np.linalg.norm(found, axis=1)[:, None]
    found += MOUNTING_ERROR * rng.standard_normal(found.shape)
    return np.asarray(found / np.linalg.norm(found, axis=1)[:, None])


def profile(rates: tuple[float, ...] = RATES_DEG, seconds: float = STEP_SECONDS) -> FloatArray:
    """Rate of the table over one mounting: rest, up in one sense, rest, the other, rest, rad/s."""
    nodes = [0.0, *rates, 0.0, *(-rate for rate in rates), 0.0]
    parts: list[FloatArray] = []
    for before, now in zip([0.0, *nodes], nodes, strict=False):
        ramp = np.linspace(before, now, round(RAMP_SECONDS * RATE), endpoint=False)
        still = np.full(round((seconds if now else REST_SECONDS) * RATE), now)
        parts += [ramp, still] if before != now else [still]
    return np.concatenate(parts) * DEGREE


def table_recording(
    case: Case,
    seed: int,
    rates: tuple[float, ...] = RATES_DEG,
    seconds: float = STEP_SECONDS,
    white: bool = False,
) -> tuple[Readings, FloatArray]:
    """One recording of all mountings, whose changes were not recorded, and its mean bias.

    Args:
        case: the device.
        seed: of mountings and noise.
        rates: of the table, °/s.
        seconds: in each step.
        white: leave out flicker noise.
    """
    rng, course = np.random.default_rng([seed, 77]), profile(rates, seconds)
    density, floor = np.full(3, case.gyroscope.density), np.full(3, case.gyroscope.floor)
    stream = generator(seed, RandomStream.NOISE)
    noise = SensorNoise(stream, RATE, density, floor * (not white))
    times, gyroscope, force, wander = [], [], [], []
    length = len(course) / RATE + CHANGE_SECONDS
    for number, axis in enumerate(mountings(rng)):
        times.append(np.arange(len(course)) / RATE + number * length)
        own = noise.take(len(course))
        gyroscope.append(case.gyroscope.reading(course[:, None] * axis, own))
        wander.append(own.mean(axis=0))
        quiet = case.accelerometer.density * np.sqrt(RATE / 2.0)
        felt = STANDARD_GRAVITY * axis + quiet * rng.standard_normal((len(course), 3))
        force.append(case.accelerometer.reading(felt))
        noise.take(round(CHANGE_SECONDS * RATE))
    time, gain = np.concatenate(times), float(np.mean(np.diag(case.gyroscope.sensitivity)))
    readings = Readings(
        Series(time, np.concatenate(force), case.accelerometer.unit),
        Series(time, np.concatenate(gyroscope), case.gyroscope.unit),
    )
    return readings, case.gyroscope.bias + gain * np.mean(wander, axis=0)


def joined(first: Readings, later: Readings) -> Readings:
    """Two recordings of one session, the second ten seconds after the first."""
    shift = float(first.accelerometer.time[-1]) + CHANGE_SECONDS

    def both(one: Series | None, two: Series | None) -> Series | None:
        if one is None or two is None:
            return None
        time = np.concatenate([one.time, two.time + shift])
        return Series(time, np.concatenate([one.values, two.values]), one.unit)

    force = both(first.accelerometer, later.accelerometer) or first.accelerometer
    return Readings(force, both(first.gyroscope, later.gyroscope))


def fit_table(
    readings: Readings, rates: tuple[float, ...] = RATES_DEG, gravity: bool = False
) -> SensorFit:
    """The gyroscope by its table.

    Args:
        readings: the recording.
        rates: of the table, °/s.
        gravity: use the accelerometer, too, where it shows how the gyroscope lies.
    """
    if not gravity:
        readings = replace(readings, accelerometer=Series(np.zeros(0), np.zeros((0, 3)), "m/s^2"))
    options = FitOptions(rates=tuple(DEGREE * rate for rate in rates))
    return fit_readings(readings, options).sensors["gyroscope"]


def matrix_of(values: FloatArray) -> FloatArray:
    """M = K T (Q, eq. 5 to 8) of three sensitivities and three angles."""
    yz, zy, zx = values[3:]
    angles = np.array([[1.0, yz, yz * zx - zy], [0.0, 1.0, zx], [0.0, 0.0, 1.0]])
    return np.asarray(angles / values[:3, None])


def truth(case: Case) -> dict[str, float]:
    """The parameters of a device whose axes are at right angles."""
    sensitivities = np.diag(case.gyroscope.sensitivity)
    return {
        **dict(zip(("bias_x", "bias_y", "bias_z"), case.gyroscope.bias.tolist(), strict=True)),
        **{f"sensitivity_{a}": float(one) for a, one in zip("xyz", sensitivities, strict=True)},
        **dict.fromkeys(("theta_yz", "theta_zy", "theta_zx"), 0.0),
    }


def bound(case: Case, seed: int) -> FloatArray:
    """Least standard deviation of each parameter by white noise in one recording, shape (9,)."""
    axes, device = mountings(np.random.default_rng([seed, 77])), case.gyroscope
    rates = np.repeat([*RATES_DEG, *(-rate for rate in RATES_DEG)], len(axes)) * DEGREE
    true = rates[:, None] * np.tile(axes, (2 * len(RATES_DEG), 1)) @ device.sensitivity.T

    def predicted(values: FloatArray) -> FloatArray:
        matrix, moved = matrix_of(values[3:]), device.bias - values[:3]
        rests = np.tile(matrix @ moved, len(axes))
        return np.concatenate([np.linalg.norm((true + moved) @ matrix.T, axis=1), rests])

    start = np.array(list(truth(case).values()))
    size = float(np.mean(np.diag(device.sensitivity)))
    steps = np.diag(1e-5 * np.array([size] * 6 + [1.0] * 3))
    slopes = [(predicted(start + d) - predicted(start - d)) / (2.0 * d.sum()) for d in steps]
    seconds = [STEP_SECONDS] * len(true) + [3.0 * REST_SECONDS] * (3 * len(axes))
    white = np.array(slopes) * np.sqrt(2.0 * np.array(seconds)) / device.density
    # scaled, so that counts and radians are inverted alike
    units = np.sqrt((white**2).sum(axis=1))
    covariance = np.linalg.inv((white / units[:, None]) @ (white / units[:, None]).T)
    return np.asarray(np.sqrt(np.diag(covariance)) / units, np.float64)


@dataclass(frozen=True, eq=False)
class Table:
    """What many recordings of one device gave.

    Attributes:
        names: of the parameters.
        errors: found less true, shape (recordings, 9).
        standard_errors: shape (recordings, 9).
        inside: which 95 % intervals hold the truth, shape (recordings, 9).
        bounds: shape (recordings, 9).
    """

    names: tuple[str, ...]
    errors: FloatArray
    standard_errors: FloatArray
    inside: FloatArray
    bounds: FloatArray

    @property
    def over_bound(self) -> FloatArray:
        """Rms error over the bound, of each parameter, shape (9,)."""
        return np.asarray(np.sqrt(((self.errors / self.bounds) ** 2).mean(axis=0)))


def study(case: Case, recordings: int, seed: int, white: bool = False) -> Table:
    """Many recordings of one device, each with its own mountings and noise."""
    true, rows = truth(case), []
    for one in range(seed, seed + recordings):
        readings, bias = table_recording(case, one, white=white)
        true |= dict(zip(("bias_x", "bias_y", "bias_z"), bias.tolist(), strict=True))
        fit = fit_table(readings)
        reach = quantile(0.95, fit.degrees_of_freedom)
        found = {parameter.name: parameter for parameter in fit.parameters}
        error = np.array([found[name].value - true[name] for name in true])
        doubt = np.array([found[name].standard_error or np.nan for name in true])
        rows.append((error, doubt, np.abs(error) <= reach * doubt, bound(case, one)))
    errors, doubts, inside, bounds = (np.array(column) for column in zip(*rows, strict=True))
    return Table(tuple(true), errors, doubts, inside, bounds)


def print_study(case: Case, found: Table, noise: str) -> None:
    """A line for each parameter."""
    recordings, true = len(found.errors), truth(case)
    print(f"\n== {case.name}: {recordings} recordings of 18 configurations, {noise}")
    print(
        f"{'':15}{'truth':>11}{'mean':>13}{'scatter':>11}{'standard':>11}{'over the':>10}"
        f"{'intervals':>11}"
    )
    print(f"{'':38}{'':>12}{'error':>11}{'bound':>10}{'of 95 %':>11}")
    for k, name in enumerate(found.names):
        values = true[name] + found.errors[:, k]
        print(
            f"{name:15}{true[name]:11.6g}{values.mean():13.6g}{found.errors[:, k].std():11.2g}"
            f"{np.sqrt((found.standard_errors[:, k] ** 2).mean()):11.2g}"
            f"{found.over_bound[k]:10.2f}{100.0 * found.inside[:, k].mean():9.1f} %"
        )
    print(f"all intervals: {100.0 * found.inside.mean():.1f} % hold the truth")


def print_table_three(found: Table) -> None:
    """Q's table III-B beside what these recordings of its result give."""
    print("\nQ's table III-B (°/s, corrections): mean ± standard deviation of the paper, ours")
    true = np.array(list(truth(BNO055).values()))
    values = true + found.errors
    for k, (name, (mean, deviation)) in enumerate(PAPER.items()):
        own = values[:, k] / DEGREE if k < 3 else 1.0 / values[:, k]
        print(f"{name:9}{mean:9.4f} ± {deviation:.4f}{own.mean():10.5f} ± {own.std():.5f}")


def main() -> None:
    """Both devices; white noise alone for the bound, then with flicker noise."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.rate_table")
    parser.add_argument("--recordings", type=int, default=60)
    parser.add_argument("--seed", type=int, default=4100)
    given = parser.parse_args()
    for case in (BNO055, XSENS):
        for white in (True, False):
            found = study(case, given.recordings, given.seed + 1000 * white, white)
            print_study(case, found, "white noise" if white else "white and flicker noise")
            if case is BNO055 and not white:
                print_table_three(found)


if __name__ == "__main__":
    main()
