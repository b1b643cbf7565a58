"""What is hidden in a recording, and what would be right to say of it."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field

import numpy as np

from benchmarks.hidden import strangers
from benchmarks.hidden.noise import Colour
from benchmarks.hidden.recording import Extra
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model.catalogue import builtin_effects, effects_for
from imucal_wizard.model.catalogue import effect as known_effect
from imucal_wizard.model.effect import ACCELEROMETER
from imucal_wizard.simulate.hidden import Hidden

EFFECTS = tuple(effect.name for effect in effects_for(ACCELEROMETER))
FAMILY = {effect.name: effect.family or effect.name for effect in builtin_effects()}

LARGEST = 5.0
"""Parameters that these poses show only at more than so many typical sizes are not hidden."""

Sizes = Mapping[str, FloatArray]
"""The nameable size of each parameter of each effect."""
Draw = Callable[[np.random.Generator, Sizes], tuple[Hidden, ...]]


def nothing(rng: np.random.Generator, sizes: Sizes) -> tuple[Hidden, ...]:
    """No effect."""
    del rng, sizes
    return ()


@dataclass(frozen=True)
class Scenario:
    """One row of the table.

    Attributes:
        name: of the row.
        draw: the effects hidden in one recording.
        extra: what is hidden that no effect makes.
        colour: what the noise becomes.
        disturbed: one hold is disturbed, and saying so is right.
    """

    name: str
    draw: Draw = nothing
    extra: Extra | None = None
    colour: Callable[[Colour], Colour] = field(default=lambda colour: colour)
    disturbed: bool = False


def hidden_effect(
    term: str, times: float, sizes: Sizes, rng: np.random.Generator, axis: int | None = None
) -> Hidden:
    """An effect on an axis and with a sign by chance, at a multiple of its nameable size.

    One that the program names at no size has the largest that is hidden.
    """
    parameters = known_effect(term).parameters(ACCELEROMETER)
    largest = LARGEST * np.array([one.typical for one in parameters])
    nameable = np.where(np.isfinite(sizes[term]), sizes[term], largest)
    visible = np.flatnonzero(nameable < largest)
    if not len(visible):
        visible = np.array([np.argmin(nameable)])
    place = int(rng.choice(visible)) if axis is None else axis
    axes = tuple("xyz".index(letter) for letter in parameters[place].name)
    size = times * float(nameable[place])
    return Hidden(ACCELEROMETER, term, size * float(rng.choice((-1.0, 1.0))), axes)


def nameable_at_all(hidden: Hidden) -> bool:
    """Whether the program calls an effect that is hidden at its nameable size nameable."""
    effect = known_effect(hidden.term)
    largest = LARGEST * max(one.typical for one in effect.parameters(hidden.sensor))
    return abs(hidden.size) < largest


def single(term: str, times: float) -> Scenario:
    """One effect at a multiple of its nameable size."""

    def draw(rng: np.random.Generator, sizes: Sizes) -> tuple[Hidden, ...]:
        return (hidden_effect(term, times, sizes, rng),)

    return Scenario(f"{term} {times:g}x", draw)


def everywhere(term: str, times: float) -> Scenario:
    """One effect on all three axes, each at a multiple of its nameable size."""

    def draw(rng: np.random.Generator, sizes: Sizes) -> tuple[Hidden, ...]:
        return tuple(hidden_effect(term, times, sizes, rng, axis) for axis in range(3))

    return Scenario(f"{term} on three axes {times:g}x", draw)


def two(times: float) -> Scenario:
    """Two effects of different families, of those that the session shows at any size."""

    def draw(rng: np.random.Generator, sizes: Sizes) -> tuple[Hidden, ...]:
        known = [term for term in EFFECTS if np.isfinite(sizes[term]).any()]
        while True:
            first, second = rng.choice(known, 2, replace=False)
            if FAMILY[first] != FAMILY[second]:
                break
        return tuple(hidden_effect(str(t), times, sizes, rng) for t in (first, second))

    return Scenario(f"two effects {times:g}x", draw)


def bent(times: float) -> Scenario:
    """Second and third order on one axis."""

    def draw(rng: np.random.Generator, sizes: Sizes) -> tuple[Hidden, ...]:
        axis = int(rng.integers(3))
        terms = ("second-order", "third-order")
        return tuple(hidden_effect(term, times, sizes, rng, axis) for term in terms)

    return Scenario(f"second + third order on one axis {times:g}x", draw)


def _extra(name: str, extra: Extra, disturbed: bool = False) -> Scenario:
    return Scenario(name, extra=extra, disturbed=disturbed)


def _noise(name: str, **change: float) -> Scenario:
    def changed(colour: Colour) -> Colour:
        return Colour(**{**asdict(colour), **change})

    return Scenario(name, colour=changed)


NOISE = 0.12
"""Noise of a hold of the consumer sensor, mg; what is outside the catalogue is sized by it."""


def usual() -> list[Scenario]:
    """The rows that the thresholds were chosen with."""
    found = [Scenario("no effect")]
    found += [single(term, times) for term in EFFECTS for times in (0.5, 1.0, 2.0)]
    found += [two(1.0), two(1.5), bent(1.0), bent(1.5)]
    for times in (2.0, 4.0, 8.0):
        found += [
            _extra(f"ripple {times:g} sigma", strangers.Ripple(times * NOISE)),
            _extra(f"any ripple {times:g} sigma", strangers.AnyRipple(times * NOISE)),
            _extra(f"field l=5 {times:g} sigma", strangers.Field(times * NOISE)),
            _noise(f"placement scatter {times:g} sigma", scatter=times * NOISE),
        ]
    found += [
        _extra(f"disturbed hold {times:g} sigma", strangers.Disturbed(times * NOISE), True)
        for times in (5.0, 10.0)
    ]
    found += [_noise(f"random walk {walk:g} mg/√min", walk=walk) for walk in (0.1, 0.3)]
    found += [_noise(f"flicker floor {floor:g} mg", floor=floor) for floor in (0.06, 0.12)]
    return found


def fresh() -> list[Scenario]:
    """Rows that nothing was chosen with."""
    found = [Scenario("no effect")]
    found += [everywhere(term, 0.75) for term in EFFECTS if term != "cross-product"]
    found += [two(2.0), bent(2.0), bent(0.75)]
    for times in (1.5, 3.0, 6.0, 12.0):
        found += [
            _extra(f"long wave {times:g} sigma", strangers.AnyRipple(times * NOISE, (3.5, 5.0))),
            _extra(f"short wave {times:g} sigma", strangers.AnyRipple(times * NOISE, (12.0, 16.0))),
            _extra(f"jump in the characteristic {times:g} sigma", strangers.Jump(times * NOISE)),
        ]
        found += [
            _extra(f"field l={degree} {times:g} sigma", strangers.Field(times * NOISE, degree))
            for degree in (4, 6, 7)
        ]
    found += [
        _noise(f"placement scatter {times:g} sigma", scatter=times * NOISE) for times in (3, 6)
    ]
    found += [_extra("disturbed hold 20 sigma", strangers.Disturbed(20 * NOISE), True)]
    found += [_noise(f"random walk {walk:g} mg/√min", walk=walk) for walk in (0.05, 0.2, 0.6)]
    found += [_noise(f"flicker floor {floor:g} mg", floor=floor) for floor in (0.09, 0.2)]
    return found
