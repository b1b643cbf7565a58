"""Kalibr: ``imu.yaml`` with the noise, and the intrinsics of its model ``scale-misalignment``.

    y_a = M_a a + b_a,    y_g = M_g C w + A (C a) + b_g

from the true values to the readings, M lower triangular and C a rotation. Our body frame has an
upper triangular matrix, so Kalibr's is turned against it: with ``M_a = L Q`` (LQ decomposition of
our inverse matrix) Kalibr's body frame is ours turned by Q. Kalibr estimates the biases itself.
"""

import re
from typing import Any

import numpy as np
from numpy.typing import NDArray

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import median
from imucal_wizard.report.calibration_file import Calibration, Sensor
from imucal_wizard.report.exports import BACKWARD, ExportSettings, ExportTarget, Files
from imucal_wizard.report.exports.imucal import is_g_sensitivity, sensitivity_to_g
from imucal_wizard.report.proof import Correction, Samples
from imucal_wizard.report.reduced import Kept

_NOISE = {
    "accelerometer": ("accelerometer_scatter", 3e-4, "m/s^2/sqrt(Hz)", "m/s^3/sqrt(Hz)"),
    "gyroscope": ("gyroscope_scatter", 2e-5, "rad/s/sqrt(Hz)", "rad/s^2/sqrt(Hz)"),
}
"""Where the scatter of the samples stands, and the random walk of a consumer part: that of an
ADIS16448 is 2e-4 and 4e-6 (Kalibr's example), cheap parts have several times as much."""


def _lower(sensitivity: NDArray[Any]) -> tuple[FloatArray, FloatArray]:
    """``S = L Q`` with L lower triangular of positive diagonal and Q orthogonal."""
    q, r = np.linalg.qr(sensitivity.T)
    signs = np.where(np.diag(r) < 0.0, -1.0, 1.0)
    return np.asarray((signs[:, None] * r).T), np.asarray((q * signs).T)


def _density(calibration: Calibration, sensor: str, scatter: str) -> float | None:
    """White noise of one axis, SI/√Hz, from the scatter of the samples in the holds."""
    holds = [one for one in calibration.hold_means if getattr(one, scatter) is not None]
    if not holds or sensor not in calibration.sensors:
        return None
    powers = [np.mean(getattr(one, scatter)) * (one.end - one.start) for one in holds]
    gain = np.cbrt(abs(np.linalg.det(calibration[sensor].matrix)))
    return float(gain * np.sqrt(median(powers)))


def _noise(calibration: Calibration, settings: ExportSettings) -> list[str]:
    """The six lines that Kalibr asks for."""
    lines = []
    for sensor, (scatter, typical, white_unit, walk_unit) in _NOISE.items():
        given = settings.noise.get(sensor, {})
        white, source = given.get("white"), "Allan deviation"
        if white is None:
            white, source = _density(calibration, sensor, scatter), "scatter within the holds"
        if white is not None:
            lines.append(f"{sensor}_noise_density: {white:.9e}  # {white_unit}, {source}")
        walk, source = given.get("random_walk"), "Allan deviation"
        if walk is None:
            walk, source = typical, "not measured: a typical consumer part"
        lines.append(f"{sensor}_random_walk: {walk:.9e}  # {walk_unit}, {source}")
    rates = [one.samples / (one.end - one.start) for one in calibration.hold_means if one.samples]
    rate = f"{median(rates):.6g}  # Hz" if rates else "100  # Hz, not known: set your own"
    return [*lines, f"update_rate: {rate}", "rostopic: /imu0"]


def _matrix(name: str, values: FloatArray) -> list[str]:
    rows = [", ".join(f"{value:.17g}" for value in row) for row in values + 0.0]  # no −0
    return [f"  {name}:", *(f"  - [{row}]" for row in rows)]


