"""One offset and one scale per axis, which is all that flight controllers know of a sensor.

``corrected = scale · (raw − offset)``. Readings that a controller had corrected already by ``(o₁,
s₁)`` and that a calibration corrects further by ``(o₂, s₂)`` are composed, never corrected twice:

    s₂ (s₁ (raw − o₁) − o₂) = s₁ s₂ (raw − (o₁ + o₂ / s₁))
"""

import re
from collections.abc import Callable, Sequence
from contextlib import suppress

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.units import COUNT, SI_UNIT, STANDARD_GRAVITY
from imucal_wizard.model.effects.bias_temperature import BiasTemperature
from imucal_wizard.report.calibration_file import Calibration, SavedEffect, Sensor
from imucal_wizard.report.proof import Correction, Samples

USUAL_COUNTS_PER_G = 2048.0
"""Of most accelerometers of flight controllers."""

MAX_FROM_NOMINAL = 0.05
"""Relative difference of a scale from the nominal one: data sheets allow 3 %."""
_READS = "# one g reads nominally "
ASSUMED = (
    "the controller is assumed to have applied no correction during the recording; if it did, "
    "give its parameters of that time, and both corrections are combined"
)
"""Said where the present parameters are not given."""


@dataclass(frozen=True, eq=False)
class Axes:
    """Offsets, reading unit, and scales, shape (3,) each."""

    offset: FloatArray
    scale: FloatArray

    def corrected(self, raw: FloatArray) -> FloatArray:
        """Corrected readings, shape (n, 3)."""
        return np.asarray(self.scale * (raw - self.offset))

    def raw(self, corrected: FloatArray) -> FloatArray:
        """The readings before the correction, shape (n, 3)."""
        return np.asarray(corrected / self.scale + self.offset)

    def then(self, further: "Axes") -> "Axes":
        """This correction and then a further one, as one."""
        return Axes(self.offset + further.offset / self.scale, self.scale * further.scale)


NEUTRAL = Axes(np.zeros(3), np.ones(3))
"""No correction."""


def axes_of(sensor: Sensor) -> Axes:
    """Offset and scale of a calibration without non-orthogonality."""
    return Axes(np.array(sensor.bias), np.diag(sensor.matrix).copy())


def follows_temperature(one: SavedEffect) -> bool:
    """Whether an effect is a bias that is linear in the temperature."""
    return one.term == "bias-temperature"


def warming(name: str, sensor: Sensor) -> tuple[FloatArray, float] | None:
    """Rise of the corrected value with temperature, SI per °C, and where it is zero, °C.

    None where the calibration has none.
    """
    for one in sensor.effects:
        if follows_temperature(one) and one.reference_temperature is not None:
            si = BiasTemperature.sizes[name].si
            return si * np.array(one.sizes), one.reference_temperature
    return None


def one_g(sensor: Sensor, stated: float | None) -> float:
    """What 1 g reads nominally.

    In counts that is what the controller has, if the readings may be its own, or else the nearest
    power of two, as the ranges of most chips are.

    Args:
        sensor: the accelerometer.
        stated: counts per g of the controller, or None.

    Raises:
        UsageError: the readings are near neither, so that nobody knows their nominal scale.
    """
    if sensor.bias_unit == SI_UNIT["accelerometer"]:
        return STANDARD_GRAVITY
    reads = STANDARD_GRAVITY / abs(np.linalg.det(sensor.matrix)) ** (1.0 / 3.0)
    usual = float(2.0 ** round(float(np.log2(reads))))
    known = (stated or usual, usual)
    near = [one for one in known if abs(reads / one - 1.0) < MAX_FROM_NOMINAL]
    if not near:
        raise UsageError(
            f"1 g reads {reads:.4g} counts, and most chips have a power of two ({usual:g}): the "
            "nominal scale of these readings is not known. If they are those of the controller, "
            "state its counts per g; otherwise calibrate readings in m/s²",
            settings=("counts_per_g",),
        )
    return near[0]


def head(calibration: Calibration) -> str:
    """The comment with which a parameter file begins."""
    return f"# {calibration.made_by}"


