"""A smooth free curve of one axis, for an error that no effect of the catalogue makes.

The curve is a Gaussian process with a Matérn covariance (ν = 3/2) of the force along the axis, of
the time, or of the temperature (Rasmussen & Williams, Gaussian Processes for Machine Learning,
eq. 4.17). It is written with its values at ``NODES`` (Nyström's method), freed there from what the
base model absorbs: a constant, and for the force a straight line. With ``P K P = Σ λ_k q_k q_kᵀ``,
P the projection, the k-th column interpolates ``√n q_k`` between the n nodes, so that the curve's
mean square over the range is the sum of the squares of its coefficients, and the k-th coefficient
has the prior variance ``s² λ_k / n``. Length and size s of the process are the setting of the term,
chosen by marginal likelihood among ``SETTINGS``.

Nothing here names a cause: a curve is known only up to bias and scale, and only between the poses
that were measured.
"""

import itertools
from collections.abc import Mapping
from functools import cache

import numpy as np

from imucal_wizard.core.poses import AXES
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model import requirements
from imucal_wizard.model.effect import (
    ACCELEROMETER,
    MILLI_G,
    Against,
    Circumstances,
    Effect,
    EffectParameter,
    Story,
    warmth,
)

NAME = "unknown-shape"
LENGTHS = (0.1, 0.2, 0.4, 0.8)
"""Over which the curve changes, in halves of its range. A shorter one lies between two poses."""
SIZES = (0.03, 0.1, 0.3, 1.0, 3.0, 10.0)
"""Of the curve before its straight part is taken away, mg: a tactical part's to a bad one's."""
SETTINGS = tuple(itertools.product(LENGTHS, SIZES))
"""Length and size by the number that a calibration file keeps; new ones go to the end."""
USUAL_SETTING = SETTINGS.index((0.4, 1.0))
NODES: FloatArray = np.linspace(-1.0, 1.0, 21)
"""Places at which the process is written, a shortest length apart."""
TEMPERATURE_REACH = 20.0
"""From the session's mean to the end of the range, °C."""
TYPICAL = 3.0
"""What a consumer part's curve may be, mg: as much as its warm-up or its step."""


class UnknownShape(Effect):
    """``ε_i = f(u)``: ``f`` a smooth free curve, ``u`` the force along ``i``, time or temperature.

    Args:
        axis: 0 to 2.
        against: ``input``, ``time`` or ``temperature``.
    """

    sensors = (ACCELEROMETER,)
    free = True
    order = 900

    def __init__(self, axis: int, against: Against) -> None:
        self.axis = axis
        letter = AXES[axis]
        over = {"input": f"the force along {letter}"}.get(against, f"the {against}")
        self.against = against
        self.kind = "orientation" if against == "input" else "time"
        self.name = f"{NAME}/{letter}" + ("" if against == "input" else f"-{against}")
        self.title = f"free curve of {letter} over {over}"
        self.equation = f"ε_{letter} = f({over}), f smooth"
        self.stories = {ACCELEROMETER: _story(letter, over, against)}

    @property
    def lines(self) -> int:
        """What the base model absorbs: a constant, and of the force a straight line."""
        return 2 if self.against == "input" else 1

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """``x1``, ``x2`` and so on, the smoothest first."""
        del sensor
        count = len(NODES) - self.lines
        return tuple(
            EffectParameter(f"{AXES[self.axis]}{k + 1}", "mg", TYPICAL) for k in range(count)
        )

    def typical(self, sensor: str, variant: float | None = None) -> FloatArray:
        """Prior standard deviation of each coefficient at a setting, mg, shape (p,)."""
        del sensor
        length, size = _setting(variant)
        return size * _modes(length, self.lines)[1]

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """Shape (n, 3, p), nothing on the other two axes."""
        del sensor
        columns = np.zeros((len(c), 3, len(NODES) - self.lines))
        columns[:, self.axis] = MILLI_G * self.shape(self.place(c), variant)
        return columns

    def shape(self, place: FloatArray, variant: float | None) -> FloatArray:
        """The curve per coefficient at these places of the range −1 to 1, shape (n, p).

        Beyond the range the curve keeps its last value: nothing is known there.
        """
        length, _ = _setting(variant)
        weights, _ = _modes(length, self.lines)
        inside = np.clip(place, -1.0, 1.0)
        straight = inside[:, None] ** np.arange(self.lines)
        return np.asarray(np.hstack([_covariance(inside, NODES, length), straight]) @ weights)

    def place(self, c: Circumstances) -> FloatArray:
        """Where in the range of the curve each row lies, −1 to 1, shape (n,).

        The range of the force is 1 g to either side, of the time the session, of the temperature
        ``TEMPERATURE_REACH`` about the session's mean.
        """
        if self.against == "input":
            return c.force[:, self.axis] / c.gravity
        if self.against == "time":
            return c.time / max(c.reference_time, 1e-9) - 1.0
        return warmth(c) / TEMPERATURE_REACH

    def variants(self, c: Circumstances) -> tuple[float | None, ...]:
        """The numbers of the settings."""
        del c
        return tuple(float(number) for number in range(len(SETTINGS)))

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """Poses, a duration or temperatures that differ."""
        del sensor
        needs = {"time": requirements.duration, "temperature": requirements.temperatures}
        return needs.get(self.against, requirements.directions)(c)


