"""Six-position method: bias and sensitivity of each axis from its two positions (Q, eq. 13–14).

Each axis points up once and down once, and only its own reading is looked at:

    k = (a_up − a_down) / (2 g)        (13)
    b = (a_up + a_down) / 2            (14)

The ``k`` of eq. 13 is a sensitivity, reading per input. Eq. 5 and 8 multiply the reading by ``K``,
so that the correction is ``1/k``. The angles stay at zero.
"""

from collections.abc import Mapping

import numpy as np

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, IntArray
from imucal_wizard.estimate.method_data import Magnitudes, MethodEstimate
from imucal_wizard.estimate.methods import Method
from imucal_wizard.estimate.result import SensorFit

NAME = "six-position"


def run(data: Magnitudes) -> SensorFit:
    """Bias and scale by the faces; positions that show no face on top are not used."""
    diagonal = data.without_angles(
        "the six-position method leaves all angles at their nominal value"
    )
    return diagonal.judged(NAME, lambda points, rows: from_faces(data, points, rows))


def from_faces(data: Magnitudes, points: FloatArray, rows: IntArray) -> MethodEstimate:
    """Eq. 13–14 from some of the points, the mean of each face standing for it.

    Raises:
        DataError: a face is missing.
    """
    faces = {name: np.intersect1d(found, rows) for name, found in data.faces.items()}
    means = {name: points[found].mean(axis=0) for name, found in faces.items() if len(found)}
    bias, sensitivity = six_position(means, 1.0)
    return MethodEstimate(np.diag(1.0 / sensitivity), bias, each_axis_alone=True)


def six_position(faces: Mapping[str, FloatArray], gravity: float) -> tuple[FloatArray, FloatArray]:
    """Bias and sensitivity of each axis from its up and its down position.

    Args:
        faces: mean reading, shape (3,), by face on top: ``+x``, ``-x`` … ``-z``.
        gravity: m/s².

    Returns:
        Bias (reading units, shape (3,)) and sensitivity (reading per m/s², shape (3,)).

    Raises:
        DataError: a face is missing or an axis does not see gravity.
    """
    missing = [face for axis in "xyz" for face in (f"+{axis}", f"-{axis}") if face not in faces]
    if missing:
        raise DataError(
            f"six positions are needed; missing with this face up: {', '.join(missing)}"
        )
    up = np.array([faces[f"+{axis}"][i] for i, axis in enumerate("xyz")])
    down = np.array([faces[f"-{axis}"][i] for i, axis in enumerate("xyz")])
    sensitivity = (up - down) / (2.0 * gravity)  # Eq. 13
    if (sensitivity == 0.0).any():
        dead = ", ".join(axis for axis, k in zip("xyz", sensitivity, strict=True) if k == 0.0)
        raise DataError(f"axis {dead} reads the same up and down: it is dead or not connected")
    return (up + down) / 2.0, sensitivity  # Eq. 14


METHODS = (
    Method(
        NAME,
        ("accelerometer",),
        "bias and scale from the six faces (eq. 13–14)",
        "Q",
        run,
        each_axis_alone=True,
    ),
)
