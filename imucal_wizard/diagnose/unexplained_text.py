"""The verdicts "unexplained" and "not repeatable" in sentences: what is left, and what shows more.

No effect is named in these. The sentences state how much more than noise is left, what comes
nearest, what a free curve shows, and which measurements would tell more.
"""

from imucal_wizard.core.notices import NoticeKind
from imucal_wizard.core.quantities import as_sentence, capitalized, listed, number, plural, quantity
from imucal_wizard.diagnose.bench import (
    MAX_SHARE_NOT_PREDICTED,
    Bench,
    falls,
    share_not_predicted,
)
from imucal_wizard.diagnose.change_text import beside_noise
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.effect_text import dependence_text, sizes_of, sizes_text
from imucal_wizard.diagnose.free_curves import shape_of
from imucal_wizard.diagnose.next_poses import ELSEWHERE
from imucal_wizard.diagnose.reservation_text import repeats_not_measured
from imucal_wizard.diagnose.suspects import Suspect
from imucal_wizard.estimate.lack_of_fit import MAX_REPEATABILITY, TEST_LEVEL
from imucal_wizard.model.effects.hysteresis import Hysteresis

MAX_LEFT_BY_ONE_CURVE = 0.2
"""Share of the fitted error that a curve may leave, beside noise, to be called all there is."""


