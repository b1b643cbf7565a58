"""Readings whose axes are exchanged or reversed against those that were calibrated.

A changed axis setting, wiring or column order gives a sensor another signed permutation of its
axes. Each of the 47 is tried on each sensor and on all of them together; the few that agree with
gravity's magnitude and with the rotations are worth a whole recheck. So is a gyroscope in another
unit or range.
"""

import itertools
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from imucal_wizard.core.directions import unit_vectors
from imucal_wizard.core.errors import DataError
from imucal_wizard.core.readings import FloatArray, Readings, Series
from imucal_wizard.diagnose.calibrated_sensor import CalibratedSensor, RecheckData, plain_forces
from imucal_wizard.estimate.fit_warnings import RANGES, RATE_MISTAKES
from imucal_wizard.estimate.gyroscope_start import misfit
from imucal_wizard.estimate.rotation_set import examined, rotation_set
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE, MAGNETOMETER

AxesBySensor = Mapping[str, FloatArray]
"""Of each sensor whose axes are other ones: P, with ``P y`` as it was calibrated, shape (3, 3); a
multiple of it where the unit is another one, too."""

MAX_MAGNITUDE_ERRORS = 3.0
"""Errors of gravity's magnitude, in limits of a recheck, beyond which axes are not the right ones:
the sensor may have drifted to its limit, and noise adds to it."""
MAX_MISFIT_SHARE = 0.25
"""Mean square by which carried gravity misses the accelerometer's, over that of the axes as they
are, above which other axes are no explanation: wrong ones miss by a radian, right ones by the
accelerations of a hand, a tenth of it."""
MAX_SAME_MISFIT = 1.5
"""The same where all sensors change alike, which leaves the rotations as they are."""
RIGHT_MISFIT = 0.03
"""Mean square, rad², below which the axes as they are agree with the rotations (10° rms)."""
THINNED_SAMPLES = 60
"""Of a rotation: enough to tell axes, and a recording at 1.6 kHz takes no longer."""
MAX_TRIED = 4
"""Candidates that are rechecked, those that change fewest axes first."""


def _signed_permutations() -> tuple[FloatArray, ...]:
    """All but the identity, those that change fewest axes first."""
    every = [
        np.diag(signs)[list(order)]
        for order in itertools.permutations(range(3))
        for signs in itertools.product((1.0, -1.0), repeat=3)
    ]
    changed = sorted(every, key=lambda one: (np.abs(one - np.eye(3)).sum(), one.tolist()))
    return tuple(changed[1:])


SIGNED_PERMUTATIONS = _signed_permutations()


def with_axes(measured: RecheckData, axes: AxesBySensor) -> RecheckData:
    """What was measured, in the axes that were calibrated.

    Args:
        measured: holds and rotations.
        axes: of the sensors whose axes are other ones.
    """
    if not axes:
        return measured
    rotations = [_rotation_with(one, axes) for one in measured.rotations]
    readings = measured.readings
    return replace(
        measured,
        holds=[_hold_with(one, axes) for one in measured.holds],
        rotations=rotations,
        readings=None if readings is None else _readings_with(readings, axes),
    )


def _hold_with(hold: Hold, axes: AxesBySensor) -> Hold:
    force, rate = (axes.get(name, np.eye(3)) for name in (ACCELEROMETER, GYROSCOPE))
    whole, timed = np.eye(7), np.eye(4)
    whole[:3, :3], whole[3:6, 3:6], timed[1:, 1:] = force, rate, force

    def moved(order: FloatArray, value: FloatArray | None) -> FloatArray | None:
        if value is None:
            return None
        return np.asarray(order @ value @ order.T if value.ndim > 1 else order @ value)

    return replace(
        hold,
        accelerometer=force @ hold.accelerometer,
        accelerometer_covariance=force @ hold.accelerometer_covariance @ force.T,
        gyroscope=moved(rate, hold.gyroscope),
        gyroscope_covariance=moved(rate, hold.gyroscope_covariance),
        accelerometer_scatter=moved(force**2, hold.accelerometer_scatter),
        gyroscope_scatter=moved(rate**2, hold.gyroscope_scatter),
        gyroscope_turn=moved(rate, hold.gyroscope_turn),
        # a mirrored body turns in the other order
        gyroscope_order=None
        if hold.gyroscope_order is None
        else np.linalg.det(rate) * hold.gyroscope_order @ rate.T,
        gyroscope_quiet=moved(rate**2, hold.gyroscope_quiet),
        sway=moved(whole, hold.sway),
        allan_covariances=moved(force, hold.allan_covariances),
        course=None if hold.course is None else hold.course @ timed.T,
    )


def _rotation_with(rotation: Rotation, axes: AxesBySensor) -> Rotation:
    force = rotation.accelerometer
    order = axes.get(ACCELEROMETER)
    return replace(
        rotation,
        rate=rotation.rate @ axes.get(GYROSCOPE, np.eye(3)).T,
        accelerometer=force if force is None or order is None else force @ order.T,
    )