def _write(calibration: Calibration, settings: ExportSettings) -> Files:
    lines = [*_noise(calibration, settings), "model: scale-misalignment"]
    turn = np.eye(3)
    if "accelerometer" in calibration.sensors:
        sensor = calibration["accelerometer"]
        lower, turn = _lower(np.linalg.inv(sensor.matrix))
        lines += ["accelerometers:", *_matrix("M", lower), *_bias(sensor)]
    if "gyroscope" in calibration.sensors:
        sensor = calibration["gyroscope"]
        per_rate = np.linalg.inv(sensor.matrix)
        lower, mounting = _lower(per_rate @ turn.T)
        # A acts on C a, and a in Kalibr's frame is turn @ ours
        cross = per_rate @ sensitivity_to_g(sensor) @ turn.T @ mounting.T
        lines += ["gyroscopes:", *_matrix("M", lower), *_matrix("A", cross)]
        lines += [*_matrix("C_gyro_i", mounting), *_bias(sensor)]
    return {"": ("\n".join(lines) + "\n").encode()}


def _bias(sensor: Sensor) -> list[str]:
    numbers = ", ".join(f"{one:.17g}" for one in sensor.bias)
    return [f"  # bias in this calibration: [{numbers}] {sensor.bias_unit}"]


def _read(files: Files, settings: ExportSettings) -> dict[str, Correction]:
    """Kalibr's model, solved for the true values; with the biases of the comments.

    Raises:
        ValueError: it is no such file.
    """
    del settings
    text = files[""].decode()
    if "accelerometer_random_walk" not in text:
        raise ValueError("no imu.yaml of Kalibr")
    sections = re.split(r"^(accelerometers|gyroscopes):$", text, flags=re.MULTILINE)
    found = dict(zip(sections[1::2], sections[2::2], strict=True))

    def matrix(section: str, name: str) -> FloatArray:
        lines = section.split(f"  {name}:\n")[1].splitlines()[:3]
        return np.array([[float(word) for word in line[5:-1].split(",")] for line in lines])

    def bias(section: str) -> FloatArray:
        words = section.split("bias in this calibration: [")[1].partition("]")[0]
        return np.array([float(word) for word in words.split(",")])

    out: dict[str, Correction] = {}
    acceleration: Correction | None = None
    if "accelerometers" in found:
        part = found["accelerometers"]
        back, zero = np.linalg.inv(matrix(part, "M")), bias(part)

        def acceleration(samples: Samples) -> FloatArray:
            return np.asarray((samples.accelerometer - zero) @ back.T)

        out["accelerometer"] = acceleration
    if "gyroscopes" in found:
        part = found["gyroscopes"]
        M, A, C, at_rest = *(matrix(part, name) for name in ("M", "A", "C_gyro_i")), bias(part)

        def rate(samples: Samples) -> FloatArray:
            felt = samples.where.force * 0.0 if acceleration is None else acceleration(samples)
            turned = np.linalg.solve(M, (samples.reading - at_rest - felt @ C.T @ A.T).T)
            return np.asarray((C.T @ turned).T)

        out["gyroscope"] = rate
    return out


def _notes(calibration: Calibration, settings: ExportSettings) -> tuple[str, ...]:
    missing = [
        name
        for name in ("accelerometer", "gyroscope")
        if name in calibration.sensors and "random_walk" not in settings.noise.get(name, {})
    ]
    unknown = [
        name
        for name, (scatter, *_) in _NOISE.items()
        if "white" not in settings.noise.get(name, {})
        and _density(calibration, name, scatter) is None
    ]
    says = []
    if missing:
        both = " and ".join(missing)
        says.append(f"the random walk of the {both} was not measured: the file has a typical value")
    if unknown:
        both = " and ".join(unknown)
        says.append(
            f"Kalibr reads the file only with the noise of both sensors, and that of the {both} is "
            "not known: measure it at rest and export again with the result"
        )
    return tuple(says)


TARGET = ExportTarget(
    name="kalibr",
    title="Kalibr: imu.yaml with noise and intrinsics",
    formula="y_a = M_a a + b_a;  y_g = M_g C w + A (C a) + b_g",
    suffix=".yaml",
    cannot_hold=(
        "biases: Kalibr estimates them itself; they stand in comments",
        "magnetometer",
        "effects other than g-sensitivity",
        "standard errors",
        "this program's body frame: Kalibr's accelerometer matrix is lower triangular",
    ),
    keeps={"accelerometer": Kept(), "gyroscope": Kept(takes=is_g_sensitivity)},
    write=_write,
    read=_read,
    direction=BACKWARD,
    counts=False,
    notes=_notes,
    frame=True,
    uses=("noise",),
)
