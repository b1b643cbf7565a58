"""Where chance comes from: one seed, and a stream of its own for each thing that is by chance."""

from enum import IntEnum

import numpy as np


class Chance(IntEnum):
    """What is drawn; another draw of one changes nothing in the others."""

    HAND = 1
    TREMOR = 2
    SENSOR = 3
    NOISE = 4
    POSES = 5
    FIELD = 6
    FIELD_NOISE = 7
    LOAD = 8


def generator(seed: int, what: Chance) -> np.random.Generator:
    """The generator of one thing for a seed; any whole number is a seed."""
    return np.random.default_rng([seed % 2**63, int(what)])
