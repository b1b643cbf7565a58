"""An effect in words: its dependence, its sizes, the cost of ignoring it, the data that show it."""

import numpy as np

from imucal_wizard.core.quantities import number, plus_minus, size_with_unit, with_unit
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.statistics import root_mean_square
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.curve_shape import rms_size
from imucal_wizard.diagnose.detectability import USUAL_SIZES
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.optimal_design import Explained
from imucal_wizard.diagnose.suspects import MIN_SIZE_IN_ERRORS, Suspect, largest
from imucal_wizard.estimate.distributions import exceeded
from imucal_wizard.estimate.lack_of_fit import TEST_LEVEL
from imucal_wizard.model.effect import ACCELEROMETER, GYROSCOPE, MAGNETOMETER, Effect
from imucal_wizard.model.effects.clock import Clock
from imucal_wizard.model.lesson import (
    cost_of_ignoring,
    left_by_magnitude,
    session_of,
    session_poses,
    session_words,
)

MAX_NAMED_PARAMETERS = 3
"""Parameters of one effect that a sentence names."""
ROUNDING = 1e-12
"""Variance of a sum over those of its terms, below which it is a rounding error of nothing."""
MIN_EQUAL_PART = 0.8
"""Part of each size in the combination that is known best, over the largest part, from which on
their plain sum or difference is as good."""
MAX_ERROR_TOGETHER = 0.5
"""Standard error of a sum of sizes over the smallest of theirs, up to which only the sum is known;
independent sizes have a sum that is less certain than each."""
DRAWN_SIZES = 200
"""Sizes drawn from what the data allow, of which the middle 90 % are told as costs."""
MIN_UNCERTAINTY_TOLD = 1.4
"""Upper end of the 90 % interval of a size over the size, or the size over its lower end, from
which on the interval is told: below it, two of three sizes are right within 20 %."""

DEPENDS_ON = {
    "force": "gravity",
    "temperature": "the temperature",
    "time": "the time",
    "previous": "the pose before",
    "vibration": "the vibration",
    "current": "the current",
}

INPUT = {
    ACCELEROMETER: "the force along an axis",
    GYROSCOPE: "the rate of rotation",
    MAGNETOMETER: "the direction of the field",
}


def dependence_text(bench: Bench, term: str) -> str:
    """What an effect depends on, in words."""
    against = next(one.against for one in bench.effects if one.name == term)
    return f"follows {DEPENDS_ON.get(against, INPUT[bench.sensor])}"


def effect_text(diagnosis: Diagnosis, bench: Bench, term: str) -> list[str]:
    """What the error depends on, which effect, its size, and what it costs to ignore it."""
    effect = next(one for one in bench.effects if one.name == term)
    sizes, errors, covariance, variant = _found(diagnosis, bench, effect)
    word = "In the model now" if term in bench.fit.model else "Missing"
    title = effect.title if effect.title.startswith(term) else f"{term} ({effect.title})"
    largest_one = int(np.abs(sizes).argmax())
    known = np.abs(sizes[largest_one]) >= MIN_SIZE_IN_ERRORS * errors[largest_one]
    drawn = None if known or effect.free else covariance
    told = sizes_text(effect, bench.sensor, sizes, errors, covariance)
    return [
        f"The {bench.sensor}'s error {dependence_text(bench, term)}.",
        f"{word}: {title}, {told}.",
        f"If it is ignored, it leaves {_price(bench, effect, sizes, variant, drawn)}.",
        *_as_a_clock(bench, effect, sizes, covariance),
    ]


def _as_a_clock(
    bench: Bench, effect: Effect, sizes: FloatArray, covariance: FloatArray | None
) -> list[str]:
    """That a gyroscope's scales change alike, which a clock that changes does as well."""
    slow = effect.family == Clock.family and effect.name != Clock.name
    if bench.sensor not in Clock.sensors or not slow or covariance is None:
        return []
    common, freedom = float(sizes.mean()), bench.fit.degrees_of_freedom or 1
    apart = sizes - common
    across = np.eye(len(sizes)) - 1.0 / len(sizes)
    unlike = apart @ np.linalg.pinv(across @ covariance @ across) @ apart / (len(sizes) - 1)
    if abs(common) < MIN_SIZE_IN_ERRORS * np.sqrt(covariance.mean()):
        return []
    if exceeded(float(unlike), len(sizes) - 1, freedom) < TEST_LEVEL:
        return []
    return [
        (
            "All three scales change alike: a clock that changes, or a time column with another "
            "step from then on, does this as well. Compare the times with another clock."
        )
    ]


