"""Accelerometer and gyroscope: holds and rotations in, a report of these two out.

The second half says what a finished fit shows of the recording: wrong unit or rate, exchanged axes.
"""

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from imucal_wizard.core.poses import DIRECTIONS, POSE_TOLERANCE_DEG, nearest_pose
from imucal_wizard.core.quantities import times_in_words
from imucal_wizard.core.readings import FloatArray, Readings
from imucal_wizard.core.records import dataclass
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.core.units import COUNT, STANDARD_GRAVITY
from imucal_wizard.estimate.accelerometer import accelerometer_experiment
from imucal_wizard.estimate.compensated import noticed
from imucal_wizard.estimate.fit import fit
from imucal_wizard.estimate.gyroscope_report import GyroscopeReport, fit_gyroscope
from imucal_wizard.estimate.methods import DEFAULTS
from imucal_wizard.estimate.outliers import Outlier
from imucal_wizard.estimate.result import FitReport, SensorFit
from imucal_wizard.measurement.clipping import CLIPPING_ADVICE, is_clipped, seconds_at_end
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.model.effect import ACCELEROMETER


@dataclass(frozen=True)
class FitOptions:
    """What the user may choose about a fit.

    Attributes:
        gravity: local gravity, m/s².
        method: the accelerometer's method.
        gyroscope_method: ``vector``, ``static``, ``dynamic`` or ``offset``; which is the result.
        magnetometer_method: ``orthogonal``, ``algebraic``, ``two-step`` or ``numeric``.
        field: magnitude of the local magnetic field, µT, or None when it is not known.
        rates: magnitudes of the constant rates of a rate table that turned the gyroscope, rad/s.
        turns: magnitudes of the angles by which a turntable turned it between rests, rad.
        left_out: spans, s, that neither holds nor rotations may be made of.
    """

    gravity: float = STANDARD_GRAVITY
    method: str = "least_squares"
    gyroscope_method: str = "vector"
    magnetometer_method: str = "orthogonal"
    field: float | None = None
    rates: tuple[float, ...] = ()
    turns: tuple[float, ...] = ()
    left_out: tuple[tuple[float, float], ...] = ()


def fit_holds(
    holds: Sequence[Hold],
    rotations: Sequence[Rotation],
    rates: dict[str, float],
    units: dict[str, str],
    options: FitOptions,
    validation: Sequence[Hold],
    warnings: tuple[str, ...],
    readings: Readings | None = None,
) -> FitReport:
    """Fit accelerometer and gyroscope.

    Args:
        holds: still periods, in the order of time.
        rotations: motions between neighbouring ones.
        rates: samples per second of each sensor.
        units: of the readings by sensor; a sensor that is not there is left out.
        options: gravity and methods.
        validation: holds that the fit must not see.
        warnings: what is known already.
        readings: what the holds were found in, where it is at hand.

    Raises:
        DataError: the holds do not carry a calibration.
    """
    accelerometer = fit_accelerometer(
        holds, options.gravity, units["accelerometer"], options.method, readings
    )
    assert accelerometer.reference is not None  # noqa: S101 (narrows the type)
    named = _with_poses(holds, accelerometer.reference.up)
    rotations = [_between(rotation, named) for rotation in rotations]
    odd: dict[str, str] = {}
    if accelerometer.outlier is not None:
        hold = named[accelerometer.outlier.index]
        pose = f" ({hold.pose})" if hold.pose else ""
        place = f"the hold from {hold.start:.1f} to {hold.end:.1f} s{pose}"
        odd["accelerometer"] = _stands_out(place, accelerometer.outlier)
    sensors = {"accelerometer": _validated(accelerometer, validation, options.gravity)}
    notes = [*warnings, *accelerometer_warnings(accelerometer, named)]
    gyroscope: GyroscopeReport | None = None
    if "gyroscope" in units:
        gyroscope = fit_gyroscope(
            named, rotations, accelerometer, units["gyroscope"], options.gyroscope_method, readings
        )
        rotations = list(gyroscope.rotations)
        notes += rotation_warnings(rotations)
        if gyroscope.fit is not None:
            sensors["gyroscope"] = gyroscope.fit
            notes += gyroscope_warnings(gyroscope, units["gyroscope"], rates["gyroscope"])
        notes += gyroscope.warnings
        if gyroscope.outlier is not None:
            bad = rotations[gyroscope.outlier.index]
            place = f"the rotation from {bad.time[0]:.1f} to {bad.time[-1]:.1f} s"
            odd["gyroscope"] = _stands_out(place, gyroscope.outlier)
    return FitReport(
        gravity=options.gravity,
        rates=rates,
        holds=tuple(named),
        rotations=tuple(rotations),
        sensors=sensors,
        comparison=() if gyroscope is None else gyroscope.comparison,
        angles=() if gyroscope is None else gyroscope.angles,
        warnings=tuple(dict.fromkeys(note for note in notes if note)),
        outlier_notes=odd,
    )


