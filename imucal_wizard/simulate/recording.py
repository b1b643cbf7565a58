"""Recordings of the virtual IMU."""

from collections.abc import Iterable, Iterator
from pathlib import Path

import numpy as np

from imucal_wizard.core.output import replacing
from imucal_wizard.simulate.actions import Action, LieStill, PlacePose, Shake
from imucal_wizard.simulate.hidden import Hidden, needs_shaking, parse_hidden
from imucal_wizard.simulate.imu import VirtualImu
from imucal_wizard.simulate.noise import RandomStream, generator
from imucal_wizard.simulate.scripts import (
    SHAKE_RMS,
    SHAKEN_EVERY,
    perform_circles,
    perform_rotations,
    pose_names,
)
from imucal_wizard.simulate.sensor import SensorModel

FIRST_REST_SECONDS = 20.0
"""Duration of the first rest, s."""
ROTATION_HOLD_SECONDS = 5.0
"""Duration of the holds between rotations, s."""
PLACING_SECONDS = 1.2
"""Approximate time to place the device in the next pose, s."""
LINES_PER_WRITE = 4096
"""Lines written at once."""
FIRST_COMMENT = "# a virtual IMU"
"""First line of every simulated recording."""


def recording_script(
    poses: str, rng: np.random.Generator, *, hold: float, rotations: int, shaken: bool = False
) -> Iterator[Action]:
    """A first rest, the poses, the rotations."""
    yield LieStill(FIRST_REST_SECONDS)
    for index, name in enumerate(pose_names(poses, rng)):
        yield Shake(SHAKE_RMS if shaken and index % SHAKEN_EVERY == 2 else 0.0)
        yield PlacePose(name)
        yield LieStill(hold)
    yield Shake(0.0)
    if rotations:
        yield from perform_rotations(rotations, ROTATION_HOLD_SECONDS)


def simulate_recording(
    path: Path | str,
    *,
    hidden: Iterable[Hidden | str] = (),
    seed: int = 0,
    hand_seed: int | None = None,
    rate: float = 100.0,
    poses: str = "18",
    model: SensorModel | None = None,
    hold: float | None = None,
    rotations: int = 6,
    magnetometer: bool = False,
    ammeter: bool = False,
    step: float | None = None,
) -> None:
    """Write a recording: comments, header, one line per sample; without the true parameters.

    Args:
        path: CSV file to write.
        hidden: additional effects of the sensor, parsed or as ``TERM:SIZE:AXIS``.
        seed: seed of the sensor's errors, the noise, the poses and the hand.
        hand_seed: seed of the poses and the hand, if it is another one.
        rate: samples per second.
        poses: ``6``, ``8`` (N's tilted ones), ``18``, ``26`` or ``26+repeats``.
        model: the sensor; drawn from the seed if not given.
        hold: seconds per pose; by default 5, or 10 with corners.
        rotations: number of rotations about each axis at the end.
        magnetometer: whether there is a magnetometer, with a circle on each face at the end.
        ammeter: whether motors run and their current is measured; always if the effect of a current
            is hidden.
        step: time of a ``bias-step`` and a ``scale-step``, s; the middle of the poses by default.

    Raises:
        UsageError: an unknown set of poses or hidden effect, or an effect of a missing sensor.
    """
    effects = [parse_hidden(h) if isinstance(h, str) else h for h in hidden]
    seconds = hold if hold is not None else 10.0 if poses.startswith("26") else 5.0
    moved_by = seed if hand_seed is None else hand_seed
    names = pose_names(poses, generator(moved_by, RandomStream.POSES))
    if step is None:
        step = FIRST_REST_SECONDS + 0.5 * len(names) * (seconds + PLACING_SECONDS)
    imu = VirtualImu(
        rate,
        seed,
        sensor=model,
        hidden=effects,
        hand_seed=moved_by,
        magnetometer=magnetometer,
        ammeter=ammeter,
        bias_step=step / 60.0,
        line_end="\n",
    )
    script = recording_script(
        poses,
        generator(moved_by, RandomStream.POSES),
        hold=seconds,
        rotations=rotations,
        shaken=needs_shaking(effects),
    )
    imu.hand.perform(script)
    if magnetometer:
        imu.hand.perform(perform_circles(ROTATION_HOLD_SECONDS))
    comment = f"{FIRST_COMMENT} at {rate:g} Hz: a rest, {poses} poses, {rotations} turns per axis\n"
    with replacing(Path(path)) as file:
        file.write(comment.encode())
        file.writelines(_lines(imu))


def _lines(imu: VirtualImu) -> Iterator[bytes]:
    yield imu.printer.header
    while count := imu.hand.remaining(LINES_PER_WRITE):
        yield imu.printer.lines(imu.stream.take(count))