def sizes_of(
    diagnosis: Diagnosis, bench: Bench, effect: Effect
) -> tuple[FloatArray, FloatArray, FloatArray | None]:
    """As fitted where the effect is in the model, else as it would come out beside all named.

    Returns:
        Sizes and standard errors, shape (p,), and the covariance, (p, p), where it is known.
    """
    return _found(diagnosis, bench, effect)[:3]


def _found(
    diagnosis: Diagnosis, bench: Bench, effect: Effect
) -> tuple[FloatArray, FloatArray, FloatArray | None, float | None]:
    """See ``sizes_of``; the setting comes last."""
    together = None if diagnosis.findings is None else diagnosis.findings.together
    for fit in (bench.fit, *([] if together is None else [together])):
        first = 0
        for term, sizes, errors in zip(fit.terms, fit.sizes, fit.size_errors, strict=True):
            own = slice(first, first + len(sizes))
            if term.name == effect.name:
                known = fit.size_covariance
                own_covariance = None if known is None else known[own, own]
                return sizes, errors, own_covariance, term.variant
            first = own.stop
    for one in diagnosis.suspects:
        if one.term == effect.name and one.trial is not None:
            setting = one.trial.candidates[0].variant
            return one.trial.size, one.trial.standard_error, one.trial.covariance, setting
    count = len(effect.parameters(bench.sensor))
    return np.zeros(count), np.full(count, np.nan), None, None


def sizes_text(
    effect: Effect,
    sensor: str,
    sizes: FloatArray,
    errors: FloatArray,
    covariance: FloatArray | None = None,
) -> str:
    """The sizes that stand out: ``x 5.1 ± 0.3, z −1.2 ± 0.3 mg/g²``; else the most certain one.

    Large sizes that only their sum is known of are given as that: ``xyz + yxz + zxy 5.1 ± 0.1``.

    Args:
        effect: the effect.
        sensor: whose.
        sizes: shown unit, shape (p,).
        errors: one standard deviation each, NaN where they are not known, shape (p,).
        covariance: of the sizes, where it is known, shape (p, p).
    """
    parameters = effect.parameters(sensor)
    if effect.free:
        size = with_unit(
            plus_minus(*rms_size(sizes, errors, covariance)), f"{parameters[0].unit} rms"
        )
        return f"{parameters[0].name[:1]} {size}"
    names = [one.name for one in parameters]
    certain = np.abs(sizes) / np.where(errors > 0.0, errors, np.inf)
    order = np.argsort(-np.where(np.isfinite(certain), certain, 0.0), kind="stable")
    clear = [k for k in order[:MAX_NAMED_PARAMETERS] if certain[k] >= MIN_SIZE_IN_ERRORS]
    large = np.argsort(-np.abs(sizes), kind="stable")[:MAX_NAMED_PARAMETERS]
    unclear = sorted(k for k in large if certain[k] < MIN_SIZE_IN_ERRORS)
    together = None
    if covariance is not None and not effect.gauge:  # a sum that is zero by convention says nothing
        together = _together(names, sizes, covariance, unclear)
    if together is None and not clear:
        clear = [largest(sizes, errors)]
    parts = [f"{names[k]} {plus_minus(float(sizes[k]), float(errors[k]))}" for k in clear]
    text = with_unit(
        ", ".join(parts if together is None else [together, *parts]), parameters[0].unit
    )
    most = float(np.abs(sizes[clear]).max(initial=0.0))
    alone = [names[k] for k in large if k not in clear and np.abs(sizes[k]) > most]
    return f"{text}; {', '.join(alone)} not determined alone" if alone else text


def _together(
    names: list[str], sizes: FloatArray, covariance: FloatArray, unclear: list[int]
) -> str | None:
    """The sum or difference of unclear sizes, if only that is known of them and it stands out."""
    if len(unclear) < 2:
        return None
    shared = covariance[np.ix_(unclear, unclear)]
    _, vectors = np.linalg.eigh(shared)
    best = vectors[:, 0] / np.abs(vectors[:, 0]).max()
    if not (np.abs(best) >= MIN_EQUAL_PART).all():
        return None
    signs = np.sign(best * best[0])
    value, variance = float(signs @ sizes[unclear]), float(signs @ shared @ signs)
    # what the data do not determine at all has no variance here
    if variance < ROUNDING * float(np.trace(shared)):
        return None
    error, each = float(np.sqrt(variance)), float(np.sqrt(np.diag(shared).min()))
    if error > MAX_ERROR_TOGETHER * each or abs(value) < MIN_SIZE_IN_ERRORS * error:
        return None
    sums = [
        f"{'+' if sign > 0.0 else '−'} {names[k]}" for sign, k in zip(signs, unclear, strict=True)
    ]
    return f"{' '.join(sums)[2:]} {plus_minus(value, error)}"


