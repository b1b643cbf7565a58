"""The steps of a rate table, as ``fit`` prints them and as its JSON holds them."""

from typing import Any, cast

import numpy as np

from imucal_wizard.core.records import dataclass
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.rows.known_rotation import KnownRotation, KnownRotationRows


@dataclass(frozen=True)
class TableStep:
    """One step of known rate, or turn of known angle.

    Attributes:
        start: s.
        end: s.
        seconds: in which the angle was turned.
        angle: by the table, rad.
        error: angle by the calibrated gyroscope less that, rad.
        axis: of the table as the gyroscope sees it, unit vector in the frame of its matrix.
        mounting: number of this axis; both senses are one.
    """

    start: float
    end: float
    seconds: float
    angle: float
    error: float
    axis: tuple[float, ...]
    mounting: int

    @property
    def rate(self) -> float:
        """Mean rate by the table, rad/s."""
        return self.angle / self.seconds


def steps_of_table(fit: SensorFit) -> list[TableStep]:
    """The steps that a gyroscope was fitted to, in the order of time; none without a table."""
    table = fit.rows
    for source, rows in zip(table.sources, table.at, strict=True) if table is not None else ():
        if isinstance(source, KnownRotation):
            known, labels = cast("KnownRotationRows", rows), source.labels
            error = np.linalg.norm(known.integral, axis=1) - source.angle
            return [
                TableStep(
                    start=float(labels.span[row, 0]),
                    end=float(labels.span[row, 1]),
                    seconds=float(source.duration[row]),
                    angle=float(source.angle[row]),
                    error=float(error[row]),
                    axis=tuple(known.axis[row].tolist()),
                    mounting=int(labels.group[row]),
                )
                for row in range(len(labels))
            ]
    return []


def table_document(fit: SensorFit) -> list[dict[str, Any]]:
    """The steps as a document of numbers, in s and rad."""
    names = ("start", "end", "seconds", "angle", "rate", "error", "axis", "mounting")
    return [{name: getattr(step, name) for name in names} for step in steps_of_table(fit)]
