"""Warnings that follow from a finished fit: a wrong unit, range or rate, exchanged axes."""

import re
from collections.abc import Mapping, Sequence

import numpy as np

from imucal_wizard.core.directions import farthest_from
from imucal_wizard.core.limits.data_quality import USUAL_SAMPLING_RATES
from imucal_wizard.core.limits.use import FAR_FROM_POSES_DEG, IMPLAUSIBLE_SCALE
from imucal_wizard.core.notices import Notice, NoticeKind, of_kind
from imucal_wizard.core.poses import AXES, DIRECTIONS, nearest_pose, pose_in_words
from imucal_wizard.core.quantities import listed, number, quantity, times_in_words
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import median, root_mean_square
from imucal_wizard.core.units import COUNT, STANDARD_GRAVITY
from imucal_wizard.estimate.compensated import noticed
from imucal_wizard.estimate.gyroscope_report import GyroscopeReport
from imucal_wizard.estimate.parameters import converted_covariance
from imucal_wizard.estimate.result import SensorFit, usual_scale
from imucal_wizard.measurement.clipping import CLIPPING_ADVICE, is_clipped, seconds_at_end
from imucal_wizard.measurement.holds import Hold, Rotation
from imucal_wizard.model.rows.source import ENTRIES

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
SETTLING_SHARE = 0.9
"""Share of a standard error by settling, above which noise makes less than half of that."""
SETTLED_TIMES = 5.0
"""Time constants after which settling is over: it has died out to less than a hundredth."""
LONGER_RESTS = 10.0
"""How many times as long as before the device is to rest where no end is known."""
NEAR = 0.08
"""Relative difference from such a factor that an uncalibrated sensor can have."""


def accelerometer_warnings(fit: SensorFit, holds: Sequence[Hold]) -> list[str]:
    """Warnings about the accelerometer's unit and hand-held holds."""
    notes = list(fit.warnings)
    usual, odd = _scales(fit)
    notes += odd
    if fit.bias_unit != COUNT:
        notes += unit_notes(usual, as_counts=True) or _bias_notes(fit)
    notes += [noticed(fit), *_settling(fit, holds)]
    count = sum(hold.hand_held for hold in holds)
    if count:
        verb = "was" if count == 1 else "were"
        notes.append(
            f"{count} of {len(holds)} holds {verb} taken hand-held: the weight of each hold "
            "follows from the noise measured in it"
        )
    return notes


def _settling(fit: SensorFit, holds: Sequence[Hold]) -> list[Notice]:
    """A warning where the doubt about settling in all holds outweighs noise in a parameter."""
    experiment, found = fit.experiment, fit.minimum
    if experiment is None or found is None or experiment.settling is None:
        return []

    def named(entries: FloatArray) -> dict[str, float]:
        return experiment.named(entries[:9].reshape(3, 3), entries[9:])

    every = found.nominal_modes[:ENTRIES]
    modes = every[:, every.shape[1] - experiment.common_errors.shape[1] :]
    by_settling = converted_covariance(named, found.calibration.entries, modes @ modes.T)
    uncertain = []
    for one, variance in zip(fit.parameters, np.diag(by_settling), strict=False):
        size = float(np.sqrt(max(variance, 0.0)))
        if one.standard_error is not None and size > SETTLING_SHARE * one.standard_error:
            uncertain.append(f"{one.name} by {quantity(size, one.unit, 2)}")
    if not uncertain:
        return []
    seconds, rests = experiment.settling.seconds, [one.course for one in holds]
    rest = median([one[:, 0].sum() for one in rests if one is not None])
    known = np.isfinite(seconds)
    longer = max(SETTLED_TIMES * seconds, 2.0 * rest) if known else LONGER_RESTS * rest
    how = "for longer than they last"
    if known:
        how = f"with a time constant of about {number(seconds, 1)} s"
    text = (
        "the accelerometer still settles in its holds, in the same sense throughout the session, "
        f"{how}. Rests of {number(rest, 2)} s do not show where it ends: uncertain by this, within "
        f"their standard errors, are {listed(uncertain)}. Leave the device still for at least "
        f"{number(longer, 1)} s in each pose"
    )
    return [Notice(text, NoticeKind.SETTLING, "accelerometer")]


