"""A device with a magnetometer for tests: the virtual hand turns it, nothing of it is the fit's."""

from collections.abc import Iterable, Iterator
from copy import deepcopy
from dataclasses import replace
from functools import cache

import numpy as np

from imucal_wizard.core.poses import FACES
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.guide.kinds import EventKind
from imucal_wizard.guide.plan import standard
from imucal_wizard.guide.state import Event, FieldStatus
from imucal_wizard.guide.state_machine import StateMachine
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Rotate
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.magnetometer import TrueField, VirtualMagnetometer
from imucal_wizard.simulate.samples import VirtualStream
from imucal_wizard.simulate.sensor import SensorModel

RATE = 100.0
SETTLED = 3.0
"""Seconds of rest before the step."""
SEED = 3
QUICK = standard(settle_seconds=2.0)
FAST_DEG = 180.0


def circle(face: str, degrees: float = 372.0, fastest: float = FAST_DEG) -> tuple[Action, ...]:
    """A face laid on the table, and turned about the vertical."""
    up = face.translate(str.maketrans("+-", "-+"))
    return (
        PlacePose(up, error=0.7),
        LieStill(1.3),
        Rotate(face[1], degrees, fastest, error=2.0),
        LieStill(0.5),
    )


def circles(faces: Iterable[str] = FACES) -> tuple[Action, ...]:
    """Once round on each of these faces."""
    return tuple(action for face in faces for action in circle(face))


@cache
def turned(actions: tuple[Action, ...], seed: int = SEED, after: float = 0.0) -> Readings:
    """What is read while a hand does this, and for some seconds after."""
    hand = VirtualHand(RATE, seed)
    magnetometer = VirtualMagnetometer(TrueField.drawn(seed), seed)
    sensor = SensorModel.drawn(seed)
    stream = VirtualStream(hand, sensor, rate=RATE, seed=seed, magnetometer=magnetometer)
    hand.perform([LieStill(SETTLED), *actions, LieStill(max(after, 0.1))])
    parts = []
    while hand.busy:
        parts.append(stream.take(max(hand.remaining(500), 1)))
    time, force, rate = (
        np.concatenate([getattr(part, name) for part in parts])
        for name in ("time", "accelerometer", "gyroscope")
    )
    field = np.concatenate([part.magnetometer for part in parts if part.magnetometer is not None])
    there = np.isfinite(field).all(axis=1)
    return Readings(
        Series(time, force, "m/s^2"),
        Series(time, rate, "rad/s"),
        Series(time[there], field[there], "uT"),
    )


def with_field(readings: Readings, values: FloatArray, unit: str = "uT") -> Readings:
    """The same with other values of the magnetometer."""
    assert readings.magnetometer is not None
    return replace(readings, magnetometer=Series(readings.magnetometer.time, values, unit))


def field_of(readings: Readings) -> FloatArray:
    """The magnetometer's values."""
    assert readings.magnetometer is not None
    return readings.magnetometer.values


def pieces(readings: Readings, size: int = 20) -> Iterator[Readings]:
    """Cut into pieces of so many samples of the accelerometer."""
    a, g, m = readings.accelerometer, readings.gyroscope, readings.magnetometer
    for first in range(0, len(a), size):
        past = min(first + size, len(a))
        begin = a.time[first] if first else -np.inf
        end = a.time[past] if past < len(a) else np.inf
        yield Readings(
            a.part(first, past),
            None if g is None else g.part(first, past),
            None if m is None else m.between(begin, end),
        )


class Session:
    """A machine in the magnetometer's step, and all it has said."""

    def __init__(self, readings: Readings, size: int = 20) -> None:
        gyroscope = readings.gyroscope
        self.machine = StateMachine(
            QUICK, rate=RATE, gyroscope_unit="rad/s" if gyroscope is None else gyroscope.unit
        )
        self.events: list[Event] = list(self.machine.command("start"))
        self.seen: list[FieldStatus] = []
        self._left: Iterator[Readings] = pieces(readings, size)
        settled = 0
        while settled < SETTLED * RATE - size:
            settled += size
            self.events += self.machine.feed(next(self._left))
        self.events += self.machine.command("goto", "field")

    def play(self, until: float = np.inf) -> "Session":
        """Feed what is there, up to a sample time, s."""
        for piece in self._left:
            self.events += self.machine.feed(piece)
            status = self.machine.status().field
            if status is not None:
                self.seen.append(status)
            if piece.accelerometer.time[-1] >= until:
                break
        return self

    def all_read(self) -> None:
        """Nothing is left to be read, so that a copy can be made."""
        self._left = iter(())

    @property
    def step(self) -> str:
        """The step it is in."""
        return self.machine.status().step

    @property
    def field(self) -> FieldStatus:
        """The last that was shown of the magnetometer."""
        return self.seen[-1]

    def texts(self, kind: EventKind) -> list[str]:
        """What was said with events of one kind."""
        return [event.text for event in self.events if event.kind is kind]


@cache
def _played(actions: tuple[Action, ...], seed: int) -> Session:
    session = Session(turned(actions, seed)).play()
    session.all_read()
    return session


def played(actions: tuple[Action, ...], seed: int = SEED) -> Session:
    """A session that has read all that ``turned`` gives; a copy, which may go on."""
    return deepcopy(_played(actions, seed))
