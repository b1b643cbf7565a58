"""A gyroscope that is known exactly: still poses, then turns, with effects in its readings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from imucal_wizard.core.attitude import rotation_samples
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.estimate.accelerometer import BASE
from imucal_wizard.estimate.gyroscope import GyroscopeExperiment
from imucal_wizard.estimate.gyroscope_fit import gyroscope_minimum
from imucal_wizard.estimate.recording import fit_accelerometer
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.estimate.variance_components import inverted
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.model.effect import Circumstances
from imucal_wizard.model.rows.source import Parameters, Rows
from imucal_wizard.model.terms import Term, Terms
from tests.estimate.motions import free_turns
from tests.estimate.truth import TWENTY_SIX, Motion, Truth, typical_accelerometer, typical_gyroscope

G = 9.80665
HOLD = 10.0
PAUSE = 2.0
DEGREE = np.pi / 180.0


@dataclass(frozen=True, eq=False)
class Course:
    """What happened, in true quantities: still directions, then turns with a rest on either side.

    Attributes:
        motions: the turns, at their times in the session.
        places: the holds at either end of each turn, shape (m, 2).
        holds: circumstances of the holds.
        inside: circumstances of the samples of each turn.
    """

    motions: list[Motion]
    places: list[tuple[int, int]]
    holds: Circumstances
    inside: list[Circumstances]


def course(turns: Sequence[Motion], still: FloatArray = TWENTY_SIX) -> Course:
    """Still directions, then these turns; the temperature swings like neither time nor pose."""
    ups = list(still / np.linalg.norm(still, axis=1)[:, None])
    starts = [(HOLD + PAUSE) * index for index in range(len(ups))]
    motions, places = [], []
    clock = starts[-1] + HOLD + PAUSE
    for one in turns:
        moved = replace(one, time=one.time - one.time[0] + clock + HOLD)
        places.append((len(ups), len(ups) + 1))
        ups += [one.up[0], one.up[-1]]
        starts += [clock, float(moved.time[-1])]
        motions.append(moved)
        clock = starts[-1] + HOLD + PAUSE
    middle = np.array(starts) + 0.5 * HOLD
    force = G * np.array(ups)
    holds = Circumstances(
        force=force,
        rate=np.zeros_like(force),
        temperature=25.0 + 8.0 * np.sin(2.1 * np.arange(len(ups))),
        time=middle,
        previous=np.vstack([np.full((1, 3), np.nan), force[:-1]]),
        vibration=np.zeros(len(ups)),
        gravity=G,
    )
    inside = [
        replace(
            holds.select(np.full(len(one.time), place[0])),
            force=G * one.up,
            rate=one.rate,
            temperature=np.interp(one.time, middle, holds.temperature),
            time=one.time,
        )
        for one, place in zip(motions, places, strict=True)
    ]
    return Course(motions, places, holds, inside)


@dataclass(frozen=True)
class Noise:
    """Standard deviations of the noise.

    Attributes:
        sample: of a sample of the rate, rad/s.
        wander: of a still mean, whatever its samples, rad/s.
        force: of a hold's mean acceleration, m/s².
    """

    sample: float = 0.0
    wander: float = 0.0
    force: float = 0.0


def measured(
    made: Course,
    terms: Sequence[Term] = (),
    sizes: FloatArray | None = None,
    noise: Noise | None = None,
    rng: np.random.Generator | None = None,
    gyroscope: Truth | None = None,
    unit: str = "rad/s",
) -> GyroscopeExperiment:
    """What the solver is given of this course, by the road that a recording takes."""
    holds, rotations = recorded(made, terms, sizes, noise or Noise(), rng, gyroscope)
    accelerometer = fit_accelerometer(holds, G, "m/s^2")
    return gyroscope_minimum(holds, rotations, accelerometer, unit).experiment


def recorded(
    made: Course,
    terms: Sequence[Term],
    sizes: FloatArray | None,
    noise: Noise,
    rng: np.random.Generator | None,
    gyroscope: Truth | None,
) -> tuple[list[Hold], list[Rotation]]:
    """Readings ``y = S (w + ε) + b + noise`` as holds and rotations."""
    chance = rng or np.random.default_rng(0)
    gyro, accelerometer = gyroscope or typical_gyroscope(), typical_accelerometer()
    together = Terms("gyroscope", terms)
    hidden = np.zeros(0) if sizes is None else sizes
    gain = float(np.mean(np.diag(gyro.sensitivity)))
    still_sigma = gain * noise.sample / np.sqrt(100.0 * HOLD)
    spread = np.hypot(still_sigma, gain * noise.wander)
    means = gyro.readings(together.columns(made.holds) @ hidden)
    means += spread * chance.standard_normal(means.shape)
    forces = accelerometer.readings(made.holds.force)
    forces += noise.force * chance.standard_normal(forces.shape)
    holds = [
        Hold(
            start=float(time - 0.5 * HOLD),
            end=float(time + 0.5 * HOLD),
            accelerometer=force,
            accelerometer_covariance=noise.force**2 * np.eye(3),
            gyroscope=mean,
            gyroscope_covariance=still_sigma**2 * np.eye(3),
            samples=int(100 * HOLD),
            temperature=float(degrees),
        )
        for time, force, mean, degrees in zip(
            made.holds.time, forces, means, made.holds.temperature, strict=True
        )
    ]
    rotations = []
    for one, place, there in zip(made.motions, made.places, made.inside, strict=True):
        readings = gyro.readings(one.rate + together.columns(there) @ hidden)
        readings += gain * noise.sample * chance.standard_normal(readings.shape)
        ends = holds[place[0]], holds[place[1]]
        force = accelerometer.readings(G * one.up)
        rotations.append(Rotation(*ends, one.time, readings, accelerometer=force))
    return holds, rotations


def twenty_turns(seed: int = 0, count: int = 20) -> list[Motion]:
    """Turns about any axis, from any pose, at several speeds."""
    return free_turns(count, np.random.default_rng(seed))


def without(data: GyroscopeExperiment, index: int) -> GyroscopeExperiment:
    """The data without one rotation."""
    one = data.rotations
    kept = [k for k in range(len(one.usable)) if k != index]
    parts = [slice(one.samples.offsets[k], one.samples.offsets[k + 1]) for k in kept]
    samples = rotation_samples(
        [one.samples.time[part] for part in parts], [one.samples.reading[part] for part in parts]
    )
    up = None if one.up is None else np.concatenate([one.up[part] for part in parts])
    rest = replace(
        one,
        samples=samples,
        usable=one.usable[kept],
        before=one.before[kept],
        after=one.after[kept],
        up=up,
    )
    args = data.holds, rest, data.of, data.unit, data.begin(BASE), data.nominal, data.free
    return GyroscopeExperiment(*args, data.readings)


def settled_rows(
    data: GyroscopeExperiment, terms: Terms, calibration: Parameters
) -> tuple[Rows, ...]:
    """A calibration's rates and closures, its effects taken at its own rates and forces."""
    rows = tuple(source.at(calibration, terms) for source in data.sources)
    for _ in range(4 if len(terms) else 0):
        pairs = zip(data.sources, rows, strict=True)
        rows = tuple(source.at(calibration, terms, near) for source, near in pairs)
    return rows


