"""What the user says of a recording that the file itself does not say."""

from dataclasses import dataclass


@dataclass(frozen=True)
class RecordingOptions:
    """What is known about the files beyond their content; each goes over what a header says.

    Attributes:
        columns: names of the columns in their order (``ax``, ``t[ms]``, ``-`` for none).
        rate: samples per second where the file has no time column, Hz.
        accelerometer_unit: unit of the accelerations, or None when the file says it.
        gyroscope_unit: unit of the angular rates.
        magnetometer_unit: unit of the field.
        as_format: name of the format (``imu_tk`` or a wire format), or None to look at the content.
    """

    columns: tuple[str, ...] = ()
    rate: float | None = None
    accelerometer_unit: str | None = None
    gyroscope_unit: str | None = None
    magnetometer_unit: str | None = None
    as_format: str | None = None

    def unit(self, sensor: str) -> str | None:
        """The unit given for a sensor, or None."""
        return {
            "accelerometer": self.accelerometer_unit,
            "gyroscope": self.gyroscope_unit,
            "magnetometer": self.magnetometer_unit,
        }.get(sensor)
