"""How often standard errors hold the truth: ``python -m benchmarks.coverage [repetitions]``.

Simulated experiments with known truth; for each the share of parameters within the 95 % interval by
Student's t, the same of the biases alone, within ±1.96 standard errors, and the rms of error over
standard error (1 is honest). Sessions "under" a noise have it from the first rest to the last, in
the holds and in the turns: white, or with a bias that wanders by as much as a consumer sensor's or
by four times that. The simulator is the tests' own and shares no formula with the solver.
"""

import sys
from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from benchmarks.measure import Wanted
from imucal_wizard.core.poses import DIRECTIONS
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.gyroscope_report import fit_gyroscope
from imucal_wizard.estimate.parameters import full_parameters, triangular_parameters
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.estimate.result import SensorFit
from tests.estimate.motions import hand_turns, recorded
from tests.estimate.truth import (
    EIGHTEEN,
    SIX,
    TWENTY_SIX,
    holds_of,
    random_triangular,
    tilted,
    turn,
    typical_gyroscope,
)
from tests.estimate.wandering import wandering

GRAVITY = 9.80665
SIGMA = 3e-3
"""Noise of a hold, m/s²: 0.3 mg."""
HEMISPHERE = np.array([up for up in DIRECTIONS.values() if up[2] >= 0.0])

Trial = tuple[SensorFit, dict[str, float]]
"""A fit and the true parameters."""


def accelerometer(up: FloatArray, method: str, rng: np.random.Generator) -> Trial:
    """One experiment with an accelerometer drawn anew."""
    truth = random_triangular(rng)
    noise = SIGMA * rng.standard_normal((len(up), 3))
    holds = holds_of(truth, tilted(up, 1.0, rng), noise=noise, sigma=SIGMA)
    fit = fit_accelerometer(holds, GRAVITY, "m/s^2", method)
    return fit, triangular_parameters(truth.matrix, truth.bias)


def gyroscope(count: int, force_sigma: float, rate_sigma: float, rng: np.random.Generator) -> Trial:
    """One experiment with ``count`` turns about each axis and an accelerometer drawn anew."""
    poses = [turn(up, np.array([1.5, 0.4, 0.7]), rate=25.0) for up in tilted(EIGHTEEN, 2.0, rng)]
    gyro = typical_gyroscope()
    holds, rotations = recorded(
        [*poses[:9], *hand_turns(count, rng, rate=25.0)],
        random_triangular(rng),
        gyro,
        rng,
        force_sigma=force_sigma,
        rate_sigma=rate_sigma,
    )
    found = fit_accelerometer(holds, GRAVITY, "m/s^2")
    fit = fit_gyroscope(holds, rotations, found, "rad/s").fit
    if fit is None:
        raise SystemExit("a simulated gyroscope was not fitted")
    return fit, full_parameters(gyro.matrix, gyro.bias)


def under_noise(sensor: str, turns: int, instability: float, rng: np.random.Generator) -> Trial:
    """One session of a consumer sensor, or of one whose bias wanders more or not at all."""
    session = wandering(turns, instability, rng)
    found = fit_accelerometer(session.holds, GRAVITY, "m/s^2")
    if sensor == "accelerometer":
        return found, triangular_parameters(session.accelerometer.matrix, session.mean_bias[:3])
    fit = fit_gyroscope(session.holds, session.rotations, found, "rad/s").fit
    if fit is None:
        raise SystemExit("a simulated gyroscope was not fitted")
    return fit, full_parameters(session.gyroscope.matrix, session.mean_bias[3:])


def shares(trials: Iterator[Trial], repeats: bool) -> tuple[float, float, float, float, int]:
    """Share within t, of biases, within ±1.96; rms error in standard errors; freedom."""
    off, reach, bias, freedom = [], [], [], 0
    for fit, truth in trials:
        own = fit.repeatability
        freedom = own.freedom if repeats and own is not None else fit.degrees_of_freedom
        for parameter in fit.parameters:
            error = parameter.standard_error_repeats if repeats else parameter.standard_error
            if error:
                off.append(abs(parameter.value - truth[parameter.name]) / error)
                reach.append(quantile(0.95, freedom))
                bias.append(parameter.name.startswith("bias"))
    away = np.array(off)
    held = away < np.array(reach)
    rms = float(np.sqrt((away**2).mean()))
    return float(held.mean()), float(held[bias].mean()), float((away < 1.96).mean()), rms, freedom


def main(repetitions: int = 400) -> None:
    """Print the table."""
    rng = np.random.default_rng(0)
    print(
        f"{repetitions} repetitions each; 95 % by t has a binomial spread of "
        f"{100 * np.sqrt(0.95 * 0.05 / repetitions):.1f} % per parameter"
    )
    print(f"{'experiment':46}{'dof':>5}{'by t':>8}{'biases':>8}{'±1.96':>8}{'rms':>7}")
    designs = {
        "18 poses": EIGHTEEN,
        "26 poses": TWENTY_SIX,
        "18 poses, faces twice": np.concatenate([EIGHTEEN, SIX]),
        "17 poses of one hemisphere": HEMISPHERE,
    }
    rows: dict[str, tuple[Callable[[], Trial], bool]] = {}
    for name, up in designs.items():
        for method in ("least_squares", "newton"):
            rows[f"{name}, {method}"] = partial(accelerometer, up, method, rng), False
    twice = designs["18 poses, faces twice"]
    from_repeats = partial(accelerometer, twice, "least_squares", rng)
    rows["18 poses, faces twice, from the repeats"] = from_repeats, True
    for count in (3, 6, 18):
        some = partial(gyroscope, count, SIGMA / 10.0, 1.25e-3, rng)
        rows[f"gyroscope, {count} turns per axis"] = some, False
    poor = partial(gyroscope, 6, 2.0 * SIGMA, 1e-4, rng)
    rows["gyroscope, 6 turns, poor accelerometer"] = poor, False
    for noise, instability in {"white": 0.0, "flicker": 1.0, "strong flicker": 4.0}.items():
        for sensor, turns in (("accelerometer", 0), ("accelerometer", 6), ("gyroscope", 6)):
            session = partial(under_noise, sensor, turns, instability, rng)
            rows[f"{sensor}, {turns} turns, under {noise}"] = session, False
    wanted = Wanted()
    for name, (trial, repeats) in rows.items():
        inside, bias, normal, rms, freedom = shares((trial() for _ in range(repetitions)), repeats)
        shown = "".join(f"{100.0 * share:7.1f}%" for share in (inside, bias, normal))
        print(f"{name:46}{freedom:5}{shown}{rms:7.2f}", flush=True)
        doubt = 100.0 * np.sqrt(0.95 * 0.05 / repetitions)
        wanted.figure(f"{name}: by t", 100.0 * inside, 93.0, 97.0, doubt)
    print(wanted)


if __name__ == "__main__":
    main(*(int(word) for word in sys.argv[1:]))
