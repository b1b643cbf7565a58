"""Gyroscope against the joint bound: ``python -m benchmarks.gyroscope_bound SESSIONS SEED``.

Each session is one chain: every hold ends one rotation and begins the next. The Cramér–Rao bound is
numerical: differences of the simulated readings of all holds and of the directions that the
rotations carry, by every parameter of the accelerometer, of the gyroscope and by the true direction
of each hold, with the true variances. It shares no formula with the estimator. The table shows for
each group of parameters the rms error over its bound and the share of 95 % intervals that hold the
truth, with the worst single parameter; noise is drawn anew in each session, truth and motion stay.
Where few directions leave angles of the accelerometer undetermined, the accelerometer is drawn anew
with errors of usual size, and the bound takes these sizes as known.
"""

import sys
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation as Attitude

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.accelerometer import fit_accelerometer
from imucal_wizard.estimate.distributions import quantile
from imucal_wizard.estimate.gyroscope_report import fit_gyroscope
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.simulate.sensor import Thermal
from tests.estimate.truth import (
    EIGHTEEN,
    SIX,
    TWENTY_SIX,
    Motion,
    Truth,
    tilted,
    turn,
    typical_gyroscope,
)

GRAVITY = 9.80665
RATE = 50.0
"""Samples/s."""
BATCHES = 5
AGAIN = 0.5
"""Time without readings on either side of a rotation, s."""
WARMING = Thermal(24.0, 5.0, 180.0)
"""Temperature of the chip."""
GROUPS = ("sensitivity", "cross", "bias")


@dataclass(frozen=True, eq=False)
class Device:
    """What is simulated.

    Attributes:
        name: in the table.
        poses: nominal up of the holds in order, shape (n, 3).
        turns: further rotations about level axes.
        samples: of each hold.
        force: noise of a sample of the accelerometer, mg.
        rate: noise of a sample of the gyroscope, °/s, per axis.
        drawn: each session has an accelerometer of its own.
    """

    name: str
    poses: FloatArray
    turns: int
    samples: int
    force: float
    rate: tuple[float, float, float] = (0.03, 0.03, 0.03)
    drawn: bool = False


_EIGHT = EIGHTEEN[[0, 6, 1, 2, 13, 3, 4, 5]]
"""Six faces and two edges."""
DEVICES = (
    Device("26 poses, 12 turns, 1 mg", TWENTY_SIX, 12, 150, 1.0),
    Device("26 poses, 12 turns, 6 mg", TWENTY_SIX, 12, 150, 6.0),
    Device("18 poses, 12 turns, 1 mg", EIGHTEEN, 12, 150, 1.0),
    Device("18 poses, 6 turns, 3 mg", EIGHTEEN, 6, 150, 3.0),
    Device("26 poses, 12 turns, 1 mg, 10 samples", TWENTY_SIX, 12, 10, 1.0),
    Device("26 poses, 12 turns, 1 mg, uneven axes", TWENTY_SIX, 12, 150, 1.0, (0.015, 0.03, 0.1)),
    Device("6 directions, each 5 times, 1 mg", np.tile(SIX, (5, 1)), 0, 150, 1.0, drawn=True),
    Device("8 directions, each 4 times, 1 mg", np.tile(_EIGHT, (4, 1)), 0, 150, 1.0, drawn=True),
)


class WrongRate(ABC):
    """What a gyroscope may do beside bias, scale and angles."""

    @abstractmethod
    def error(self, time: FloatArray, rate: FloatArray, up: FloatArray) -> FloatArray:
        """Error of the rate, rad/s, shape (n, 3).

        Args:
            time: since the session began, s, shape (n,).
            rate: true rate, rad/s, shape (n, 3).
            up: true up, shape (n, 3).
        """


