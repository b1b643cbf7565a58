"""How much it matters at 1 g which of two explanations is the true one."""

import numpy as np

from imucal_wizard.bench.next_poses import Explained
from imucal_wizard.effects.cost import left_by_magnitude, poses
from imucal_wizard.effects.effect import ACCELEROMETER


def difference_at_one_g(first: Explained, second: Explained) -> float:
    """Angle between the up directions by one explanation and by the other, rms, degrees.

    Both at their estimated sizes, the base model fitted to either: what the magnitude of gravity
    cannot see may still turn the vector.
    """
    c = poses()
    errors = [
        one.effect.columns(ACCELEROMETER, c, one.variant) @ one.size for one in (first, second)
    ]
    left = left_by_magnitude(c.force, errors[0] - errors[1])
    up = c.force / np.linalg.norm(c.force, axis=1, keepdims=True)
    across = left - up * (left * up).sum(axis=1, keepdims=True)
    angle = np.degrees(np.linalg.norm(across, axis=1) / c.gravity)
    return float(np.sqrt(np.mean(angle**2)))