def unexplained_text(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """What is left, its likeliest cause, and what would show more."""
    left = _left(diagnosis, bench)
    if diagnosis.base_left_out:
        return [left]
    rival = _rival(diagnosis, bench)
    if rival is not None and not diagnosis.opinion.lack.within_noise:
        other, known = rival
        return [
            (
                f"{left} {capitalized(other)}, an effect of the same kind as {known}, would lower "
                f"it further: both may be there, or {known} is the wrong one. Add {other}, then "
                f"take {known} out, and compare the errors held out."
            )
        ]
    if diagnosis.in_reference:
        effect = listed(diagnosis.in_reference, "or")
        said = (
            f"With {effect} of the accelerometer, which its own data hardly show, only noise or "
            "an effect that the bench can name would be left: it tilts gravity, and nothing need "
            "be wrong with this sensor."
        )
        advice = "Hold the next poses, and see whether the accelerometer shows it then."
        return [left, said, advice, *repeats_not_measured(bench)]
    if diagnosis.warned(NoticeKind.CLOCKS):
        cause = (
            "Two clocks that run at different rates make such an error: nothing else can be judged "
            "before both sensors have the same one."
        )
        return [left, cause]
    curves = _curves(diagnosis, bench)
    if curves:
        return [left, "No effect tested here explains it.", *curves]
    if any(term.effect.free for term in bench.fit.terms):
        guess = (
            "Between the poses the free curve of the model is only a guess. Hold the device in "
            "poses between those measured."
        )
        return [left, guess, *repeats_not_measured(bench)]
    advice = _shows_repeats(diagnosis, bench)
    if diagnosis.opinion.probable:
        return [left, *_probably(diagnosis, bench), advice, *repeats_not_measured(bench)]
    nothing = _no_effect(diagnosis, bench)
    return [left, nothing, *_odd_one(diagnosis), *repeats_not_measured(bench), advice]


def _odd_one(diagnosis: Diagnosis) -> list[str]:
    """The hold that stands out most, where no verdict speaks of it."""
    report = diagnosis.report
    odd = "" if report is None else report.outlier_notes.get(diagnosis.sensor, "")
    return [f"{capitalized(odd)}."] if odd else []


def _left(diagnosis: Diagnosis, bench: Bench) -> str:
    """How much more than noise is left."""
    lack = diagnosis.opinion.lack
    times = f"the residuals are {number(lack.ratio)} times the measured noise"
    rung, error = bench.ladder[-1], f"The error is {beside_noise(bench)}."
    likely = bench.fit.held_out_interval
    if likely is not None and likely[0] <= (rung.floor or 0.0):
        error = f"The error does not show it: {beside_noise(bench)}."
    if not lack.within_noise:
        return f"More than noise is left: {times}. {error}"
    return (
        f"Noise may be all that is left, but probably not: {times}, and they follow a pattern. "
        f"{error}"
    )


def _shows_repeats(diagnosis: Diagnosis, bench: Bench) -> str:
    """What shows whether an error without a name repeats, or more of it where that is known."""
    if not bench.measured.guided:
        return "Record each mounting a second time: an error of the sensor repeats."
    if not bench.measured.at_rest:
        return (
            f"Repeat the circles {ELSEWHERE}: there an error of the sensor stays the same, but "
            "the field of the room does not."
        )
    repeats = bench.ladder[-1].floors.repeats
    if any(one.axis for one in diagnosis.next_poses):
        return "The next rotations show whether the error repeats."
    if repeats is None or (repeats.repeatable and not repeats.agree):
        return "The next poses show whether the error repeats."
    if not repeats.repeatable:
        return (
            "Reach the next poses from another pose than before: an error that follows the pose "
            "before changes then."
        )
    freedom = plural(repeats.freedom, "degree")
    agree = f"Repeated poses agree within the noise ({freedom} of freedom)"
    if not diagnosis.next_poses:
        return f"{agree}, and every direction of the list was held: poses between these show more."
    return (
        f"{agree}. The next poses are directions that no hold has seen yet: they show on what the "
        "error depends."
    )


def _no_effect(diagnosis: Diagnosis, bench: Bench) -> str:
    """That no effect explains what is left, and which comes nearest."""
    known = ", ".join(term.name for term in bench.fit.terms)
    nearest = _nearest(diagnosis)
    if nearest is not None:
        what = f"what {known} leaves" if known else "it"
        sizes = _with_sizes(diagnosis, bench, nearest.term)
        sizes = _nearest_pair(diagnosis, bench) or sizes
        return f"No effect tested here explains {what} for certain; {sizes} comes nearest."
    if diagnosis.opinion.shapeless:
        return "No effect tested here has the shape of the misfit."
    if known:
        return f"No effect tested here explains what {known} leaves, so nothing more is named."
    return "No effect tested here explains it, so no effect is named or added."


def _curves(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """What the likeliest free curve shows, and what is not known of it; empty where none fits."""
    curves = [one for one in diagnosis.suspects if one.candidate and one.candidate.effect.free]
    shape = shape_of(bench.fit, curves[0].term, curves) if curves else None
    if shape is None:
        return []
    first, now = curves[0], bench.fit.rms_held_out
    then = None if first.trial is None else first.trial.rms_held_out
    others = [other for other in curves[1:] if shape_of(bench.fit, other.term, curves)]
    unit, out = bench.fit.unit, bench.measured.left_out
    if now is None or then is None:
        return []
    change = f"the error on {out} left out from {quantity(now, unit)} to {quantity(then, unit)}"
    if share_not_predicted(now, then, bench.fit.floor) > MAX_SHARE_NOT_PREDICTED:
        return [
            (
                f"A free curve over {shape.over}, {first.term}, would only bring {change}: what it "
                "shows is a guess."
            )
        ]
    left = 0.0 if first.trial is None else first.trial.rms_fitted
    noise = MAX_REPEATABILITY * (bench.fit.floor_fitted or 0.0)
    alone = left <= max(noise, MAX_LEFT_BY_ONE_CURVE * bench.fit.rms_fitted)
    only = " only" if alone and not others else ""
    what = "The error" if alone else "Part of the error"
    depends = f"depends on {shape.over}{only}"
    if shape.against == "time":  # so does everything that changes with it
        depends = f"follows {shape.over}"
    sentences = [f"{what} of {shape.axis} {depends}: {shape.words()}."]
    if not alone:
        sentences.append("More than noise is left beside it, so that its ± says too little.")
    if others:
        names = listed(tuple(one.term for one in others), "or")
        sentences.append(f"It may be {names} as well: these data cannot decide which.")
    adding = f"Adding {first.term} would bring {change}."
    return [*sentences, adding, as_sentence(shape.unknown)]


def _probably(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """The likeliest effect where it is not certain enough to be named."""
    likely = diagnosis.opinion.probable
    names = listed((_with_sizes(diagnosis, bench, likely[0]), *likely[1:]), "or")
    names += "" if likely[1:] else f", which {dependence_text(bench, likely[0])}"
    return [f"The cause is probably {names}, but this is not certain yet."]


def _nearest(diagnosis: Diagnosis) -> Suspect | None:
    """The likeliest effect of the catalogue, if noise alone hardly ever makes it as likely.

    Its size must be clear beside what it leaves, which may be far more than the noise. None where
    effects were added: the suspects are those of the model before.
    """
    effects = [one for one in diagnosis.suspects if one.likeliest and not one.likeliest.effect.free]
    first = effects[0] if effects and not diagnosis.added else None
    if first is None or first.trial is None or first.p > TEST_LEVEL:
        return None
    return first if first.trial.clear else None


def _with_sizes(diagnosis: Diagnosis, bench: Bench, term: str) -> str:
    """An effect with its sizes: ``second-order (x 5.1 ± 0.3 mg/g²)``."""
    effect = next(one for one in bench.catalogue if one.name == term)
    return f"{term} ({sizes_text(effect, bench.sensor, *sizes_of(diagnosis, bench, effect))})"


def _nearest_pair(diagnosis: Diagnosis, bench: Bench) -> str:
    """The two effects of one family that are likelier than any effect alone; "" for none."""
    family = {one.name: one.family for one in bench.catalogue}
    for first in diagnosis.opinion.explanations[:1]:
        if len(first) > 1 and len({family.get(name) for name in first}) == 1:
            return " with ".join(first)
    return ""


MIN_WANDERING = 0.9
"""Probability from which on the repeats are said to follow the time."""


def _follows_nothing(bench: Bench) -> str:
    """What the difference between repeats was tested for, and what else may make it."""
    known = any(one.effect.kind != "orientation" for one in bench.fit.terms)
    further = "a further dependence" if known else "a dependence"
    before, untested = "", "a dependence on the pose before was not tested"
    if any(one.name == Hysteresis.name and bench.lacking(one) is None for one in bench.catalogue):
        before = " or on the force along the same axis in the hold before (hysteresis)"
        untested = "other dependences on the pose before were not tested"
    return (
        f"No test shows {further} on the time (drift, step or wander){before} for certain; "
        f"{untested}. The error may still follow the pose before (hysteresis, play), change "
        "to and fro in the session (supply voltage, a load that switches), differ between poses "
        "that are nearly alike, or come from axes that change in the session or with the "
        "temperature, or the device may settle a little differently each time. To decide, reach "
        "one pose ten times from two sides in turn: readings that form two groups follow the pose "
        "before."
    )


def _course(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """What the difference between repeats follows, where the tests show it."""
    opinion, nearest = diagnosis.opinion, _nearest(diagnosis)
    if not bench.measured.at_rest:
        return [
            (
                "The field differs from place to place, the field or the bias changes in time, or "
                "the axes are read at different times while the device turns: then turning more "
                "slowly lowers the difference."
            )
        ]
    if opinion.probable:
        return _probably(diagnosis, bench)
    if opinion.wandering > MIN_WANDERING:
        return ["The difference follows the time: the bias wanders during the session."]
    if diagnosis.findings is not None and diagnosis.findings.axes_change > MIN_WANDERING:
        return [
            (
                "A change of the axes or the scales during the session explains the difference "
                "best, as where the sensor is not mounted firmly, its housing yields, or the axes "
                "follow the temperature. A bias or a scale that differs from one pose to the next "
                "by chance may look alike."
            )
        ]
    if nearest is not None:
        sizes, follows = (
            _with_sizes(diagnosis, bench, nearest.term),
            dependence_text(bench, nearest.term),
        )
        nearly = _nearest_pair(diagnosis, bench) or f"{sizes}, which {follows},"
        return [f"{capitalized(nearly)} comes nearest, but this is not certain."]
    return []


def not_repeatable_text(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """How much the same pose differs, and against what."""
    floors = bench.ladder[-1].floors
    repeats = floors.repeats
    assert repeats is not None, "repeats were tested"  # noqa: S101 (narrows the type)
    size, within = quantity(repeats.rms, floors.unit), floors.within_text
    low, high = (quantity(one, floors.unit) for one in repeats.interval)
    interval = f"90 % interval {low} to {high}, {plural(repeats.freedom, 'degree')} of freedom"
    what, noise = "pose", "noise within a hold"
    if not bench.measured.at_rest:
        what, noise = "direction of the field", "noise of its samples"
    curves = _curves(diagnosis, bench)
    return [
        (
            f"The same {what} does not repeat: it differs by {size} from visit to visit "
            f"({interval}); the {noise} gives {within}."
        ),
        *(_course(diagnosis, bench) or ([] if curves else [_follows_nothing(bench)])),
        *curves,
        *([] if curves else ["No model of the pose alone can be judged below this difference."]),
        *_odd_one(diagnosis),
        f"The error is {beside_noise(bench)}.",
    ]


def _rival(diagnosis: Diagnosis, bench: Bench) -> tuple[str, str] | None:
    """The effect that explains what one of its family in the model leaves, and that one."""
    family = {one.name: one.family for one in bench.catalogue if one.family is not None}
    added = {family[term.name]: term.name for term in bench.fit.terms if term.name in family}
    tried = {one.term: one.trial for one in diagnosis.suspects}
    for members in diagnosis.opinion.explanations[:1]:
        trial = tried.get(members[0]) if len(members) == 1 else None
        # beside the one in the model it must help, or it explains nothing
        now, then = bench.fit.rms_held_out, None if trial is None else trial.rms_held_out
        if falls(now, then) and family.get(members[0]) in added:
            return members[0], added[family[members[0]]]
    return None