def _thinned(rotation: Rotation) -> Rotation:
    """The means of neighbouring samples, about ``THINNED_SAMPLES`` of them."""
    size = len(rotation.time) // THINNED_SAMPLES
    if size < 2:
        return rotation
    count = len(rotation.time) // size

    def means(values: FloatArray) -> FloatArray:
        parts = values[: count * size].reshape(count, size, *values.shape[1:])
        return np.asarray(parts.mean(axis=1))

    force = rotation.accelerometer
    return replace(
        rotation,
        time=means(rotation.time),
        rate=means(rotation.rate),
        accelerometer=None if force is None else means(force),
    )


def _readings_with(readings: Readings, axes: AxesBySensor) -> Readings:
    def ordered(name: str) -> Series | None:
        series: Series | None = getattr(readings, name)
        if series is None or name not in axes:
            return series
        return replace(series, values=series.values @ axes[name].T)

    accelerometer = ordered(ACCELEROMETER)
    assert accelerometer is not None  # noqa: S101 (narrows the type)
    return replace(
        readings,
        accelerometer=accelerometer,
        gyroscope=ordered(GYROSCOPE),
        magnetometer=ordered(MAGNETOMETER),
    )


def likely_axes(
    known: Mapping[str, CalibratedSensor], measured: RecheckData, gravity: float
) -> list[AxesBySensor]:
    """Other axes that agree with gravity's magnitude and with the rotations.

    Args:
        known: accelerometer and gyroscope as they were calibrated, as far as they were read.
        measured: holds and rotations.
        gravity: m/s².
    """
    accelerometer = known.get(ACCELEROMETER)
    if accelerometer is None or not measured.holds:
        return []
    most = MAX_MAGNITUDE_ERRORS * accelerometer.limit
    thinned = [_thinned(one) for one in measured.rotations]
    measured = replace(measured, rotations=thinned, readings=None)
    now = _misfit(known, measured)
    closes = now is not None and now < RIGHT_MISFIT
    right = _magnitude_error(accelerometer, measured, gravity) <= most
    found: list[AxesBySensor] = []
    for order in SIGNED_PERMUTATIONS:
        if now is not None and not closes and right:
            alone = {GYROSCOPE: order}
            found += [alone] * _closes(known, measured, alone, MAX_MISFIT_SHARE * now)
        mirrored = with_axes(measured, {ACCELEROMETER: order})
        if _magnitude_error(accelerometer, mirrored, gravity) > most:
            continue
        alone = {ACCELEROMETER: order}
        # where the rotations close, another order of one sensor alone would open them
        if now is None or (not closes and _closes(known, measured, alone, MAX_MISFIT_SHARE * now)):
            found.append(alone)
        every = dict.fromkeys(known, order)
        if len(every) > 1 and (
            now is None or _closes(known, measured, every, MAX_SAME_MISFIT * now)
        ):
            found.append(every)
    return sorted(found, key=axes_changed)[:MAX_TRIED]


def likely_rates(known: Mapping[str, CalibratedSensor], measured: RecheckData) -> float | None:
    """True rates over readings by another unit or range, with which alone the rotations close.

    Args:
        known: accelerometer and gyroscope as they were calibrated, as far as they were read.
        measured: holds and rotations.
    """
    if ACCELEROMETER not in known or not measured.holds:
        return None
    thinned = replace(
        measured, rotations=[_thinned(one) for one in measured.rotations], readings=None
    )
    now = _misfit(known, thinned)
    if now is None or now < RIGHT_MISFIT:
        return None
    scales = {scale for scale, _ in RATE_MISTAKES} | {2.0**power for power in RANGES}
    misfits = {
        scale: _misfit(known, with_axes(thinned, {GYROSCOPE: scale * np.eye(3)}))
        for scale in sorted(scales)
    }
    best, least = min(
        ((scale, one) for scale, one in misfits.items() if one is not None), key=lambda one: one[1]
    )
    return best if least < min(MAX_MISFIT_SHARE * now, RIGHT_MISFIT) else None


def axes_changed(axes: AxesBySensor) -> float:
    """By how much these differ from the axes that were calibrated; the same on all counts once."""
    every = [np.abs(one - np.eye(3)).sum() for one in axes.values()]
    alike = len(every) > 1 and all(
        (one == next(iter(axes.values()))).all() for one in axes.values()
    )
    return float(every[0] if alike else sum(every))


def _magnitude_error(known: CalibratedSensor, measured: RecheckData, gravity: float) -> float:
    """Largest error of gravity's magnitude in the holds, m/s²."""
    force = plain_forces(known, measured.holds)
    return float(np.abs(np.linalg.norm(force, axis=1) - gravity).max())


def _closes(
    known: Mapping[str, CalibratedSensor], measured: RecheckData, axes: AxesBySensor, most: float
) -> bool:
    then = _misfit(known, with_axes(measured, axes))
    return then is not None and then <= most


def _misfit(known: Mapping[str, CalibratedSensor], measured: RecheckData) -> float | None:
    """By how much the rotations miss; see ``gyroscope_start.misfit``. None without rotations."""
    if GYROSCOPE not in known:
        return None
    accelerometer, gyroscope = known[ACCELEROMETER], known[GYROSCOPE].calibration
    try:
        turned = rotation_set(
            measured.holds, examined(measured.rotations), accelerometer.calibration
        )
    except DataError:
        return None
    if turned.up is None:
        return None
    before = unit_vectors(plain_forces(accelerometer, measured.holds))[turned.before]
    return misfit(turned.samples, before, turned.up, gyroscope.matrix, gyroscope.bias)