def uncovered_directions(up: FloatArray) -> list[str]:
    """That no hold comes near some directions, in which the data do not show the error.

    Args:
        up: of all holds, unit vectors, shape (n, 3).
    """
    middle, angle = farthest_from(up)
    if angle <= np.radians(FAR_FROM_POSES_DEG):
        return []
    name = nearest_pose(middle, DIRECTIONS, 180.0)
    assert name is not None  # noqa: S101 (narrows the type: every direction is within 180°)
    apart = np.degrees(np.arccos(np.clip((up @ DIRECTIONS[name]).max(), -1.0, 1.0)))
    text = (
        f"no hold comes near {pose_in_words(name)}: the nearest is {apart:.0f}° away, so these "
        "data do not show the error there. Measure poses around it, too"
    )
    return [text]


MISTAKEN_UNITS = (
    ("g", "m/s^2", 1.0 / STANDARD_GRAVITY),
    ("mg", "m/s^2", 1e3 / STANDARD_GRAVITY),
    ("m/s^2", "g", STANDARD_GRAVITY),
)
"""What gravity reads, over what it is, when the accelerations are in the first unit and were taken
for the second."""


def unit_notes(scale: float, *, as_counts: bool = False) -> list[Notice]:
    """What explains an accelerometer's scale that no sensor has.

    Args:
        scale: true force over reading, of all axes together.
        as_counts: the readings can be taken as counts as well.
    """
    units = [one[:2] for one in MISTAKEN_UNITS if abs(np.log(scale * one[2])) < NEAR]
    if units:
        ((unit, other),) = units
        advice = (
            f"if they were taken for {other}, the accelerations are in {unit}; give {unit} as "
            "their unit"
        )
    elif abs(np.log(scale)) > IMPLAUSIBLE_SCALE:
        fits = "".join(f"; it fits if {text}" for text in _other_range(scale))
        counts = f", or give {COUNT} as the unit" * as_counts
        advice = f"correct this unit, the numbers or the range{counts}{fits}"
    else:
        return []
    read = f"{STANDARD_GRAVITY / scale:.4g} m/s²"
    text = f"gravity reads {read} in the unit of the accelerations: {advice}"
    return [Notice(text, NoticeKind.SCALE, "accelerometer")]


def _bias_notes(fit: SensorFit) -> list[Notice]:
    """What is said of an accelerometer whose scale is right and whose bias no sensor has."""
    axis = int(np.abs(fit.bias).argmax())
    size = float(fit.bias[axis])
    if fit.unusable or abs(size) <= IMPLAUSIBLE_SCALE * STANDARD_GRAVITY:
        return []
    text = (
        f"the accelerometer's bias is {quantity(size, fit.bias_unit)} on the {AXES[axis]} axis, "
        "which no sound sensor has: check its column, its offset registers and its range"
    )
    return [Notice(text, NoticeKind.BIAS, fit.sensor)]


def gyroscope_warnings(report: GyroscopeReport, unit: str, rate: float) -> list[str]:
    """Warnings about rate, unit and axis order that the gyroscope's matrix shows."""
    notes: list[str] = []
    fit = report.fit
    if fit is None or fit.unchecked:
        return notes
    scale, odd = _scales(fit)
    wrong_scale = odd + ([] if unit == COUNT else scale_notes(scale, rate))
    notes += wrong_scale or [noticed(fit)]  # a bias cannot be judged in a wrong unit
    return notes + exchanged_axes(fit.matrix)


