"""A hold: the device at rest for a while, summed up so that the samples are not needed again."""

from dataclasses import dataclass

from imucal_wizard.readings import FloatArray


@dataclass(frozen=True, eq=False)
class Hold:
    """One still period.

    Attributes:
        start: time of the first sample kept, s.
        end: time just after the last sample kept, s.
        accelerometer: mean reading, shape (3,), m/s² or counts.
        accelerometer_covariance: covariance of that mean, shape (3, 3), from block means.
        gyroscope: mean reading, shape (3,), rad/s or counts; None without a gyroscope.
        gyroscope_covariance: covariance of that mean.
        samples: how many accelerometer samples were averaged.
        temperature: mean temperature, °C, or None.
        pose: the named pose it was taken as, or None.
        hand_held: taken at the operator's word although the device was not still.
    """

    start: float
    end: float
    accelerometer: FloatArray
    accelerometer_covariance: FloatArray
    gyroscope: FloatArray | None
    gyroscope_covariance: FloatArray | None
    samples: int
    temperature: float | None = None
    pose: str | None = None
    hand_held: bool = False
