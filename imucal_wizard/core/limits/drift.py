"""By how much a sensor that is unchanged differs from its calibration, by its grade.

The standard deviations are those of data sheets: repeatability from one start to the next, change
over a year, temperature coefficients. MEMS of the consumer grade state 0.1 to 1 mg, 0.02 to 0.1 °/s
and 50 to 200 ppm/°C; better grades are bought for a fifth and a twenty-fifth of these.
"""

from imucal_wizard.core.records import dataclass, fields_of
from imucal_wizard.core.units import RATE_UNITS, STANDARD_GRAVITY

_MILLI_G, _DEGREE = STANDARD_GRAVITY / 1000.0, RATE_UNITS["deg/s"]


@dataclass(frozen=True)
class UsualDrift:
    """Standard deviations of each axis; of a bias in m/s² or rad/s, of a scale relative.

    Attributes:
        bias: from one start to the next.
        bias_per_year: grows with the root of the time.
        bias_per_degree: per °C, where no coefficient is known.
        scale: from one start to the next.
        scale_per_year: grows with the root of the time.
        scale_per_degree: per °C, where no coefficient is known.
        angle: of an axis against another, rad.
    """

    bias: float
    bias_per_year: float
    bias_per_degree: float
    scale: float
    scale_per_year: float
    scale_per_degree: float
    angle: float

    def of_grade(self, share: float) -> "UsualDrift":
        """The drift of a better grade, which is a share of this one."""
        return UsualDrift(*(share * value for value in fields_of(self).values()))


_CONSUMER: dict[str, UsualDrift] = {
    "accelerometer": UsualDrift(
        0.5 * _MILLI_G, 1.0 * _MILLI_G, 0.2 * _MILLI_G, 2e-4, 1e-3, 5e-5, 2e-4
    ),
    "gyroscope": UsualDrift(0.05 * _DEGREE, 0.1 * _DEGREE, 0.015 * _DEGREE, 5e-4, 1e-3, 1e-4, 5e-4),
}
DRIFT: dict[str, dict[str, UsualDrift]] = {
    grade: {sensor: drift.of_grade(share) for sensor, drift in _CONSUMER.items()}
    for grade, share in (("consumer", 1.0), ("industrial", 0.2), ("tactical", 0.04))
}
"""By grade and sensor."""

CHANGES: dict[str, tuple[float, float]] = {
    "accelerometer": (5.0 * _MILLI_G, 0.005),
    "gyroscope": (0.5 * _DEGREE, 0.01),
}
"""Changes of a bias (m/s², rad/s) and of a scale (relative) that a recheck has to see on each axis:
a shock or a soldering iron makes such changes, and they tilt a horizon by 0.3°."""
MOUNTED_ANEW = 0.01
"""rad; a sensor that is taken off its board and mounted again turns by about as much."""
POWER = 0.99
"""Probability with which it has to see each of them."""
NO_GO_BY_CHANCE = 0.01
"""Probability of a NO-GO for an unchanged device, over all its sensors together."""
USUAL_RATE = 60.0 * _DEGREE
"""Rate at which a gyroscope's error is stated, rad/s: that of a leisurely hand."""
UNKNOWN_TEMPERATURE = 2.0
"""Difference of temperature between calibration and recheck without a thermometer, °C."""