@dataclass(frozen=True)
class Counts:
    """What 1 g reads nominally.

    Attributes:
        here: in the readings that were calibrated.
        there: in the controller, counts.
    """

    here: float
    there: float

    @classmethod
    def of(cls, sensor: Sensor, counts_per_g: float | None) -> "Counts":
        """Of an accelerometer, for a controller with so many counts or the usual number.

        Raises:
            UsageError: nobody knows the nominal scale of the readings.
        """
        return cls(one_g(sensor, counts_per_g), counts_per_g or USUAL_COUNTS_PER_G)

    @classmethod
    def read(cls, data: bytes) -> "Counts":
        """Those that ``commands`` has written.

        Raises:
            LookupError: there are none.
        """
        words = data.decode().split(_READS)[1].split()
        return cls(float(words[0]), float(words[3]))

    def commands(self, calibration: Calibration, lines: Sequence[str]) -> bytes:
        """These settings of a controller that counts, for its command line."""
        reads = f"{_READS}{self.here:.9g} here and {self.there:.9g} in the controller"
        return ("\n".join([head(calibration), reads, *lines, "save"]) + "\n").encode()


def read_counts(
    axes_in: Callable[[bytes | None], Axes], data: bytes, present: bytes | None
) -> dict[str, Correction]:
    """A controller's formula in counts, as accelerations.

    Args:
        axes_in: finds offsets and scales in the settings of the controller.
        data: the settings that were exported.
        present: those that it applied while it was recorded, or None.

    Raises:
        LookupError: the settings were not exported by this program.
        ValueError: they are not there.
    """
    new, before, g = axes_in(data), axes_in(present), Counts.read(data)

    def correct(samples: Samples) -> FloatArray:
        adc = before.raw(samples.reading * g.there / g.here)
        return np.asarray(new.corrected(adc) * STANDARD_GRAVITY / g.there)

    return {"accelerometer": correct}


def notes_of_counts(
    calibration: Calibration, counts_per_g: float | None, present: bytes | None
) -> tuple[str, ...]:
    """What a controller that counts leaves open."""
    notes = ["the controller measures the gyroscope's bias itself at every start"]
    sensor = calibration["accelerometer"]
    g = Counts.of(sensor, counts_per_g)
    if counts_per_g is None:
        notes.append(f"1 g is taken for {g.there:g} counts in the controller")
    if sensor.bias_unit == COUNT:
        notes.append(f"1 g is taken for {g.here:g} counts in the readings")
    if present is None:
        notes.append(ASSUMED)
    return tuple(notes)


def named_values(data: bytes | None) -> dict[str, float]:
    """Parameters of a file with a name and a number in each line; "#" begins a comment.

    The name and the number stand side by side: ArduPilot's ``NAME value`` and ``NAME,value``, PX4's
    ``1 1 NAME value type``, and ``set name = value,value`` of a command line, whose values are
    ``name/0``, ``name/1``. What is no number is left out.

    Raises:
        ValueError: there is none.
    """
    found: dict[str, float] = {}
    for line in (data or b"").decode(errors="replace").splitlines():
        text = line.partition("#")[0].strip()
        key, is_set, values = text.removeprefix("set ").partition("=")
        if text.startswith("set ") and is_set:
            texts = {f"{key.strip()}/{at}": one for at, one in enumerate(values.split(","))}
        else:
            match = re.search(r"([A-Za-z]\w+)[\s,=]+([-+0-9.eE]+)", text)
            texts = {match.group(1): match.group(2)} if match else {}
        for name, one in texts.items():
            with suppress(ValueError):
                found[name] = float(one)
    if data is not None and not found:
        raise ValueError("no parameter in it")
    return found


def three(values: dict[str, float], names: str, default: float) -> FloatArray:
    """The values of three axes.

    Args:
        values: by name.
        names: with ``{axis}`` for ``X``, ``Y``, ``Z``.
        default: of those that are not there.
    """
    return np.array([values.get(names.format(axis=axis), default) for axis in "XYZ"])


def check_range(name: str, values: FloatArray, low: float, high: float) -> None:
    """Refuse values that the controller does not take.

    Raises:
        UsageError: one is outside of its range.
    """
    for axis, value in zip("XYZ", values, strict=True):
        if not low <= value <= high:
            raise UsageError(
                f"{name.format(axis=axis)} would be {value:.4g}, and the controller takes {low:g} "
                f"to {high:g}: check the unit and the range of the readings"
            )
