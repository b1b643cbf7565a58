"""Raw recordings through the whole program: simulated, read, fitted, ``bench --auto``."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.hidden.noise import MILLI_G
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.survey import add_by_itself
from imucal_wizard.diagnose.verdict import Opinion
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.model.catalogue import effect, effects_for
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE
from imucal_wizard.simulate.hidden import Hidden
from imucal_wizard.simulate.recording import simulate_recording
from imucal_wizard.simulate.sensor import SensorModel
from imucal_wizard.teach.draw import virtual_sensor

POSES = "26+repeats"
NEVER = {"earth-rate"}
"""Every gyroscope feels it; the virtual one only when told, and then at one size."""
UNITS = {ACCELEROMETER: MILLI_G, GYROSCOPE: np.pi / 180.0}
"""Of the errors held out in the table: mg, and degrees per rotation."""


@dataclass(frozen=True)
class Judged:
    """What ``bench --auto`` says of one sensor of a recording.

    Attributes:
        sensor: which.
        hidden: the effects hidden in it.
        families: theirs, sorted.
        opinion: what the program says; a term that was added is named, whatever is left beside it.
        before: error held out of the base model, mg or degrees.
        after: the same of the model at the end.
        added: the effects in the model at the end.
    """

    sensor: str
    hidden: tuple[Hidden, ...]
    families: tuple[str, ...]
    opinion: Opinion
    before: float
    after: float
    added: tuple[str, ...]


def terms_of(sensor: str) -> list[str]:
    """The effects that are hidden."""
    return [one.name for one in effects_for(sensor) if one.name not in NEVER]


def benches_of(
    seed: int,
    model: SensorModel,
    hidden: Sequence[Hidden],
    poses: str = POSES,
    hand_seed: int | None = None,
    step: float | None = None,
) -> Benches:
    """One recording of a virtual sensor, as the program reads and fits it.

    Args:
        seed: of the recording.
        model: the sensor.
        hidden: the effects in it.
        poses: set of still poses.
        hand_seed: of the poses and the hand, if it is not that of the recording.
        step: time of a hidden step, s; the middle of the poses by default.
    """
    with TemporaryDirectory(dir=os.environ.get("TMPDIR")) as folder:
        path = Path(folder) / "recording.csv"
        simulate_recording(
            path,
            hidden=hidden,
            seed=seed,
            hand_seed=hand_seed,
            poses=poses,
            model=model,
            step=step,
        )
        readings = read_files([path])
    return Benches(fit_readings(readings), readings)


def judged(benches: Benches, sensor: str, hidden: Sequence[Hidden]) -> Judged:
    """``bench --auto`` on one sensor that was not judged before; the accelerometer goes first."""
    found = add_by_itself(benches.accelerometer)
    bench = benches.bench(sensor)
    if bench is None:
        raise ValueError(f"the recording has no {sensor}")
    if sensor == GYROSCOPE:
        found = add_by_itself(bench) if benches.passed else bench.look()
    own = [effect(one.term) for one in hidden if one.sensor == sensor]
    ends = [one.rms_held_out for one in (bench.ladder[0], bench.ladder[-1])]
    before, after = (np.nan if one is None else one / UNITS[sensor] for one in ends)
    opinion, told = found.opinion, {one.term: (one.term, *one.like) for one in bench.found}
    if told and not opinion.families:
        families = tuple(effect(term).family or term for term in told)
        opinion = replace(opinion, families=families, terms=tuple(told.values()))
    return Judged(
        sensor=sensor,
        hidden=tuple(one for one in hidden if one.sensor == sensor),
        families=tuple(sorted({one.family or one.name for one in own})),
        opinion=opinion,
        before=before,
        after=after,
        added=tuple(term.name for term in bench.fit.terms),
    )


def nameable_size(
    seed: int, grade: str, sensor: str, term: str, shaken: bool = False
) -> tuple[FloatArray, float | None] | None:
    """What the program calls nameable in a recording of this sensor with nothing hidden.

    Args:
        seed: of the sensor and the recording.
        grade: of the sensor.
        sensor: ``accelerometer`` or ``gyroscope``.
        term: the effect.
        shaken: the support shakes in some poses.

    Returns:
        The size of each parameter, and the moment of a step that it is told for; None where the
        effect is no suspect.
    """
    nothing = (Hidden(ACCELEROMETER, "vibration-rectification", 0.0, (0,)),) if shaken else ()
    bench = benches_of(seed, virtual_sensor(seed, grade), nothing).bench(sensor)
    suspects = () if bench is None else bench.look().suspects
    for one in suspects:
        if one.term == term and one.sized is not None:
            return one.nameable, one.sized.variant if one.sized.effect.sudden else None
    return None


def hidden_in(
    sensor: str, term: str, times: float, sizes: FloatArray, rng: np.random.Generator
) -> Hidden:
    """An effect at a multiple of a size told, on axes and with a sign by chance."""
    parameters = effect(term).parameters(sensor)
    shown = [place for place in range(len(parameters)) if np.isfinite(sizes[place])]
    place = int(rng.choice(shown))
    letters = parameters[place].name
    axes = tuple("xyz".index(letter) for letter in letters if letters != "all") or (0,)
    sign = float(rng.choice((-1.0, 1.0)))
    return Hidden(sensor, term, times * float(sizes[place]) * sign, axes)
