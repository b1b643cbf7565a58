"""The smallest step of each axis: a reading that flickers between two neighbours is at rest."""

import numpy as np

from imucal_wizard.procedure.moments import Moment
from imucal_wizard.readings import FloatArray


class Resolution:
    """Watches the samples for their smallest steps.

    A coarse reading may not flicker at all in one pose and all the time in another, so this goes
    on after the noise has been measured.
    """

    def __init__(self) -> None:
        self._steps = [np.full(3, np.inf), np.full(3, np.inf)]

    def see(self, moment: Moment) -> bool:
        """Take a moment; whether a step smaller than all before has been seen."""
        news = False
        for index, samples in enumerate((moment.acceleration, moment.rate)):
            if samples is not None:
                steps = np.diff(np.sort(samples, axis=0), axis=0)
                smallest = np.where(steps > 0.0, steps, np.inf).min(axis=0)
                news |= bool((smallest < self._steps[index]).any())
                self._steps[index] = np.minimum(self._steps[index], smallest)
        return news

    @property
    def steps(self) -> tuple[FloatArray, FloatArray]:
        """Smallest step of each accelerometer and gyroscope axis; 0 where none was seen."""
        first, second = (np.where(np.isfinite(steps), steps, 0.0) for steps in self._steps)
        return first, second
