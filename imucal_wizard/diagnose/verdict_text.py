"""The verdict in plain sentences, for a technician and for a student.

It states what the error depends on, the effect and its size, the cost of ignoring it, and the
measurements that would decide where these data do not.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from imucal_wizard.core.directions import SAME_DIRECTION, unit_vectors
from imucal_wizard.core.notices import NoticeKind, of_kind
from imucal_wizard.core.quantities import (
    as_sentence,
    listed,
    number,
    plural,
    quantity,
    size_with_unit,
)
from imucal_wizard.diagnose.bench import MAX_SHARE_NOT_PREDICTED, Bench, share_not_predicted
from imucal_wizard.diagnose.change_text import Judged, change_held_out, why_not_confirmed
from imucal_wizard.diagnose.diagnosis import Apart, Diagnosis
from imucal_wizard.diagnose.effect_text import (
    dependence_text,
    difference_at_one_g,
    effect_text,
    sizes_of,
    sizes_text,
)
from imucal_wizard.diagnose.floors import Floors
from imucal_wizard.diagnose.free_curves import shape_of
from imucal_wizard.diagnose.next_poses import (
    ELSEWHERE,
    explanation_of,
    measured_again,
    rivals,
)
from imucal_wizard.diagnose.residuals import beyond_bounds
from imucal_wizard.diagnose.suspects import Suspect
from imucal_wizard.diagnose.verdict import Opinion, Terms, Verdict
from imucal_wizard.estimate.distributions import exceeded
from imucal_wizard.estimate.held_out import items_of
from imucal_wizard.estimate.lack_of_fit import MAX_REPEATABILITY, TEST_LEVEL
from imucal_wizard.estimate.repeatability import within_freedom
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.effects.earth_rate import EarthRate
from imucal_wizard.model.effects.hysteresis import Hysteresis

TOO_FEW_RATIO = 3.0
"""An error held out of so many times the fitted one comes from too few data: with twice as many
equations as unknowns the ratio is about two."""
CHANGED_RATIO = 3.0
"""New poses with so many times the error held out disagree with it: in four poses chance makes
twice."""
MAX_LEFT_BY_ONE_CURVE = 0.2
"""Share of the fitted error that a curve may leave, beside noise, to be called all there is."""
EARTH_SHOWS = 0.5
"""Of the noise: what is less makes an error larger by less than an eighth."""
LISTED_EXPLANATIONS = 4
FAMILIES = {
    "even-order": "an error with the same sign for both directions of the input",
    "odd-order": "an error with opposite signs for the two directions of the input",
    "slow-bias": "a bias that changes slowly",
    "slow-scale": "a scale that changes slowly",
}
BEYOND = {
    "orientation": "forces well over 1 g",
    "time": "a session in which the temperature rises and falls",
    "hold": "holds taken in another order and on another support",
}
"""What may decide where still poses do not."""
RATE_TABLE = "constant rates about several axes, as on a rate table,"


def verdict_text(diagnosis: Diagnosis) -> str:
    """The sentences of a diagnosis, the most important first."""
    bench = diagnosis.bench
    parts = _of_method(diagnosis) + _base_left_out(diagnosis)
    parts += [] if bench is None else _not_confirmed(bench)
    if diagnosis.verdict is Verdict.INSUFFICIENT:
        parts += _insufficient(diagnosis)
    elif bench is not None and diagnosis.rests_left_out:
        unlike = f"{_capital(diagnosis.rests_left_out)}."
        left = f"In the holds alone the error is {_against_noise(bench)}."
        return " ".join([*parts, unlike, left, "Find the cause, and record again."])
    elif bench is not None:
        if diagnosis.verdict not in (Verdict.AMBIGUOUS, Verdict.MISSING):
            for one in diagnosis.found:
                parts += effect_text(diagnosis, bench, one.term)
                if one.like:
                    parts += [f"It may be {_or(one.like)} as well: these data cannot decide."]
            parts += _fall(diagnosis, bench) if diagnosis.added else []
        sentences_of = {
            Verdict.COMPLETE: _complete,
            Verdict.MISSING: _missing,
            Verdict.AMBIGUOUS: _ambiguous,
            Verdict.UNEXPLAINED: _unexplained,
            Verdict.NOT_REPEATABLE: _not_repeatable,
            Verdict.DISTURBED: _disturbed,
            Verdict.WAITING: _waiting,
        }[diagnosis.verdict]
        parts += sentences_of(diagnosis, bench)
        parts += _closures(diagnosis)
    if bench is not None:
        parts += _curves_of_model(bench)
        parts += _reservations(diagnosis, bench)
    return " ".join(parts)


def _of_method(diagnosis: Diagnosis) -> list[str]:
    """That a method of the papers was not judged, but the fit of rows and terms."""
    fit = None if diagnosis.report is None else diagnosis.report.sensors.get(diagnosis.sensor)
    if fit is None or not diagnosis.by_method:
        return []
    held_out = f"{quantity(fit.rms_held_out, fit.unit)} held out"
    error = f"{quantity(fit.rms_fitted, fit.unit)} fitted" if fit.rms_held_out is None else held_out
    return [
        (
            f"With the {diagnosis.by_method} method the error is {error}; the following is said of "
            "the usual fit of the same data."
        )
    ]


def _base_left_out(diagnosis: Diagnosis) -> list[str]:
    gone = diagnosis.base_left_out
    if not gone:
        return []
    names = listed(gone)
    verb, them = ("is", "it") if len(gone) == 1 else ("are", "them")
    return [
        (
            f"{_capital(names)} of the base model {verb} left out, but every sensor needs {them}: "
            f"most of the error comes from that. Put back {names}."
        )
    ]


def _not_confirmed(bench: Bench) -> list[str]:
    """That data held out speak against the newest term."""
    # one of several that were added together may well make things worse alone
    newest, together = bench.ladder[-1].added, {one.term for one in bench.found}
    if newest is None or newest in together or bench.confirmed():
        return []
    return [f"{_capital(newest)} was added, but {why_not_confirmed(bench)}. Take it out again."]


def _complete(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    if diagnosis.base_left_out:
        return [f"The error is {_against_noise(bench)}."]
    where = (
        "" if _disagreeing(diagnosis) is None else " for the poses of the fit, not for the new ones"
    )
    return [f"The model is complete{where}: {_against_noise(bench)}.", *_not_measured(bench)]


def _not_measured(bench: Bench) -> list[str]:
    """That no pose was repeated; a field that comes again is at another place of the room."""
    if not bench.measured.at_rest or bench.ladder[-1].floors.repeats is not None:
        return []
    return ["No pose was held twice, so repeatability was not measured."]


def _slow_noise(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """What slow noise that long holds show, or do not exclude, has to do with the verdict."""
    floors, lack = bench.ladder[-1].floors, _opinion(diagnosis).lack
    if floors.slow:
        return [
            (
                f"Of the noise, {quantity(floors.slow, floors.unit)} is slow noise from hold to "
                "hold: the flicker noise that the long holds show, extrapolated to the session."
            )
        ]
    slow, table = bench.measured.slow_noise_not_excluded, bench.fit.rows
    if diagnosis.verdict is not Verdict.UNEXPLAINED or not slow or table is None:
        return []
    ratio, freedom = (
        lack.ratio**2 / (1.0 + (slow / floors.within) ** 2),
        bench.fit.degrees_of_freedom,
    )
    if exceeded(ratio, freedom, within_freedom(table)) < TEST_LEVEL:
        return []
    return [
        (
            "Slow noise may be what is left: these holds do not exclude "
            f"{quantity(slow, floors.unit)} of it from hold to hold. One rest of some minutes, or "
            "a second visit to some poses, separates it from an error of the sensor."
        )
    ]


def _missing(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    terms = [term for members in _opinion(diagnosis).terms for term in members]
    sentences = [sentence for term in terms for sentence in effect_text(diagnosis, bench, term)]
    return sentences + _disturbed_beside(diagnosis) + _fall(diagnosis, bench)


def _ambiguous(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """The candidates, whether it matters which it is, and what would decide."""
    opinion = _opinion(diagnosis)
    choice = "; and ".join(_or(members) for members in opinion.terms)
    kinds = " and ".join(FAMILIES.get(name, name) for name in dict.fromkeys(opinion.families))
    # of a family's, one effect before two: pairs may be many
    plain = sorted(opinion.explanations, key=len) if opinion.together else opinion.explanations
    listed = "; ".join(" with ".join(terms) for terms in plain[:LISTED_EXPLANATIONS])
    if opinion.together:
        parts = [
            (
                f"The {bench.sensor} shows {kinds}, which has several explanations that these data "
                f"cannot separate: {listed}."
            )
        ]
    elif opinion.families:
        parts = [f"The {bench.sensor} shows {kinds}: {choice}. These data cannot decide which."]
    else:
        parts = [
            (
                f"The {bench.sensor}'s misfit has several explanations that these data cannot "
                f"separate: {listed}."
            )
        ]
    for term in diagnosis.added:
        parts += effect_text(diagnosis, bench, term)
    parts += _disturbed_beside(diagnosis)
    parts += _fall(diagnosis, bench) if diagnosis.added or opinion.families else []
    kinds_of = {effect.name: effect.kind for effect in bench.catalogue}
    decides = [
        would_decide(one, kinds_of[one.first]) for one in diagnosis.apart if one.never or one.poses
    ]
    return parts + _matters(diagnosis, bench) + decides


def _closures(diagnosis: Diagnosis) -> list[str]:
    """What the gyroscope's rotations say of each explanation."""
    opinion = _opinion(diagnosis)
    if opinion.heard is None or diagnosis.verdict is Verdict.DISTURBED:
        return []
    order = sorted(opinion.heard.with_terms.items(), key=lambda one: -one[1].log_evidence)
    closures = [(terms, opinion.closures(terms)) for terms, _ in order]
    known = [(terms, pair) for terms, pair in closures if pair is not None]
    # effects by themselves, if there are any: with another one beside them they close alike
    known = [one for one in known if len(one[0]) == 1] or known
    if not known:
        return []
    each = ", ".join(
        f"{quantity(pair[1], 'rad')} with {' and '.join(terms)}"
        for terms, pair in known[:LISTED_EXPLANATIONS]
    )
    end = ""
    if opinion.decided:
        chosen = zip(opinion.families, opinion.terms, strict=True)
        left = [(name, members) for name, members in chosen if name in opinion.decided]
        verb = "decides for" if all(len(members) == 1 for _, members in left) else "leaves"
        names = [_decided(opinion, *one) for one in left]
        end = f": with the accelerometer's residuals, this {verb} {listed(names)}"
    elif opinion.heard.lacks_all:
        them = "it" if len(known) == 1 else "each of them"
        end = f": far more than the noise also with {them}, so that this decides nothing"
    elif opinion.heard.against_all:
        them = "it" if len(known) == 1 else "each of them"
        # what is named nevertheless explains the accelerometer's own residuals
        end = f": this contradicts {them}"
        if opinion.families or diagnosis.found:
            end = f": this speaks against {them}, and the accelerometer's residuals for {them}"
    now = quantity(known[0][1][0], "rad")
    first = f"was {now} before" if diagnosis.added else f"is {now} now"
    return [f"The gyroscope's closure {first}, {each}{end}."]


