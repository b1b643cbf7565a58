"""A device of known errors, far from an ideal one, and the calibration file that is true of it.

All readings are made here from the equations of the sensors, and share no formula with the program.
"""

from functools import cache

import numpy as np

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.report.calibration_file import Calibration, SavedEffect, Sensor, Value
from imucal_wizard.report.measured import FieldMean, HoldMeans, RotationIncrements

G = 9.80665
MATRIX = np.array([[1.02, 0.03, -0.01], [0.0, 0.97, 0.02], [0.0, 0.0, 1.05]])
BIAS = np.array([0.3, -0.5, 0.8])
TURNING = np.array([[1.3, 0.2, -0.1], [0.15, 0.8, 0.25], [-0.2, 0.1, 1.2]])
"""Sensitivity of the gyroscope: reading per rad/s, in the accelerometer's frame."""
USUAL = np.array([[1.02, 0.01, -0.02], [0.015, 0.98, 0.01], [-0.01, 0.02, 1.03]])
"""The same of a usual one."""
DRIFT = np.array([0.02, -0.05, 0.03])
FELT = np.array([[0.3, -0.2, 0.1], [0.05, 0.4, -0.3], [-0.15, 0.25, 0.2]])
"""g-sensitivity of the gyroscope, °/s per g."""
IRON = np.array([[1.4, 0.25, -0.1], [0.25, 0.75, 0.15], [-0.1, 0.15, 1.1]])
MOUNTED = np.array([[0.6, -0.8, 0.0], [0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
HARD_IRON = np.array([12.0, -30.0, 7.0])
FIELD = 48.0


def turn(vector: FloatArray) -> FloatArray:
    """Rotation matrix of a rotation vector (Rodrigues)."""
    angle = float(np.linalg.norm(vector))
    n = vector / max(angle, 1e-12)
    cross = np.array([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross)


def moved(
    up: FloatArray, axis: FloatArray, angle: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """A soft rotation in two seconds: times, rotation vectors, up directions, up at its end."""
    time = np.linspace(0.0, 2.0, 401)
    turned = angle * (0.5 * time - np.sin(np.pi * time) / (2.0 * np.pi))
    ups = np.array([turn(axis * one).T @ up for one in turned])
    return time, turned[:, None] * axis, ups, ups[-1]


@cache
def calibration(unit: str = "m/s^2", turns: int = 24, felt: bool = True) -> Calibration:
    """The true calibration of accelerometer, gyroscope and magnetometer, with what they read.

    With g-sensitivity the gyroscope is far from an ideal one.
    """
    random = np.random.default_rng(5)
    up, ups, rotations = np.array([0.0, 0.0, 1.0]), [], []
    ups.append(up)
    gain = TURNING if felt else USUAL
    sensitivity = FELT * np.pi / 180.0 if felt else np.zeros((3, 3))
    for k in range(turns):
        axis = np.eye(3)[k % 3] + 0.4 * random.standard_normal(3)
        axis /= np.linalg.norm(axis)
        time, turned, way, up = moved(up, axis, float(random.uniform(1.2, 2.6) * (-1) ** (k // 3)))
        ups.append(up)
        felt_way = np.cumsum(0.5 * 5e-3 * (way[1:] + way[:-1]), axis=0)
        true = turned + np.vstack([np.zeros(3), felt_way]) @ sensitivity.T
        whole = true @ gain.T + time[:, None] * DRIFT
        rows = np.arange(0, 401, 8)
        begin = 5.0 * k + 3.0
        rotations.append(
            RotationIncrements(
                k, k + 1, (begin + time[rows]).tolist(), np.diff(whole[rows], axis=0).tolist()
            )
        )
    directions = np.array(ups)
    readings = G * directions @ np.linalg.inv(MATRIX).T + BIAS
    rests = directions @ sensitivity.T @ gain.T + DRIFT
    holds = [
        HoldMeans(
            start=5.0 * k,
            end=5.0 * k + 3.0,
            accelerometer=readings[k].tolist(),
            accelerometer_covariance=(1e-8 * np.eye(3)).tolist(),
            gyroscope=rests[k].tolist(),
            gyroscope_covariance=(1e-12 * np.eye(3)).tolist(),
            time=5.0 * k + 1.5,
            samples=300,
            temperature=25.0,
            accelerometer_scatter=[1e-8] * 3,
            gyroscope_scatter=[1e-12] * 3,
        )
        for k in range(len(ups))
    ]
    field = random.standard_normal((120, 3))
    field *= FIELD / np.linalg.norm(field, axis=1)[:, None]
    seen = field @ np.linalg.inv(IRON).T + HARD_IRON
    means = [FieldMean(0.2 * k, row.tolist(), 0.0, 20) for k, row in enumerate(seen)]
    names = [a + b for a in "xyz" for b in "xyz"]
    effect = SavedEffect(
        term="g-sensitivity",
        sensor="gyroscope",
        equation="",
        parameters=names,
        sizes=FELT.ravel().tolist(),
        unit="°/s/g",
        reference_temperature=25.0,
        reference_time=60.0,
    )
    return Calibration(
        schema="imucal-wizard/calibration/1",
        program="0",
        created="2026-01-01T00:00:00+00:00",
        source="a test",
        gravity=Value(G, "m/s^2"),
        temperature=(20.0, 30.0),
        holds=len(holds),
        rotations=len(rotations),
        sensors={
            "accelerometer": _sensor(MATRIX, BIAS, unit, "m/s^2", "own"),
            "gyroscope": _sensor(
                np.linalg.inv(gain), DRIFT, "rad/s", "rad", "accelerometer", [effect] * felt
            ),
            "magnetometer": _sensor(MOUNTED @ IRON, HARD_IRON, "uT", "uT", "accelerometer"),
        },
        hold_means=holds,
        rotation_increments=rotations,
        field_means=means,
    )


def _sensor(
    matrix: FloatArray,
    bias: FloatArray,
    unit: str,
    error_unit: str,
    frame: str,
    effects: list[SavedEffect] | None = None,
) -> Sensor:
    base = ["bias", "scale", "non-orthogonality"]
    return Sensor(
        model=base + [one.term for one in effects or []],
        method="least_squares",
        frame=frame,
        matrix=matrix.tolist(),
        bias=bias.tolist(),
        bias_unit=unit,
        parameters={},
        unit=error_unit,
        rms_before=0.5,
        rms_fitted=0.0,
        rms_held_out=1e-4,
        effects=effects or [],
    )