def exchanged_axes(matrix: FloatArray, field_axes: FloatArray | None = None) -> list[str]:
    """What is said of a gyroscope and an accelerometer whose axes do not match.

    A rate is an axial vector: mirroring one axis of the accelerometer turns the sense of the two
    others, and mirroring one axis of both sensors turns the sense of all three. A rotation of the
    gyroscope's axes may therefore be one, or a mirrored order, of the accelerometer's instead; a
    third sensor tells which of the two is odd.

    Args:
        matrix: of the gyroscope, shape (3, 3).
        field_axes: of the magnetometer in the accelerometer's frame, if known, each column an axis,
            shape (3, 3).
    """
    signs = _nearest_axes(matrix)
    if signs is None or (signs == np.eye(3)).all():
        return []
    text = "the gyroscope's axes do not match the accelerometer's: take its x, y, z from "
    text += _in_words(signs)
    advice = "Check the wiring or the columns"
    if (signs == -np.eye(3)).all():
        advice = (
            "No mounting does this: all its rates have the wrong sign, or one axis of both sensors "
            "is mirrored (left-handed axes). Check the signs of the columns"
        )
    elif np.linalg.det(signs) < 0.0:
        advice = (
            "No mounting does this: one axis is mirrored, or two are swapped (left-handed axes). "
            "Check the signs and the order of the columns"
        )
    else:
        turned = sorted((signs.T, -signs.T), key=lambda one: float(-one.sum()))
        other = [_in_words(one) for one in turned]
        third = None if field_axes is None else _nearest_axes(field_axes)
        if third is not None and (third == np.eye(3)).all():
            advice += " of the gyroscope: the magnetometer's axes are the accelerometer's"
        elif third is not None and (third == signs).all():
            text = (
                "the accelerometer's axes do not match those of the gyroscope and the magnetometer:"
                f" take its x, y, z from {' or from '.join(other)}"
            )
        else:
            text += f", or the accelerometer's from {other[0]}"
            advice = f"The data do not tell which of the two is exchanged. {advice} of both"
    return [Notice(f"{text}. {advice}", NoticeKind.AXES, "gyroscope")]


def _nearest_axes(matrix: FloatArray) -> FloatArray | None:
    """±1 where a column lies along an axis, shape (3, 3); None where two lie along the same."""
    best = np.abs(matrix).argmax(axis=1)
    if sorted(best.tolist()) != [0, 1, 2]:
        return None
    signs = np.zeros((3, 3))
    signs[np.arange(3), best] = np.sign(matrix[np.arange(3), best])
    return signs


def _in_words(signs: FloatArray) -> str:
    """From which axes those of a frame are taken: ``+y, -x, +z``."""
    order = signs.argmax(axis=1), signs.argmin(axis=1)
    return ", ".join(
        f"+{AXES[i]}" if row.max() > 0.0 else f"-{AXES[j]}"
        for row, i, j in zip(signs, *order, strict=True)
    )


def _scales(fit: SensorFit) -> tuple[float, list[str]]:
    """Usual scale (true over read) of the axes, and what is said of those that differ from it."""
    usual, sizes, odd = usual_scale(fit.matrix)
    if fit.unusable:
        return root_mean_square(sizes), []
    return usual, [
        f"the {fit.sensor}'s {AXES[axis]} axis reads {usual / sizes[axis]:.3g} times what the "
        "other axes read of the same input, which no sensor does: check its column, unit and range"
        for axis in odd.tolist()
    ]


def scale_notes(scale: float, rate: float) -> list[str]:
    """What explains a gyroscope's scale that no sensor has.

    Args:
        scale: true rate over reading, of all axes together.
        rate: sampling rate that the times or the user claim, Hz. The angle is the integral over
            time, so a rate claimed twice too high doubles the scale; 0 where it does not matter.
    """
    if abs(np.log(scale)) <= IMPLAUSIBLE_SCALE:
        return []
    fits = [meaning for factor, meaning in RATE_MISTAKES if abs(np.log(scale / factor)) < NEAR]
    # two digits: the axes of an uncalibrated sensor differ from one another by some per cent
    if USUAL_SAMPLING_RATES[0] <= rate / scale <= USUAL_SAMPLING_RATES[1]:
        true = float(f"{rate / scale:.2g}")
        fits.append(f"the sampling rate is about {true:g} Hz instead of {rate:.4g} Hz")
    fits += _other_range(scale)
    found = f"the gyroscope's scale comes out as about {number(scale, 2)}, which no sensor has"
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