class Session:
    """Truth and motion of one device."""

    def __init__(self, device: Device, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.device = device
        self.accelerometer = usual_accelerometer(rng)
        self.gyroscope = typical_gyroscope()
        self.motions = _chain(device, rng)
        last = self.motions[-1].up[-1]
        self.up = np.array([*(motion.up[0] for motion in self.motions), last])

    def recorded(
        self, rng: np.random.Generator, wrong: WrongRate | None = None
    ) -> tuple[list[Hold], list[Rotation]]:
        """The session with noise, and with one more error of the gyroscope."""
        device, sigma = self.device, np.radians(self.device.rate)
        force = np.full(3, 1e-3 * device.force * GRAVITY)
        seconds, holds, rotations, at = device.samples / RATE, [], [], 0.0
        for up in self.up:
            true = self.accelerometer.sensitivity @ (GRAVITY * up) + self.accelerometer.bias
            means = [_averaged(true, force, device.samples, rng)]
            still = np.zeros(3)
            if wrong is not None:
                middle = np.array([at + 0.5 * seconds])
                still = wrong.error(middle, np.zeros((1, 3)), up[None])[0]
            rest = self.gyroscope.sensitivity @ still + self.gyroscope.bias
            means.append(_averaged(rest, sigma, device.samples, rng))
            (mean, covariance), (rate, rates) = means
            samples, warm = device.samples, WARMING.at(np.array([at + 0.5 * seconds]))
            holds.append(
                Hold(at, at + seconds, mean, covariance, rate, rates, samples, float(warm[0]))
            )
            at += seconds + 2.0 * AGAIN + 4.0
        for motion, before, after in zip(self.motions, holds[:-1], holds[1:], strict=True):
            time = before.end + AGAIN + motion.time - motion.time[0]
            felt = motion.rate
            if wrong is not None:
                felt = felt + wrong.error(time, motion.rate, motion.up)
            reading = felt @ self.gyroscope.sensitivity.T + self.gyroscope.bias
            reading = reading + sigma * rng.standard_normal(reading.shape)
            inside = GRAVITY * motion.up @ self.accelerometer.sensitivity.T
            inside = inside + self.accelerometer.bias
            rotations.append(Rotation(before, after, time, reading, accelerometer=inside))
        return holds, rotations

    def bound(self) -> FloatArray:
        """Smallest covariance of the gyroscope's parameters, in the order of ``NAMES``, (12, 12).

        A closure is the direction carried by the noise-free readings less the direction after; its
        noise is that of the samples, each of which turns the direction by its own error.
        """
        device, count = self.device, len(self.up)
        force = 1e-3 * device.force * GRAVITY / np.sqrt(device.samples)
        rate = np.radians(device.rate)
        gains = np.linalg.inv(self.gyroscope.sensitivity)
        triangle = np.linalg.inv(self.accelerometer.sensitivity)
        tilts = np.array([np.linalg.svd(up[None])[2][1:] for up in self.up])
        readings = [
            motion.rate @ self.gyroscope.sensitivity.T + self.gyroscope.bias
            for motion in self.motions
        ]
        roots = []
        for place, (motion, reading) in enumerate(zip(self.motions, readings, strict=True)):
            attitudes = _attitudes(motion.time, (reading - self.gyroscope.bias) @ gains.T)
            # a turn by ε at a sample, seen in the frame of the end
            seen = (attitudes[-1].inv() * attitudes).as_matrix() @ (gains * rate)
            across = tilts[place + 1] @ np.cross(self.up[place + 1], seen, axisb=1, axisc=1)
            across *= motion.time[1] - motion.time[0]
            covariance = (across @ np.swapaxes(across, 1, 2)).sum(axis=0)
            roots.append(np.linalg.inv(np.linalg.cholesky(covariance)))

        def predicted(gyroscope: FloatArray, others: FloatArray) -> FloatArray:
            """All whitened readings, for changes of the parameters."""
            matrix, bias = gains + gyroscope[:9].reshape(3, 3), self.gyroscope.bias + gyroscope[9:]
            upper = triangle.copy()
            upper[np.triu_indices(3)] += others[:6]
            offset = self.accelerometer.bias + others[6:9]
            shifts = others[9:].reshape(count, 1, 2)
            up = self.up + (shifts @ tilts)[:, 0]
            up /= np.linalg.norm(up, axis=1)[:, None]
            whole = carried
            if gyroscope.any():
                pairs = zip(self.motions, readings, strict=True)
                whole = [_attitudes(m.time, (y - bias) @ matrix.T)[-1] for m, y in pairs]
            return np.concatenate(
                [
                    (GRAVITY * up @ np.linalg.inv(upper).T + offset).ravel() / force,
                    np.tile(bias / rate * np.sqrt(device.samples), count),
                    others[:9] / USUAL * device.drawn,
                    *(
                        root @ tilt @ (turned.inv().apply(before) - after)
                        for root, tilt, turned, before, after in zip(
                            roots, tilts[1:], whole, up[:-1], up[1:], strict=True
                        )
                    ),
                ]
            )

        pairs = zip(self.motions, readings, strict=True)
        carried = [_attitudes(m.time, (y - self.gyroscope.bias) @ gains.T)[-1] for m, y in pairs]
        columns = []
        for step in 1e-5 * np.eye(21 + 2 * count):
            ends = [predicted(sign * step[:12], sign * step[12:]) for sign in (1.0, -1.0)]
            columns.append((ends[0] - ends[1]) / 2e-5)
        table = np.array(columns).T
        scale = np.linalg.norm(table, axis=0)
        information = (table / scale).T @ (table / scale)
        entries = (np.linalg.inv(information) / np.outer(scale, scale))[:12, :12]
        at = np.concatenate([gains.ravel(), self.gyroscope.bias])
        slope = np.array(
            [(named(at + step) - named(at - step)) / 2e-6 for step in 1e-6 * np.eye(12)]
        ).T
        return np.asarray(slope @ entries @ slope.T)


NAMES = (
    *(f"sensitivity_{axis}" for axis in "xyz"),
    *(f"cross_{a}{b}" for a in "xyz" for b in "xyz" if a != b),
    *(f"bias_{axis}" for axis in "xyz"),
)


USUAL = np.array([0.02, 0.015, 0.015, 0.02, 0.015, 0.02, *[0.03 * GRAVITY] * 3])
"""Errors of an accelerometer: M's xx, xy, xz, yy, yz, zz, and biases in m/s²."""


def usual_accelerometer(rng: np.random.Generator) -> Truth:
    """An accelerometer with errors of usual size."""
    error = USUAL * rng.standard_normal(9)
    matrix = np.eye(3)
    matrix[np.triu_indices(3)] += error[:6]
    return Truth(np.asarray(np.linalg.inv(matrix), float), error[6:])


def named(entries: FloatArray) -> FloatArray:
    """The parameters in the order of ``NAMES`` from M by rows and b."""
    matrix = entries[:9].reshape(3, 3)
    cross = [matrix[i, j] / matrix[j, j] for i in range(3) for j in range(3) if i != j]
    return np.array([*(1.0 / np.diag(matrix)), *cross, *entries[9:]])


def _chain(device: Device, rng: np.random.Generator) -> list[Motion]:
    """From pose to pose with a twist about the vertical, then turns about level axes."""
    motions, up = [], tilted(device.poses[:1], 2.0, rng)[0]
    for target in tilted(device.poses[1:], 2.0, rng):
        twist = Attitude.from_rotvec(rng.uniform(-1.5, 1.5) * up)
        axis = np.cross(target, up)
        if np.linalg.norm(axis) < 0.1:
            axis = np.cross(up, np.eye(3)[np.abs(up).argmin()])
        angle = np.arccos(np.clip(target @ up, -1.0, 1.0))
        tilt = Attitude.from_rotvec(angle * axis / np.linalg.norm(axis))
        motions.append(_turn(up, (twist * tilt).as_rotvec(), rng))
        up = motions[-1].up[-1]
    for index in range(device.turns):
        along = np.eye(3)[index % 3]
        if abs(up @ along) > 0.5:  # bring that axis level first
            across = np.cross(up, np.eye(3)[(index + 1) % 3])
            motions.append(_turn(up, 0.5 * np.pi * across / np.linalg.norm(across), rng))
            up = motions[-1].up[-1]
        angle = np.radians((100.0, -140.0, 160.0, -80.0)[index // 3 % 4])
        motions.append(_turn(up, angle * along, rng))
        up = motions[-1].up[-1]
    return motions


def _turn(up: FloatArray, vector: FloatArray, rng: np.random.Generator) -> Motion:
    seconds = float(rng.uniform(1.2, 2.5))
    wobble = 0.05 * rng.standard_normal(3)
    return turn(up, vector, seconds=seconds, wobble=wobble, rate=RATE)


def _averaged(
    true: FloatArray, sigma: FloatArray, samples: int, rng: np.random.Generator
) -> tuple[FloatArray, FloatArray]:
    """Mean of samples with white noise, and its covariance as batch means tell it."""
    batches = true + sigma * rng.standard_normal((BATCHES, 3)) / np.sqrt(samples / BATCHES)
    scatter = batches - batches.mean(axis=0)
    return batches.mean(axis=0), scatter.T @ scatter / (BATCHES * (BATCHES - 1))


def _attitudes(time: FloatArray, rate: FloatArray) -> Attitude:
    """From the beginning to each sample, by the mean rate of each interval."""
    steps = Attitude.from_rotvec(0.5 * (rate[1:] + rate[:-1]) * np.diff(time)[:, None]).as_matrix()
    whole = [np.eye(3)]
    for step in steps:
        whole.append(whole[-1] @ step)
    return Attitude.from_matrix(np.array(whole))


@dataclass(frozen=True, eq=False)
class Outcome:
    """Of many sessions, per parameter in the order of ``NAMES``.

    Attributes:
        ratio: rms error over its bound, shape (12,).
        held: share of 95 % intervals that hold the truth, shape (12,).
    """

    ratio: FloatArray
    held: FloatArray

    def group(self, name: str) -> tuple[float, float, float, float]:
        """Mean and largest ratio, least and largest share of one group of parameters."""
        own = [name in one for one in NAMES]
        ratio, held = self.ratio[own], self.held[own]
        mean = float(np.sqrt((ratio**2).mean()))
        return mean, float(ratio.max()), float(held.min()), float(held.max())


def studied(device: Device, sessions: int, seed: int) -> Outcome:
    """Many sessions of one device."""
    session, rng = Session(device, seed), np.random.default_rng(seed + 1)
    bound = np.sqrt(np.diag(session.bound()))
    gyroscope = session.gyroscope
    truth = named(np.concatenate([np.linalg.inv(gyroscope.sensitivity).ravel(), gyroscope.bias]))
    errors, held = [], []
    for _ in range(sessions):
        if device.drawn:
            session.accelerometer = usual_accelerometer(rng)
        found = fitted(*session.recorded(rng))
        own = {one.name: one for one in found.parameters}
        errors.append([own[name].value for name in NAMES] - truth)
        reach = quantile(0.95, found.degrees_of_freedom)
        sigma = np.array([own[name].standard_error or np.inf for name in NAMES])
        held.append(np.abs(errors[-1]) < reach * sigma)
    rms = np.sqrt((np.array(errors) ** 2).mean(axis=0))
    return Outcome(rms / bound, np.array(held).mean(axis=0))


def fitted(holds: list[Hold], rotations: list[Rotation]) -> SensorFit:
    """The gyroscope by the whole way from the holds."""
    found = fit_accelerometer(holds, GRAVITY, "m/s^2")
    fit = fit_gyroscope(holds, rotations, found, "rad/s").fit
    if fit is None:
        raise SystemExit("a simulated gyroscope was not fitted")
    return fit


def main(sessions: int, seed: int, only: str = "") -> None:
    """Print the table."""
    spread = 1.0 / np.sqrt(2.0 * sessions)
    print(
        f"{sessions} sessions each; a ratio is known to {100 * spread:.1f} %, a share to "
        f"{100 * np.sqrt(0.95 * 0.05 / sessions):.1f} %"
    )
    print(f"{'device':40}{'parameters':14}{'error/bound':>12}{'worst':>8}{'inside 95 %':>16}")
    for device in DEVICES:
        if only not in device.name:
            continue
        outcome = studied(device, sessions, seed)
        for group in GROUPS:
            mean, worst, least, most = outcome.group(group)
            inside = f"{100 * least:.1f}–{100 * most:.1f} %"
            print(f"{device.name:40}{group:14}{mean:12.3f}{worst:8.3f}{inside:>16}", flush=True)


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]), *sys.argv[3:4])
