"""Recordings of the virtual IMU, written as the program itself reads them."""

import itertools
from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from imucal_wizard.devices.virtual.actions import Action, Place, Rest, Shake
from imucal_wizard.devices.virtual.chance import Chance, generator
from imucal_wizard.devices.virtual.hand import VirtualHand
from imucal_wizard.devices.virtual.hidden import (
    Hidden,
    check_sensors,
    draws_current,
    needs_shaking,
    parse_hidden,
)
from imucal_wizard.devices.virtual.line import LinePrinter
from imucal_wizard.devices.virtual.load import VirtualLoad
from imucal_wizard.devices.virtual.magnetometer import FieldModel, VirtualMagnetometer
from imucal_wizard.devices.virtual.scripts import (
    SHAKEN_EVERY,
    perform_circles,
    perform_rotations,
    pose_names,
)
from imucal_wizard.devices.virtual.sensor import SensorModel
from imucal_wizard.devices.virtual.stream import VirtualStream
from imucal_wizard.errors import RecordingError

FIRST_REST = 20.0
TURN_HOLD = 5.0
PLACING = 1.2
"""Seconds that it takes about to bring the device into the next pose."""
BATCH = 4096
SHAKE_RMS = 0.1
"""Vibration of the support in every third pose where rectification is to be seen, m/s².

No search for holds in a recording calls a device at rest that is shaken harder. The hand that
follows the wizard, whose limits can be loosened, shakes it harder.
"""
COMMENT = "# a virtual IMU"
"""How every simulated recording begins."""


def recording_script(
    poses: str, rng: np.random.Generator, *, hold: float, rotations: int, shaken: bool = False
) -> Iterator[Action]:
    """A first rest, the poses, the rotations; a last pose lets the last turn end in a hold."""
    yield Rest(FIRST_REST)
    for index, name in enumerate(pose_names(poses, rng)):
        yield Shake(SHAKE_RMS if shaken and index % SHAKEN_EVERY == 2 else 0.0)
        yield Place(name)
        yield Rest(hold)
    yield Shake(0.0)
    if rotations:
        yield from perform_rotations(rotations, TURN_HOLD)


def simulate_recording(
    path: Path | str,
    *,
    hidden: Iterable[Hidden | str] = (),
    seed: int = 0,
    rate: float = 100.0,
    poses: str = "18",
    model: SensorModel | None = None,
    hold: float | None = None,
    rotations: int = 6,
    magnetometer: bool = False,
    ammeter: bool = False,
) -> None:
    """Write a recording: comments, header, one line per sample. Nothing in it tells the truth.

    Args:
        path: CSV file to write.
        hidden: effects that the sensor has besides, parsed or as ``TERM:SIZE:AXIS``.
        seed: of the sensor's errors, the noise and the hand.
        rate: samples per second.
        poses: ``6``, ``8`` (N's tilted ones), ``18``, ``26`` or ``26+repeats``.
        model: the sensor; drawn from the seed when not given.
        hold: seconds per pose; 5, or 10 where corners are taken.
        rotations: turns about each axis at the end.
        magnetometer: there is one too, and a circle on each face comes last.
        ammeter: motors run, and their current has a column; so in any case where the effect of a
            current is hidden.

    Raises:
        UsageError: an unknown set of poses or hidden effect, or one of a sensor that is not there.
        RecordingError: the file cannot be written.
    """
    effects = [parse_hidden(h) if isinstance(h, str) else h for h in hidden]
    check_sensors(effects, magnetometer=magnetometer)
    seconds = hold if hold is not None else 10.0 if poses.startswith("26") else 5.0
    shaken = needs_shaking(effects)
    names = pose_names(poses, generator(seed, Chance.POSES))
    script = recording_script(
        poses, generator(seed, Chance.POSES), hold=seconds, rotations=rotations, shaken=shaken
    )
    sensor = SensorModel.drawn(seed) if model is None else model
    hand = VirtualHand(rate, seed)
    hand.perform(itertools.chain(script, perform_circles(TURN_HOLD)) if magnetometer else script)
    middle = (FIRST_REST + 0.5 * len(names) * (seconds + PLACING)) / 60.0
    field = VirtualMagnetometer(FieldModel.drawn(seed), seed) if magnetometer else None
    load = VirtualLoad(seed) if ammeter or draws_current(effects) else None
    stream = VirtualStream(
        hand, sensor, effects, rate=rate, seed=seed, step=middle, magnetometer=field, load=load
    )
    printer = LinePrinter(sensor, "\n", field=magnetometer, load=load is not None)
    comment = f"{COMMENT} at {rate:g} Hz: a rest, {poses} poses, {rotations} turns per axis\n"
    try:
        with Path(path).open("wb") as file:
            file.write(comment.encode())
            file.writelines(_lines(hand, stream, printer))
    except OSError as error:
        raise RecordingError(
            f"{path} cannot be written ({error.strerror}); choose another"
        ) from None


def _lines(hand: VirtualHand, stream: VirtualStream, printer: LinePrinter) -> Iterator[bytes]:
    yield printer.header
    while count := hand.remaining(BATCH):
        yield printer.lines(stream.take(count))
