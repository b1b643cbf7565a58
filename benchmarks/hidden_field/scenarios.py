"""What is hidden in a recording of a magnetometer."""

from dataclasses import dataclass, field

import numpy as np

from benchmarks.hidden.scenarios import Draw, Sizes, nothing
from benchmarks.hidden_field import strangers
from benchmarks.hidden_field.recording import Colour
from imucal_wizard.model.catalogue import effects_for
from imucal_wizard.model.effect import MAGNETOMETER
from imucal_wizard.simulate.hidden import Hidden

ALIGNED = "misalignment"
"""Not an error of the magnitude: the second stage finds it by the dip, and no bench has to."""
EFFECTS = tuple(one.name for one in effects_for(MAGNETOMETER) if one.name != ALIGNED)
FAMILY = {effect.name: effect.family or effect.name for effect in effects_for(MAGNETOMETER)}


@dataclass(frozen=True)
class Scenario:
    """One row of the table.

    Attributes:
        name: of the row.
        draw: the effects hidden in one recording.
        extra: what is hidden that no effect makes.
        colour: of the noise.
    """

    name: str
    draw: Draw = nothing
    extra: strangers.Extra | None = None
    colour: Colour = field(default_factory=Colour)


def hidden_effect(term: str, times: float, sizes: Sizes, rng: np.random.Generator) -> Hidden:
    """An effect on an axis and with a sign by chance, at a multiple of its nameable size."""
    axis, sign = int(rng.integers(3)), float(rng.choice((-1.0, 1.0)))
    return Hidden(MAGNETOMETER, term, sign * times * float(sizes[term][axis]), (axis,))


def single(term: str, times: float) -> Scenario:
    """One effect."""
    return Scenario(
        f"{term} {times:g}x", lambda rng, sizes: (hidden_effect(term, times, sizes, rng),)
    )


def two(times: float) -> Scenario:
    """Two effects of different families."""

    def draw(rng: np.random.Generator, sizes: Sizes) -> tuple[Hidden, ...]:
        while True:
            pair = [str(one) for one in rng.choice(EFFECTS, 2, replace=False)]
            if FAMILY[pair[0]] != FAMILY[pair[1]]:
                return tuple(hidden_effect(one, times, sizes, rng) for one in pair)

    return Scenario(f"two effects {times:g}x", draw)


def rows() -> list[Scenario]:
    """All rows of the table."""
    found = [Scenario("no effect")]
    found += [single(term, times) for term in EFFECTS for times in (0.5, 1.0, 2.0)]
    found += [two(1.5)]
    found += [
        Scenario(f"room {size:g} µT/m", extra=strangers.Room(size)) for size in (1.0, 4.0, 16.0)
    ]
    found += [
        Scenario(f"steel passes {size:g} µT", extra=strangers.Steel(size))
        for size in (0.3, 1.0, 4.0)
    ]
    found += [
        Scenario(f"bias jumps {size:g} µT", extra=strangers.Jump(size))
        for size in (0.05, 0.1, 0.2, 0.4)
    ]
    found += [
        Scenario(f"random walk {walk:g} µT/√min", colour=Colour(walk=walk))
        for walk in (0.01, 0.03, 0.1)
    ]
    found += [
        Scenario(f"flicker floor {floor:g} µT", colour=Colour(floor=floor))
        for floor in (0.02, 0.05)
    ]
    return found