def _setting(variant: float | None) -> tuple[float, float]:
    """Length and size of a setting."""
    return SETTINGS[USUAL_SETTING if variant is None else int(variant)]


def _covariance(a: FloatArray, b: FloatArray, length: float) -> FloatArray:
    """Matérn's with ν = 3/2 between places, shape (a, b)."""
    apart = np.sqrt(3.0) * np.abs(a[:, None] - b) / length
    return np.asarray((1.0 + apart) * np.exp(-apart))


@cache
def _modes(length: float, lines: int) -> tuple[FloatArray, FloatArray]:
    """What the covariances with the nodes and the straight part are multiplied by, and the prior.

    Returns:
        Shape (nodes + lines, p), and the standard deviations of the coefficients at a size of one,
        shape (p,).
    """
    count = len(NODES)
    kernel = _covariance(NODES, NODES, length)
    straight = NODES[:, None] ** np.arange(lines)
    fitted = np.linalg.pinv(straight)
    across = np.eye(count) - straight @ fitted
    values, vectors = np.linalg.eigh(across @ kernel @ across)
    order = np.argsort(-values)[: count - lines]
    # before the projection a mode's values at the nodes are those of K q: its interpolation
    # between them is k(u)ᵀ q, less the line that its values at the nodes have
    raw = vectors[:, order]
    scale = np.sqrt(count) / values[order]
    weights = np.vstack([raw, -fitted @ kernel @ raw]) * scale
    return weights, np.sqrt(values[order] / count)


_CAUSES: Mapping[Against, str] = {
    "input": "bend a characteristic like this are a converter with missing codes, a mass that "
    "sticks or rubs, electronics that switch between ranges",
    "time": "move a zero like this are a loose board or connector, an unstable supply, warmth from "
    "a neighbour that comes and goes",
    "temperature": "move a zero like this are glue or a package that yields at one temperature, "
    "and a compensation table inside the chip that changes from one entry to the next",
}
_CONFIRM: Mapping[Against, str] = {
    "input": "Measure again with poses between those of the steepest part. A property of the "
    "sensor gives the same curve on another day.",
    "time": "Leave the device untouched in one pose for as long as the session lasted. If the "
    "curve comes again at the same time after switching on, it belongs to the sensor; if it comes "
    "at another time, to its surroundings.",
    "temperature": "Leave the device untouched in one pose, warm it slowly and let it cool again. "
    "A property of the sensor gives the same curve both ways.",
}


def _story(letter: str, over: str, against: Against) -> Story:
    absorbed = "bias and scale" if against == "input" else "the bias"
    return Story(
        what=f"Nothing in the catalogue makes this error. The {letter} axis has an error that "
        f"follows {over}, and the curve shows how. It names no cause. Causes that "
        f"{_CAUSES[against]}.",
        equation=f"error on {letter} = a smooth curve over {over}. Over how short a distance it "
        "may change, and how large it may be, is what the data make likeliest among "
        f"{len(LENGTHS)} lengths and {len(SIZES)} sizes (marginal likelihood of a Gaussian "
        "process).",
        signature=f"Drawn over {over}, the points follow one curve; over anything else they "
        f"scatter. The curve is known only up to {absorbed}: what is straight in it is in the base "
        "model already. Between two poses far apart the curve is only a guess.",
        needs=f"Many holds at different values of {over}, close together where the curve is steep: "
        "three holds inside a step are the fewest that show its width.",
        remedy="Look for the cause first: a curve that is not understood may change. Add the term "
        "only if data held out confirm it, and apply it only inside the range that was measured; "
        "beyond it the curve keeps its last value.",
        confirm=_CONFIRM[against],
        source="Rasmussen and Williams, Gaussian Processes for Machine Learning (2006), chapters "
        "2 and 5.",
    )


FREE_CURVES = tuple(
    UnknownShape(axis, against)
    for against in ("input", "time", "temperature")
    for axis in range(len(AXES))
)
"""One of each axis against each influence."""