def fit_accelerometer(
    holds: Sequence[Hold],
    gravity: float,
    unit: str,
    method: str = DEFAULTS[ACCELEROMETER],
    readings: Readings | None = None,
) -> SensorFit:
    """The calibration of these holds without effects.

    Args:
        holds: still periods, in the order of time.
        gravity: local gravity, m/s².
        unit: of the readings, ``m/s^2`` or ``count``.
        method: the default, or one of ``estimate.methods``.
        readings: what the holds were found in, for the effects that are fitted to them later.

    Raises:
        DataError: the holds do not determine a calibration.
        UsageError: no method of that name.
    """
    if method == DEFAULTS[ACCELEROMETER]:
        return fit(accelerometer_experiment(holds, gravity, unit, readings))
    from imucal_wizard.estimate.hold_magnitudes import fit_by_method

    return fit_by_method(holds, gravity, unit, method)


def _with_poses(holds: Sequence[Hold], directions: FloatArray) -> list[Hold]:
    """The holds with the pose each was in, by the calibrated direction."""
    return [
        replace(hold, pose=nearest_pose(up, DIRECTIONS, POSE_TOLERANCE_DEG))
        for hold, up in zip(holds, directions, strict=True)
    ]


def _between(rotation: Rotation, holds: Sequence[Hold]) -> Rotation:
    """The rotation with its holds replaced by the named ones of the same times."""
    places = {(hold.start, hold.end): hold for hold in holds}
    before = places.get((rotation.before.start, rotation.before.end))
    after = places.get((rotation.after.start, rotation.after.end))
    if before is None or after is None:
        return replace(rotation, problem=rotation.problem or "a hold at its end was not kept")
    return replace(rotation, before=before, after=after)


def _validated(fit: SensorFit, holds: Sequence[Hold], gravity: float) -> SensorFit:
    """The fit with its error on holds that it has not seen."""
    if not holds:
        return fit
    readings = np.array([hold.accelerometer for hold in holds])
    errors = np.linalg.norm((readings - fit.bias) @ fit.matrix.T, axis=1) - gravity
    return replace(fit, validation_rms=root_mean_square(errors), validation=tuple(errors.tolist()))


RATE_MISTAKES = (
    (np.pi / 180.0, "the readings are in deg/s and were taken for rad/s"),
    (180.0 / np.pi, "the readings are in rad/s and were taken for deg/s"),
    (1e-3, "the readings are in thousandths of the unit given"),
    (1e3, "the readings are in thousands of the unit given"),
    (2.0 * np.pi / 60.0, "the readings are in rpm and were taken for rad/s"),
    (6.0, "the readings are in rpm and were taken for deg/s"),
    (2.0 * np.pi, "the readings are in turns per second and were taken for rad/s"),
    (1e-3 * np.pi / 180.0, "the readings are in mdeg/s and were taken for rad/s"),
)
"""Scales of a gyroscope that a mistaken unit makes."""
RANGES = (-4, -3, -2, -1, 1, 2, 3, 4)
"""Powers of 2 between the ranges of one device: ±125 to ±2000 °/s, ±2 to ±16 g."""
POSSIBLE_RATES = 5.0, 20_000.0
"""Sampling rates of devices that record a motion, Hz."""
NEAR = 0.08
"""Relative difference from such a factor that an uncalibrated sensor can have."""


def accelerometer_warnings(fit: SensorFit, holds: Sequence[Hold]) -> list[str]:
    """Warnings about the accelerometer's unit and hand-held holds."""
    notes = list(fit.warnings)
    if fit.bias_unit != COUNT:
        notes += unit_notes(float(np.mean(np.abs(np.diag(fit.matrix)))))
    notes.append(noticed(fit))
    count = sum(hold.hand_held for hold in holds)
    if count:
        notes.append(f"{count} of {len(holds)} holds were taken hand-held and weigh less")
    return notes


MISTAKEN_UNITS = (
    ("g", 1.0 / STANDARD_GRAVITY),
    ("mg", 1e3 / STANDARD_GRAVITY),
    ("m/s^2", STANDARD_GRAVITY),
)
"""What gravity reads, over what it is, when the accelerations are in this unit and were taken for
another: g or mg for m/s², m/s² for g."""
FAR = 0.2
"""No sensor's scale is wrong by 20 %; its unit, range or sampling rate is."""