_OF_THE_FIT = {
    NoticeKind.GRAVITY_OF_SAMPLES: (NoticeKind.SCALE, NoticeKind.BIAS),
    NoticeKind.STEPS_OF_SAMPLES: (NoticeKind.STEPS_OF_HOLDS,),
    NoticeKind.CLIPPED: (NoticeKind.CLIPPED_ROTATIONS,),
}
"""Warnings about the samples, and those about the same that the fit gives."""


def said_better(note: str, notes: Sequence[str]) -> bool:
    """Whether the fit warns of what a check of the samples has noticed, by better numbers."""
    if not isinstance(note, Notice):
        return False
    return bool(of_kind(notes, *_OF_THE_FIT.get(note.kind, ()), sensor=note.sensor))


def _reason(texts: Sequence[str]) -> str:
    """The same reason of several rotations: the largest number that it has, and how often."""
    largest = max(texts, key=lambda text: [float(one) for one in re.findall(r"\d+\.?\d*", text)])
    upto = "up to " if len(set(texts)) > 1 else ""
    return f"{re.sub(r'(?=[0-9])', upto, largest, count=1)} ({times_in_words(len(texts))})"


def _jumps(jumped: Mapping[int, str]) -> list[str]:
    """The reason of rotations whose rates jump, by their numbers."""
    if len(jumped) < 2:
        return [f"in rotation {number} {reason}" for number, reason in jumped.items()]
    *first, last = map(str, jumped)
    text = (
        f"in rotations {', '.join(first)} and {last} the rate jumps between two samples and the "
        "angle is wrong, as where samples are missing or repeated"
    )
    return [text]


def rotation_warnings(rotations: Sequence[Rotation]) -> list[str]:
    """How many rotations could not be used, and why.

    The advice that follows the colon of a reason was for the moment of the rotation.
    """
    reasons: dict[str | NoticeKind, list[str]] = {}
    jumped: dict[int, str] = {}
    for place, rotation in enumerate(rotations, start=1):
        if rotation.problem:
            reason = rotation.problem.partition(":")[0]
            if of_kind([rotation.problem], NoticeKind.JUMP):
                jumped[place] = reason
                continue
            # gaps of any length are one reason
            gap = of_kind([rotation.problem], NoticeKind.GAP)
            reasons.setdefault(NoticeKind.GAP if gap else reason, []).append(reason)
    if not reasons and not jumped:
        return []
    count = sum(map(len, reasons.values())) + len(jumped)
    each = ", ".join([*map(_reason, reasons.values()), *_jumps(jumped)])
    verb = "is" if count == 1 else "are"
    notes = [f"{count} of {len(rotations)} rotations {verb} not used: {each}"]
    clipped = [one for one in rotations if is_clipped(one.problem)]
    if clipped:
        places = ", ".join(f"{one.time[0]:.1f} to {one.time[-1]:.1f} s" for one in clipped[:3])
        more = f" and {len(clipped) - 3} more" if len(clipped) > 3 else ""
        seconds = sum(seconds_at_end(one.time, one.rate) for one in clipped)
        text = (
            f"the gyroscope reaches the end of its range in the rotations from {places}{more}, "
            f"for {seconds:.2g} s in all: {CLIPPING_ADVICE['gyroscope']}"
        )
        notes.append(Notice(text, NoticeKind.CLIPPED_ROTATIONS, "gyroscope"))
    return notes