def still_rms(found: SensorFit) -> float:
    """What a fit leaves of the still means, rad/s."""
    assert found.rows is not None
    return root_mean_square(found.rows.residual[found.rows.kind == "still"].reshape(-1, 3))


def sizes_by(found: SensorFit, *, moving: bool) -> tuple[FloatArray, FloatArray]:
    """Sizes of the effects and their covariance, by rotations or by still means alone.

    Still means say nothing of the gains, which keep the values of the whole fit.
    """
    table, sizes = found.rows, np.concatenate(found.sizes)
    assert table is not None
    assert found.minimum is not None
    rows = table.moving == moving
    effects = np.array([name.partition("_")[0] in found.model[len(found.base) :]
                        for name in table.names])  # fmt: skip
    bias = np.array([name.startswith("bias") for name in table.names])
    free = effects | bias | ~found.minimum.reported | moving
    columns = table.columns[np.ix_(rows, free)]
    weighted = table.independent.weighted(columns, table.variance, rows)
    covariance = inverted(columns.T @ weighted + table.prior[np.ix_(free, free)])
    value = np.zeros(len(table.names))
    value[effects] = sizes
    pull = weighted.T @ table.residual[rows] + (table.prior @ value)[free]
    own = effects[free]
    return sizes - (covariance @ pull)[own], covariance[np.ix_(own, own)]