def leading_sizes_text(effect: Effect, sensor: str, sizes: FloatArray, errors: FloatArray) -> str:
    """Sizes with standard errors, at most three that stand out: ``x −5.03 ± 0.11  y … mg/g²``.

    Unlike ``sizes_text``, it gives sizes that are not clear, too. The arguments are the same.
    """
    if effect.free:
        return sizes_text(effect, sensor, sizes, errors)
    parameters, most = effect.parameters(sensor), MAX_NAMED_PARAMETERS
    safe = np.where(errors > 0.0, errors, np.inf)
    order = np.argsort(-np.nan_to_num(np.abs(sizes) / safe), kind="stable")
    order = np.sort(order[:most]) if len(order) > most else np.arange(len(order))
    if len(sizes) > most and largest(sizes, errors) not in order:
        order[0] = largest(sizes, errors)
    pairs = [f"{parameters[k].name} {plus_minus(sizes[k], errors[k])}" for k in order]
    more = "" if len(sizes) <= most else f"  and {len(sizes) - most} smaller"
    return with_unit("  ".join(pairs), parameters[0].unit) + more


def seen_from(one: Suspect) -> str:
    """From which sizes on these data show an effect and name its family."""
    if one.sized is None:
        return ""
    seen, named = one.detectable_on_any_axis, one.nameable_on_any_axis
    unit = one.sized.unit
    usual = USUAL_SIZES * float(one.sized.typical.min())
    if not seen <= usual:
        most = size_with_unit(usual, unit)
        return f"shown at no size that a sensor usually has (up to {most})"
    words = f"seen from {_told(seen, one.detectable_interval, unit)}"
    if np.isfinite(named):
        words += f", named from {_told(named, one.nameable_interval, unit)}"
        if one.never_named:
            words += f" (never on {', '.join(one.never_named)})"
    else:
        words += ", named at no size: other explanations fit as well"
    if one.sized.variant is not None:
        words += f" (at {one.sized.variant:.0f} s)"
    hard = one.hardly_shown
    return f"{words}; hardly shown on {', '.join(hard)}" if hard else words


def _told(size: float, interval: tuple[float, float] | None, unit: str) -> str:
    """A size, with its interval where that is wide: ``about 0.31 mg (0.22 to 0.52)``."""
    text = size_with_unit(size, unit)
    if interval is None or max(size / interval[0], interval[1] / size) < MIN_UNCERTAINTY_TOLD:
        return text
    low, high = (number(end, 2) for end in interval)
    return f"about {text} ({low} to {high})"


def _price(
    bench: Bench,
    effect: Effect,
    sizes: FloatArray,
    variant: float | None,
    covariance: FloatArray | None = None,
) -> str:
    """The cost of ignoring an effect.

    Args:
        bench: of the sensor.
        effect: the effect.
        sizes: the likeliest, shown unit, shape (p,).
        variant: its setting.
        covariance: of the sizes where the data allow clearly different ones, shape (p, p).
    """
    sensor = bench.sensor
    if effect.sudden and variant is not None:  # at the same share of the ordinary session
        measured = bench.measured.circumstances.reference_time
        variant *= session_of(sensor).reference_time / max(measured, 1e-9)
    when, cost = session_words(effect), cost_of_ignoring(effect, sensor, sizes, variant)
    words = cost.words()
    if covariance is not None:
        rng = np.random.default_rng(0)
        drawn = rng.multivariate_normal(sizes, covariance, DRAWN_SIZES, method="eigh")
        words = cost.words(among=[cost_of_ignoring(effect, sensor, one, variant) for one in drawn])
    return f"{words}{f' {when}' if when else ''}"


def difference_at_one_g(first: Explained, second: Explained) -> float:
    """Angle between the up directions by one explanation and by the other, rms, degrees.

    Both at their estimated sizes, the base model fitted to either: what the magnitude of gravity
    cannot see may still turn the vector.
    """
    c = session_poses()
    errors = [
        one.effect.columns(ACCELEROMETER, c, one.variant) @ one.size for one in (first, second)
    ]
    left = left_by_magnitude(c.force, errors[0] - errors[1])
    up = c.force / np.linalg.norm(c.force, axis=1, keepdims=True)
    across = left - up * (left * up).sum(axis=1, keepdims=True)
    return root_mean_square(np.degrees(np.linalg.norm(across, axis=1) / c.gravity))