def _decided(opinion: Opinion, family: str, members: Terms) -> str:
    """What the gyroscope has left of a family; how probable it is, where it is one effect."""
    share = min(int(100.0 * opinion.shares[family]), 99)
    return f"{members[0]} (probability {share} %)" if len(members) == 1 else _or(members)


def _unexplained(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """What is left, its likeliest cause, and what would show more."""
    left = _left(diagnosis, bench)
    if diagnosis.base_left_out:
        return [left]
    rival = _rival(diagnosis, bench)
    if rival is not None and not _opinion(diagnosis).lack.within_noise:
        other, known = rival
        return [
            (
                f"{left} {_capital(other)}, an effect of the same kind as {known}, explains it: "
                f"{known} may be the wrong one. Take {known} out and look again."
            )
        ]
    if diagnosis.in_reference:
        effect = _or(diagnosis.in_reference)
        said = (
            f"With {effect} of the accelerometer, which its own data hardly show, only noise or "
            "an effect that the bench can name would be left: it tilts gravity, and nothing need "
            "be wrong with this sensor."
        )
        advice = "Hold the next poses, and see whether the accelerometer shows it then."
        return [left, said, advice, *_not_measured(bench)]
    curves = _curves(diagnosis, bench)
    if curves:
        return [left, "No effect tested here explains it.", *curves]
    if any(term.effect.free for term in bench.fit.terms):
        guess = (
            "Between the poses the free curve of the model is only a guess. Hold the device in "
            "poses between those measured."
        )
        return [left, guess, *_not_measured(bench)]
    advice = _shows_repeats(diagnosis, bench)
    if _opinion(diagnosis).probable:
        return [left, *_probably(diagnosis, bench), advice, *_not_measured(bench)]
    nothing = _no_effect(diagnosis, bench)
    return [left, nothing, *_odd_one(diagnosis), *_not_measured(bench), advice]


def _odd_one(diagnosis: Diagnosis) -> list[str]:
    """The hold that stands out most, where no verdict speaks of it."""
    report = diagnosis.report
    odd = "" if report is None else report.outlier_notes.get(diagnosis.sensor, "")
    return [f"{_capital(odd)}."] if odd else []


def _left(diagnosis: Diagnosis, bench: Bench) -> str:
    """How much more than noise is left."""
    lack = _opinion(diagnosis).lack
    times = f"the residuals are {number(lack.ratio)} times the measured noise"
    rung, error = bench.ladder[-1], f"The error is {_against_noise(bench)}."
    likely = bench.fit.held_out_interval
    if likely is not None and likely[0] <= (rung.floor or 0.0):
        error = f"The error does not show it: {_against_noise(bench)}."
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
    return (
        "Repeated poses agree within the noise "
        f"({plural(repeats.freedom, 'degree')} of freedom). The next poses are directions that no "
        "hold has seen yet: they show on what the error depends."
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
    if _opinion(diagnosis).shapeless:
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
        names = _or(tuple(one.term for one in others))
        sentences.append(f"It may be {names} as well: these data cannot decide which.")
    return [*sentences, f"Adding {first.term} would bring {change}.", f"{_capital(shape.unknown)}."]


def _curves_of_model(bench: Bench) -> list[str]:
    """What the free curves of the model show, and what is not known of them."""
    shapes = [shape_of(bench.fit, one.name, ()) for one in bench.fit.terms if one.effect.free]
    return [
        f"In the model now: {one.term}, the error of {one.axis} over {one.over}: {one.words()}; "
        f"{one.unknown}."
        for one in shapes
        if one is not None
    ]


def _probably(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """The likeliest effect where it is not certain enough to be named."""
    likely = _opinion(diagnosis).probable
    names = _or((_with_sizes(diagnosis, bench, likely[0]), *likely[1:]))
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
    for first in _opinion(diagnosis).explanations[:1]:
        if len(first) > 1 and len({family.get(name) for name in first}) == 1:
            return " with ".join(first)
    return ""


MIN_WANDERING = 0.9
"""Probability from which on the repeats are said to follow the time."""


def _follows_nothing(bench: Bench) -> str:
    """What the difference between repeats was tested for, and what else may make it."""
    tested = any(
        one.name == Hysteresis.name and bench.lacking(one) is None for one in bench.catalogue
    )
    before = "; a dependence on the pose before was not tested"
    if tested:
        before = (
            " and none on the force along the same axis in the hold before (hysteresis); other "
            "dependences on the pose before were not tested"
        )
    return (
        f"The tests show no dependence on the time{before}. The error may follow the pose before "
        "in another way (play, or the force along another axis), differ between poses that are "
        "nearly alike, or come from axes that change in the session or with the temperature, or "
        "the device may settle a little differently each time. To decide, reach one pose ten times "
        "from two sides in turn: readings that form two groups follow the pose before."
    )


def _course(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """What the difference between repeats follows, where the tests show it."""
    opinion, nearest = _opinion(diagnosis), _nearest(diagnosis)
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
    if nearest is not None:
        sizes, follows = (
            _with_sizes(diagnosis, bench, nearest.term),
            dependence_text(bench, nearest.term),
        )
        nearly = _nearest_pair(diagnosis, bench) or f"{sizes}, which {follows},"
        return [f"{_capital(nearly)} comes nearest, but this is not certain."]
    return []


def _not_repeatable(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """How much the same pose differs, and against what."""
    floors = bench.ladder[-1].floors
    repeats = floors.repeats
    assert repeats is not None, "repeats were tested"  # noqa: S101 (narrows the type)
    size, within = quantity(repeats.rms, floors.unit), _within(floors)
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
        f"The error is {_against_noise(bench)}.",
    ]


def _within(floors: Floors) -> str:
    """The noise within a hold, and the slow noise that is known beside it."""
    within = quantity(floors.within, floors.unit)
    return f"{within}, slow noise {quantity(floors.slow, floors.unit)}" if floors.slow else within


def _rival(diagnosis: Diagnosis, bench: Bench) -> tuple[str, str] | None:
    """The effect that explains what one of its family in the model leaves, and that one."""
    family = {one.name: one.family for one in bench.catalogue if one.family is not None}
    added = {family[term.name]: term.name for term in bench.fit.terms if term.name in family}
    for members in _opinion(diagnosis).explanations[:1]:
        if len(members) == 1 and family.get(members[0]) in added:
            return members[0], added[family[members[0]]]
    return None


def _disturbed_places(diagnosis: Diagnosis) -> list[str]:
    """What disagrees with all the rest, in words."""
    places = [f"hold {hold + 1}" for hold in diagnosis.disturbed_holds]
    places += [
        f"the field from {start:.0f} to {end:.0f} s" for start, end in diagnosis.disturbed_stretches
    ]
    if diagnosis.bench is None or not diagnosis.disturbed_rotations:
        return places
    # a rotation between two rests, or a step of a rate table
    table = diagnosis.bench.rows
    rows = [row for row in map(table.first_row, _opinion(diagnosis).holds) if table.moving[row]]
    return places + [table.place(row).partition(",")[0] for row in rows]


def _disturbed_beside(diagnosis: Diagnosis) -> list[str]:
    """That a part disagrees with all the rest beside what is named."""
    places = _disturbed_places(diagnosis)
    if not places:
        return []
    verb, them = ("disagree", "them") if len(places) > 1 else ("disagrees", "it")
    also = f"{_capital(listed(places))} {verb} with all the rest beside this"
    return [f"{also}: measure {them} again; nothing has been deleted."]


def _disturbed(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    del bench
    places = _disturbed_places(diagnosis)
    verb, them = ("explain", "them") if len(places) > 1 else ("explains", "it")
    what = "the device moved, or the sensor changed"
    advice = f"Measure {them} again; nothing has been deleted."
    if spans := spans_to_leave_out(diagnosis):
        said = listed([f"{start:.1f} to {end:.1f} s" for start, end in spans])
        advice = (
            f"Other holds in the same pose agree with the rest: fit the recording without {said}. "
            "Nothing has been deleted."
        )
    return [
        (
            f"{_capital(listed(places) or 'one hold')} {verb} the misfit better than any effect "
            f"tested here, and without {them} only noise is left: {what}. {advice}"
        )
    ]


def spans_to_leave_out(diagnosis: Diagnosis) -> list[tuple[float, float]]:
    """Spans of the disturbed holds, s, if nothing else is disturbed and others show their poses."""
    bench, findings = diagnosis.bench, diagnosis.findings
    others = diagnosis.disturbed_stretches or diagnosis.disturbed_rotations
    if bench is None or findings is None or others or not diagnosis.disturbed_holds:
        return []
    items = findings.opinion.holds
    if not measured_again(bench.rows, items):
        return []
    rows = [bench.rows.first_row(one) for one in items]
    return [(float(start), float(end)) for start, end in bench.rows.span[rows]]


_FIRST = {
    Verdict.NOT_REPEATABLE: (
        "The accelerometer does not repeat in the same pose",
        "Find what differs there first",
    ),
    Verdict.DISTURBED: (
        "A part of the accelerometer's measurement disagrees with all the rest",
        "Measure that part again first",
    ),
}
"""What keeps another sensor waiting, and what to do about it."""
_INCOMPLETE = "The accelerometer's model is not complete yet", "Complete the accelerometer first"


def _waiting(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    why, what = _INCOMPLETE
    if diagnosis.waits_for is not None:
        why, what = _FIRST.get(diagnosis.waits_for, _INCOMPLETE)
    first = (
        f"{why}. Its error tilts the reference and would be attributed to the {bench.sensor}. "
        f"{what}. The {bench.sensor}'s error now is {_against_noise(bench)}."
    )
    choice = "; and ".join(_or(members) for members in _opinion(diagnosis).terms)
    return [first, f"The misfit looks like {choice}."] if choice else [first]


def _insufficient(diagnosis: Diagnosis) -> list[str]:
    why = f"the {diagnosis.sensor}'s data are too few for this model: {diagnosis.lacking}"
    refused = of_kind([diagnosis.lacking], NoticeKind.NOT_CALIBRATED)
    sentences = [f"{_capital(refused[0] if refused else why)}."]
    if diagnosis.bench is not None and not diagnosis.bench.fit.unchecked:
        fit = diagnosis.bench.fit
        what = "all other parameters of " if fit.not_determined else ""
        sentences.append(f"These data determine {what}{', '.join(fit.model)}.")
    # more data of the same kind would clip as well, and show as little of a dead axis
    dead = _warnings(diagnosis, NoticeKind.DEAD)[:1]
    return [*dead, *sentences, *_warnings(diagnosis, *_CLIPPED)]


_CLIPPED = NoticeKind.CLIPPED, NoticeKind.CLIPPED_ROTATIONS, NoticeKind.CLIPPED_HOLDS
_WRONG_HOLDS = (NoticeKind.CLIPPED_HOLDS, NoticeKind.STUCK_HOLDS)
"""Warnings about holds that are left out because their readings are not the sensor's."""


def _warnings(diagnosis: Diagnosis, *kinds: NoticeKind) -> list[str]:
    """The warnings of this sensor of these kinds, as sentences."""
    report, sensor = diagnosis.report, diagnosis.sensor
    said = [] if report is None else report.warned(sensor, *kinds)
    return [f"{_capital(one.removesuffix('.'))}." for one in said]


def _reservations(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """What limits the verdict, and what the user did that the data do not support."""
    floors, sentences = bench.ladder[-1].floors, [bench.measured.assumption, _of_earth(bench)]
    found = floors.repeats
    if (
        found is not None
        and not found.repeatable
        and diagnosis.verdict in _NOTHING_KNOWN_IS_MISSING
    ):
        repeats, within = quantity(found.rms, floors.unit), _within(floors)
        if not bench.measured.at_rest:
            where = f"{repeats} from one time to another, {within} within each"
            sentences.append(f"The same direction does not repeat: {where}.")
        elif diagnosis.verdict is Verdict.COMPLETE:
            sentences.append(
                f"A repeated pose differs by {repeats}, and the noise within a hold gives "
                f"{within}: changes slower than a hold (slow noise, temperature, placement) count "
                "as noise here."
            )
        else:
            sentences.append(
                f"Visits to a pose differ by {repeats}, where the noise within a hold gives "
                f"{within}: the reading does not repeat, or the error differs between poses that "
                "are nearly alike."
            )
    fitted, held_out = bench.fit.rms_fitted, bench.fit.rms_held_out
    above_noise = held_out is not None and held_out > (bench.fit.floor or 0.0)
    if above_noise and held_out is not None and held_out > TOO_FEW_RATIO * fitted > 0.0:
        sentences.append(
            f"These {bench.measured.left_out} are too few to predict one that is left out: more of "
            "them lower the held-out error."
        )
    sentences += _slow_noise(diagnosis, bench)
    sentences += map(as_sentence, bench.refused)
    sentences += _warnings(diagnosis, *_WRONG_HOLDS)
    return [one for one in sentences if one] + _new_poses(diagnosis)


def _of_earth(bench: Bench) -> str:
    """By how much the Earth turns the rotations, where the error shows it; "" elsewhere."""
    rows, found = bench.rows, bench.fit.minimum
    own = np.array([name.startswith(f"{EarthRate.name}_") for name in rows.names], bool)
    # what is larger than the Earth's rate has taken up something else
    if found is None or not own.any() or own[beyond_bounds(found, rows)].any():
        return ""
    turned = items_of(found).rms(rows.columns[:, own] @ found.system.value[~found.slow][own])
    if turned <= EARTH_SHOWS * (bench.fit.floor_fitted or 0.0):
        return ""
    return (
        f"The error contains {quantity(turned, bench.fit.unit, 2)} by which the Earth turns during "
        f"the {bench.measured.left_out}; the fit allows for it."
    )


_NOTHING_KNOWN_IS_MISSING = (Verdict.COMPLETE, Verdict.UNEXPLAINED)
"""Verdicts in which no effect is missing that would spoil the repeats: no pose is held again
exactly alike, so that a missing effect makes repeats differ, too."""


def _disagreeing(diagnosis: Diagnosis) -> SensorFit | None:
    """The fit with its error on poses measured for validation, if that is not the one held out."""
    report, bench = diagnosis.report, diagnosis.bench
    if report is None or bench is None:
        return None
    fit = bench.measured.validated(bench.fit, report.validation)
    if fit.validation_rms is None or fit.rms_held_out is None:
        return None
    expected = CHANGED_RATIO * max(fit.rms_held_out, fit.floor or 0.0)
    return fit if fit.validation_rms > expected else None


def _new_poses(diagnosis: Diagnosis) -> list[str]:
    """That poses measured for validation differ from what was held out, and what may cause it."""
    fit = _disagreeing(diagnosis)
    if fit is None:
        return []
    count = len(fit.validation)
    where = f"your {count} new poses" if count > 1 else "your new pose"
    size = quantity(fit.validation_rms, fit.unit)
    error = f"On {where} the error is {size}, more than expected from the held-out data"
    changed = "something has changed since (temperature, a knock), or the device was less still"
    if not _shown_by_new_poses_alone(diagnosis, fit):
        return [f"{error}: {changed}. Measure them again."]
    return [
        f"{error}: the model may lack what the poses of the fit do not show, or {changed}.",
        "Fit all samples of the session together: if no effect explains them, measure them again.",
    ]


def _shown_by_new_poses_alone(diagnosis: Diagnosis, fit: SensorFit) -> bool:
    """Whether an effect that the poses of the fit do not show may make the error of the new ones.

    They have other directions, or the data do not exclude an error as large.
    """
    bench, report, present = diagnosis.bench, diagnosis.report, diagnosis.present
    error = fit.validation_rms
    if bench is None or report is None or present is None or error is None:
        return False
    read = np.array([one.accelerometer for one in report.validation])
    new = unit_vectors((read - fit.bias) @ fit.matrix.T)
    held = bench.rows.direction[~np.isnan(bench.rows.direction).any(axis=1)]
    nearest = np.arccos(np.clip((new @ held.T).max(axis=1), -1.0, 1.0))
    hidden = present.most_hidden
    possible = max(present.could_be or 0.0, 0.0 if hidden is None else hidden.error)
    return bool((nearest > SAME_DIRECTION).any()) or possible >= error


def _fall(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """How the error on data held out fell, or would fall."""
    unit = bench.fit.unit
    if diagnosis.added:
        below, above = bench.ladder[-1 - len(diagnosis.added)], bench.ladder[-1]
        one = change_held_out(bench.measured, below, above)
        noise = one.alone or f", where noise alone gives {quantity(above.floor, unit)}"
        return [
            f"Added: the error on {one.of} left out falls from {one.before} to {one.after}{noise}."
        ]
    opinion, together = _opinion(diagnosis), diagnosis.findings and diagnosis.findings.together
    if together:
        return _adding(bench, [one.name for one in together.terms], together)
    # one of those that are named, if any is
    named = bench.plainest(opinion.terms)[:1]
    of_named = [one for one in diagnosis.suspects if one.term in named]
    first = next(iter(of_named or diagnosis.suspects), None)
    if first is None or first.trial is None:
        return []
    return _adding(bench, [first.term], first.trial)


def _adding(bench: Bench, terms: Sequence[str], trial: Judged) -> list[str]:
    """What adding effects would do to the error held out; empty where it is not known."""
    now, then = bench.fit.held_out_in_noise, trial.held_out_in_noise
    if now is None or then is None:
        return []
    added = listed([one for one in terms if one not in bench.fit.model])
    one = change_held_out(bench.measured, bench.fit, trial)
    if one.before == one.after:
        return [f"Adding {added} would leave the error on {one.of} left out at {one.before}."]
    change = f"the error on {one.of} left out from {one.before} to {one.after}{one.alone}"
    if then < now:
        return [f"Adding {added} would bring {change}."]
    return [f"Adding {added} would raise {change}, so it is not added."]


def _matters(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """Whether it matters at 1 g which of the likeliest it is."""
    if diagnosis.findings is None or bench.fit.unit != "m/s^2":
        return []
    likely = rivals(diagnosis.findings)[:LISTED_EXPLANATIONS]
    found = [explanation_of(bench, diagnosis.findings, term) for term in likely]
    known = [one for one in found if one is not None and one.effect.kind == "orientation"]
    if len(known) < 2:
        return []
    apart = {pair: difference_at_one_g(*pair) for pair in combinations(known, 2)}
    most = max(apart, key=lambda pair: apart[pair])
    noise = bench.fit.floor_fitted if bench.fit.floor is None else bench.fit.floor
    if apart[most] <= np.degrees((noise or 0.0) / bench.measured.gravity):
        among = "among" if known[2:] else "between"
        names = listed([one.effect.name for one in known])
        return [
            (
                f"At 1 g and below, the choice {among} {names} does not matter: it changes the up "
                f"direction by {_degrees(apart[most])}, within the noise. It can matter at 2 g and "
                "more."
            )
        ]
    names = listed([one.effect.name for one in most])
    change = f"changes the up direction by {_degrees(apart[most])} rms"
    return [f"The choice between {names} {change}, so it matters at 1 g too."]


def would_decide(one: Apart, kind: str) -> str:
    """What separates two effects of this kind, or what may where nothing does that was tried."""
    beyond = RATE_TABLE if one.turning and kind == "orientation" else BEYOND[kind]
    pair = f"{one.first} from {one.second}"
    if one.never:
        what = "rotation" if one.turning else "still pose at 1 g"
        return f"No {what} tried here separates {pair}; {beyond} may."
    before = (
        "at no size"
        if not np.isfinite(one.before)
        else f"from {size_with_unit(one.before, one.unit)} on"
    )
    listed = f"{one.things}, listed as the next ones,"
    after, here = (
        size_with_unit(one.after, one.unit),
        f"it is about {size_with_unit(one.size, one.unit)} here",
    )
    if one.enough:
        return (
            f"These data separate {pair} {before}; {listed} would separate them from {after} on, "
            f"and {here}."
        )
    what = "Rotations" if one.turning else "Still poses at 1 g"
    return (
        f"{what} hardly separate {pair}: these data do {before}, {listed} from {after} on, and "
        f"{here}. {_capital(beyond)} may."
    )


def _against_noise(bench: Bench) -> str:
    """The error on data held out, beside the noise."""
    rung, unit = bench.ladder[-1], bench.fit.unit
    held, noise = quantity(rung.rms_held_out, unit), quantity(rung.floor, unit)
    return f"{held} on {bench.measured.left_out} left out; noise alone gives {noise}"


def _opinion(diagnosis: Diagnosis) -> Opinion:
    assert diagnosis.findings is not None, "a bench has findings"  # noqa: S101 (narrows the type)
    return diagnosis.findings.opinion


def _degrees(value: float) -> str:
    return quantity(float(np.radians(value)), "rad")


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _or(members: tuple[str, ...]) -> str:
    return members[0] if len(members) == 1 else f"{', '.join(members[:-1])} or {members[-1]}"