def unit_notes(scale: float) -> list[str]:
    """What explains an accelerometer's scale (true over read) that no sensor has."""
    reads = f"gravity reads {STANDARD_GRAVITY / scale:.4g} m/s²"
    for unit, size in MISTAKEN_UNITS:
        if abs(np.log(scale * size)) < NEAR:
            return [f"{reads}: the accelerations are in {unit}; give {unit} as their unit"]
    if abs(np.log(scale)) > FAR:
        fits = "".join(f"; it fits if {text}" for text in _other_range(scale))
        return [f"{reads}: give the unit of the accelerations, or correct the range{fits}"]
    return []


def _stands_out(place: str, outlier: Outlier) -> str:
    return (
        f"{place} does not fit with the others: its error is {outlier.ratio:.0f} times theirs. "
        "Measure it again"
    )


def gyroscope_warnings(report: GyroscopeReport, unit: str, rate: float) -> list[str]:
    """Warnings about rate, unit and axis order that the gyroscope's matrix shows."""
    notes: list[str] = []
    fit = report.fit
    if fit is None:
        return notes
    scale = float(np.linalg.norm(fit.matrix) / np.sqrt(3.0))
    wrong_scale = [] if unit == COUNT else scale_notes(scale, rate)
    notes += wrong_scale or [noticed(fit)]  # a bias cannot be judged in a wrong unit
    matrix = fit.matrix / scale
    best = np.abs(matrix).argmax(axis=1)
    if sorted(best.tolist()) == [0, 1, 2]:
        wrong = [
            f"{'-' if matrix[i, j] < 0 else '+'}{'xyz'[j]}" for i, j in enumerate(best.tolist())
        ]
        if wrong != ["+x", "+y", "+z"]:
            notes.append(
                "the gyroscope's axes are not the accelerometer's: its "
                f"x, y, z must be taken from {', '.join(wrong)}. Check the wiring or the columns"
            )
    return notes


def scale_notes(scale: float, rate: float) -> list[str]:
    """What explains a gyroscope's scale that no sensor has.

    Args:
        scale: true rate over reading, of all axes together.
        rate: sampling rate that the times or the user claim, Hz. The angle is the integral over
            time, so a rate claimed twice too high doubles the scale; 0 where it does not matter.
    """
    if abs(np.log(scale)) <= FAR:
        return []
    fits = [meaning for factor, meaning in RATE_MISTAKES if abs(np.log(scale / factor)) < NEAR]
    if POSSIBLE_RATES[0] <= rate / scale <= POSSIBLE_RATES[1]:
        true = float(f"{rate / scale:.2g}")  # an uncalibrated scale knows it no better
        fits.append(f"the sampling rate is about {true:g} Hz instead of {rate:.4g} Hz")
    fits += _other_range(scale)
    found = f"the gyroscope's scale comes out as {scale:.3g}, which no sensor has"
    if not fits:
        return [f"{found}: check the unit of the rates, the range and the sampling rate"]
    which = "which is true" if len(fits) > 1 else "this"
    return [f"{found}. It fits if {', or if '.join(fits)}. Check {which} and correct it"]


def _other_range(scale: float) -> list[str]:
    """That the device measures in another range than its readings were converted for."""
    for power in RANGES:
        if abs(np.log(scale / 2.0**power)) < NEAR:
            wider = "wider" if power > 0 else "narrower"
            return [f"the range set in the device is {2 ** abs(power)} times {wider} than assumed"]
    return []


def rotation_warnings(rotations: Sequence[Rotation]) -> list[str]:
    """How many rotations could not be used, and why, without what would have been advised then."""
    reasons: dict[str, list[str]] = {}
    for rotation in rotations:
        if rotation.problem:
            reason = rotation.problem.partition(":")[0]
            reasons.setdefault(re.sub(r"[+−]?\d+(\.\d+)?", "#", reason), []).append(reason)
    if not reasons:
        return []
    count = sum(map(len, reasons.values()))
    each = ", ".join(f"{texts[0]} ({times_in_words(len(texts))})" for texts in reasons.values())
    notes = [f"{count} of {len(rotations)} rotations are not used: {each}"]
    clipped = [one for one in rotations if is_clipped(one.problem)]
    if clipped:
        places = ", ".join(f"{one.time[0]:.1f} to {one.time[-1]:.1f} s" for one in clipped[:3])
        more = f" and {len(clipped) - 3} more" if len(clipped) > 3 else ""
        seconds = sum(seconds_at_end(one.time, one.rate) for one in clipped)
        notes.append(
            f"the gyroscope reaches the end of its range in the rotations from {places}{more}, "
            f"for {seconds:.2g} s in all: {CLIPPING_ADVICE['gyroscope']}"
        )
    return notes
