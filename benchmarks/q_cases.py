"""The paper's two sensors as virtual ones, and recordings of them made the paper's way.

A virtual hand holds and turns a virtual sensor. Rates, poses, rotations and rests are the paper's:
18 poses of 2 s at 100 Hz, rotations up to 150 °/s with 5 s of rest.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from imucal_wizard.core.poses import START_POSES
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.core.units import COUNT, STANDARD_GRAVITY
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Rotate
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.scripts import EDGE_NAMES, FACE_NAMES, next_angle
from imucal_wizard.simulate.sensor import DEGREE, MILLI_G, SensorModel, Triad

RATE = 100.0
FIRST_REST = 12.0
POSE = 3.2
"""Seconds in a pose: two remain when settling and guards are taken off."""
TURN_REST = 5.5
SPEEDS_DEG = (50.0, 100.0, 150.0)


@dataclass(frozen=True, eq=False)
class Case:
    """One of the paper's two sensors.

    Attributes:
        name: what it is.
        accelerometer: truth, by tables II and IV (sensitivities, upper triangular).
        gyroscope: truth, by the rate table of table III and the certificate of table V.
    """

    name: str
    accelerometer: Triad
    gyroscope: Triad

    @property
    def model(self) -> SensorModel:
        """The virtual sensor."""
        return SensorModel(self.accelerometer, self.gyroscope)


def upper(xx: float, xy: float, xz: float, yy: float, yz: float, zz: float) -> FloatArray:
    """An upper triangular matrix."""
    return np.array([[xx, xy, xz], [0.0, yy, yz], [0.0, 0.0, zz]])


BNO055 = Case(
    "BNO055, in m/s² and rad/s",
    Triad(
        upper(1.0061, -0.0122, 0.0188, 1.0067, 0.0005, 0.9831),
        STANDARD_GRAVITY * np.array([0.0097, -0.0367, -0.0101]),
        "m/s^2",
        density=0.150 * MILLI_G,
        floor=0.030 * MILLI_G,
        step=0.01,
    ),
    Triad(
        np.diag(1.0 / np.array([0.9770, 0.9822, 0.9766])),
        DEGREE * np.array([-0.0484, 0.0640, 0.0549]),
        "rad/s",
        density=0.014 * DEGREE,
        floor=0.0015 * DEGREE,
        step=DEGREE / 16.0,
    ),
)
XSENS = Case(
    "Xsens MTi-G710, in raw counts",
    Triad(
        upper(133.48, 0.21, 2.84, 134.28, -0.63, 135.61),
        np.array([32720.62, 32733.77, 32741.15]),
        COUNT,
        density=0.080 * MILLI_G,
        floor=0.040 * MILLI_G,
        step=1.0,
        lowest=0.0,
        highest=65535.0,
    ),
    Triad(
        np.diag([3181.57, 3298.56, 3142.16]),
        np.array([32998.5, 32193.8, 32905.9]),
        COUNT,
        density=0.010 * DEGREE,
        floor=0.0028 * DEGREE,
        step=1.0,
        lowest=0.0,
        highest=65535.0,
    ),
)


def poses(rng: np.random.Generator) -> Iterator[Action]:
    """A rest, then six faces and twelve edges in an order by chance."""
    names = FACE_NAMES + EDGE_NAMES
    yield LieStill(FIRST_REST)
    for index in rng.permutation(len(names)):
        yield PlacePose(names[index])
        yield LieStill(POSE)


def rotations(count: int) -> Iterator[Action]:
    """``count`` different turns about each axis between rests (Q's figure 2)."""
    for axis, pose in START_POSES.items():
        yield PlacePose(pose, error=0.7)
        yield LieStill(TURN_REST)
        tilt = 0.0
        for index in range(count):
            angle = next_angle(index, tilt)
            tilt += angle
            yield Rotate(axis, angle, SPEEDS_DEG[index % len(SPEEDS_DEG)])
            yield LieStill(TURN_REST)


def record(case: Case, seed: int, turns: int = 0) -> Readings:
    """One set of data."""
    hand = VirtualHand(RATE, seed)
    hand.perform([*poses(np.random.default_rng(seed)), *(rotations(turns) if turns else ())])
    stream = VirtualStream(hand, case.model, rate=RATE, seed=seed)
    parts = []
    while count := hand.remaining(8192):
        parts.append(stream.take(count))
    time = np.concatenate([part.time for part in parts])
    force = np.concatenate([part.accelerometer for part in parts])
    rate = np.concatenate([part.gyroscope for part in parts])
    return Readings(
        Series(time, force, case.accelerometer.unit),
        Series(time, rate, case.gyroscope.unit) if turns else None,
    )
