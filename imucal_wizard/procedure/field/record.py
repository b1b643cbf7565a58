"""Every sample of the magnetometer, whatever step it fell in."""

import numpy as np

from imucal_wizard.procedure.field.growing import Growing
from imucal_wizard.readings import Series


class FieldRecord:
    """Keeps the samples for the fit, which looks at rests and rotations, too."""

    def __init__(self) -> None:
        self._rows = Growing(4)
        self._unit = ""

    def add(self, series: Series) -> None:
        """Take the next samples."""
        self._unit = series.unit
        self._rows.add(np.column_stack([series.time, series.values]))

    def series(self) -> Series | None:
        """All of them, or None."""
        if not len(self._rows):
            return None
        rows = self._rows.rows
        return Series(rows[:, 0], rows[:, 1:], self._unit)
