"""The verdict in plain sentences, for a technician and for a student.

It states what the error depends on, the effect and its size, the cost of ignoring it, and the
measurements that would decide where these data do not.
"""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from imucal_wizard.core.notices import NoticeKind, of_kind
from imucal_wizard.core.quantities import capitalized, listed, quantity, size_with_unit
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.change_text import (
    Judged,
    beside_noise,
    change_held_out,
    why_not_confirmed,
)
from imucal_wizard.diagnose.diagnosis import Apart, Diagnosis
from imucal_wizard.diagnose.effect_text import difference_at_one_g, effect_text
from imucal_wizard.diagnose.next_poses import explanation_of, measured_again, rivals
from imucal_wizard.diagnose.reservation_text import (
    curves_of_model_text,
    differing_in_new_poses,
    repeats_not_measured,
    reservation_text,
)
from imucal_wizard.diagnose.unexplained_text import not_repeatable_text, unexplained_text
from imucal_wizard.diagnose.verdict import Opinion, Terms, Verdict
from imucal_wizard.estimate.second_stage.field_changes import only_headings_differ

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
    parts += [] if bench is None else not_confirmed(bench)
    if diagnosis.verdict is Verdict.INSUFFICIENT:
        parts += _insufficient(diagnosis)
    elif bench is not None and diagnosis.unlike_holds is not None:
        unlike = f"{capitalized(diagnosis.unlike_holds)}."
        left = f"In the holds alone the error is {beside_noise(bench)}."
        known = diagnosis.unlike_holds.kind is NoticeKind.SETTLING
        again = "Record again." if known else "Find the cause, and record again."
        return " ".join([*parts, unlike, left, again])
    elif bench is not None:
        if diagnosis.verdict not in (Verdict.AMBIGUOUS, Verdict.MISSING):
            for one in diagnosis.found:
                parts += effect_text(diagnosis, bench, one.term)
                if one.like:
                    others = listed(one.like, "or")
                    parts += [f"It may be {others} as well: these data cannot decide."]
            parts += _fall(diagnosis, bench) if diagnosis.added else []
        sentences_of = {
            Verdict.COMPLETE: _complete,
            Verdict.MISSING: _missing,
            Verdict.AMBIGUOUS: _ambiguous,
            Verdict.UNEXPLAINED: unexplained_text,
            Verdict.NOT_REPEATABLE: not_repeatable_text,
            Verdict.DISTURBED: _disturbed,
            Verdict.WAITING: _waiting,
        }[diagnosis.verdict]
        parts += sentences_of(diagnosis, bench)
        parts += _closures(diagnosis) + diagnosis.warned(NoticeKind.FIELD_TURNED)
    if bench is not None:
        parts += curves_of_model_text(bench)
        parts += reservation_text(diagnosis, bench)
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
            f"{capitalized(names)} of the base model {verb} left out, but every sensor needs "
            f"{them}: most of the error comes from that. Put back {names}."
        )
    ]


def not_confirmed(bench: Bench) -> list[str]:
    """That data held out speak against the newest term, or that it could not be checked."""
    # one of several that were added together may well make things worse alone
    newest, together = bench.ladder[-1].added, {one.term for one in bench.found}
    if newest is None or newest in together or bench.confirmed():
        return []
    added = f"{capitalized(newest)} was added, but"
    if bench.fit.rms_held_out is None:
        return [f"{added} these data are too few to leave any out and check it."]
    return [f"{added} {why_not_confirmed(bench)}. Take it out again."]


def _complete(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    if diagnosis.base_left_out:
        return [f"The error is {beside_noise(bench)}."]
    where = (
        ""
        if differing_in_new_poses(diagnosis) is None
        else " for the poses of the fit, not for the new ones"
    )
    return [f"The model is complete{where}: {beside_noise(bench)}.", *repeats_not_measured(bench)]


def _missing(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    terms = [term for members in diagnosis.opinion.terms for term in members]
    sentences = [sentence for term in terms for sentence in effect_text(diagnosis, bench, term)]
    return sentences + _disturbed_beside(diagnosis) + _fall(diagnosis, bench)


def _ambiguous(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """The candidates, whether it matters which it is, and what would decide."""
    opinion = diagnosis.opinion
    choice = "; and ".join(listed(members, "or") for members in opinion.terms)
    kinds = " and ".join(FAMILIES.get(name, name) for name in dict.fromkeys(opinion.families))
    # of a family's, one effect before two: pairs may be many
    plain = sorted(opinion.explanations, key=len) if opinion.together else opinion.explanations
    several = "; ".join(" with ".join(terms) for terms in plain[:LISTED_EXPLANATIONS])
    if opinion.together:
        parts = [
            (
                f"The {bench.sensor} shows {kinds}, which has several explanations that these data "
                f"cannot separate: {several}."
            )
        ]
    elif opinion.families:
        parts = [f"The {bench.sensor} shows {kinds}: {choice}. These data cannot decide which."]
    else:
        parts = [
            (
                f"The {bench.sensor}'s misfit has several explanations that these data cannot "
                f"separate: {several}."
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
    opinion = diagnosis.opinion
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
    return f"{members[0]} (probability {share} %)" if len(members) == 1 else listed(members, "or")


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
    rows = [row for row in map(table.first_row, diagnosis.opinion.holds) if table.moving[row]]
    return places + [table.place(row).partition(",")[0] for row in rows]


def _disturbed_beside(diagnosis: Diagnosis) -> list[str]:
    """That a part disagrees with all the rest beside what is named."""
    places = _disturbed_places(diagnosis)
    if not places:
        return []
    verb, them = ("disagree", "them") if len(places) > 1 else ("disagrees", "it")
    also = f"{capitalized(listed(places))} {verb} with all the rest beside this"
    return [f"{also}: measure {them} again; nothing has been deleted."]


def _disturbed(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    places = _disturbed_places(diagnosis)
    verb, them = ("explain", "them") if len(places) > 1 else ("explains", "it")
    what = "the device moved, or the sensor changed"
    if only_headings_differ(bench.rows, diagnosis.opinion.holds):
        what = (
            f"gravity closes {them} and the field does not, so that the field turned about the "
            f"vertical meanwhile, or the gyroscope read {them} wrongly"
        )
    advice = f"Measure {them} again; nothing has been deleted."
    if spans := spans_to_leave_out(diagnosis):
        said = listed([f"{start:.1f} to {end:.1f} s" for start, end in spans])
        advice = (
            f"Other holds in the same pose agree with the rest: fit the recording without {said}. "
            "Nothing has been deleted."
        )
    return [
        (
            f"{capitalized(listed(places) or 'one hold')} {verb} the misfit better than any effect "
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
        f"{what}. The {bench.sensor}'s error now is {beside_noise(bench)}."
    )
    choice = "; and ".join(listed(members, "or") for members in diagnosis.opinion.terms)
    return [first, f"The misfit looks like {choice}."] if choice else [first]


def _insufficient(diagnosis: Diagnosis) -> list[str]:
    why = f"the {diagnosis.sensor}'s data are too few for this model: {diagnosis.lacking}"
    refused = of_kind([diagnosis.lacking], NoticeKind.NOT_CALIBRATED)
    sentences = [f"{capitalized(refused[0] if refused else why)}."]
    fit = None if diagnosis.bench is None else diagnosis.bench.fit
    if fit is not None and fit.unit == "rad" and fit.met_exactly:
        sentences.append("Nothing is left over to check the other parameters by.")
    elif fit is not None:
        what = "all other parameters of " if fit.not_determined else ""
        unknown = {one.name for one in fit.terms if fit.size_covariance is None}
        known = [one for one in fit.model if one not in unknown]
        sentences.append(f"These data determine {what}{', '.join(known)}.")
    # more data of the same kind would clip as well, and show as little of a dead axis
    dead = diagnosis.warned(NoticeKind.DEAD)[:1]
    clipped = NoticeKind.CLIPPED, NoticeKind.CLIPPED_ROTATIONS, NoticeKind.CLIPPED_HOLDS
    return [*dead, *sentences, *diagnosis.warned(*clipped)]


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
    opinion, together = diagnosis.opinion, diagnosis.findings and diagnosis.findings.together
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
    angle = quantity(float(np.radians(apart[most])), "rad")
    # of the first model: with each effect that the poses hardly show, the later ones have more
    first = bench.ladder[0]
    noise = first.floor_fitted if first.floor is None else first.floor
    if apart[most] <= np.degrees((noise or 0.0) / bench.measured.gravity):
        among = "among" if known[2:] else "between"
        names = listed([one.effect.name for one in known])
        return [
            (
                f"At 1 g and below, the choice {among} {names} does not matter: it changes the up "
                f"direction by {angle}, within the noise. It can matter at 2 g and more."
            )
        ]
    names = listed([one.effect.name for one in most])
    change = f"changes the up direction by {angle} rms"
    return [f"The choice between {names} {change}, so it matters at 1 g too."]


def beyond_these(kind: str, *, turning: bool) -> str:
    """What may separate effects of this kind where no pose, or no rotation, of a hand does."""
    return RATE_TABLE if turning and kind == "orientation" else BEYOND[kind]


def would_decide(one: Apart, kind: str) -> str:
    """What separates two effects of this kind, or what may where nothing does that was tried."""
    beyond = beyond_these(kind, turning=one.turning)
    pair = f"{one.first} from {one.second}"
    if one.never:
        what = "rotation" if one.turning else "still pose at 1 g"
        return f"No {what} tried here separates {pair}; {beyond} may."
    before = (
        "at no size"
        if not np.isfinite(one.before)
        else f"from {size_with_unit(one.before, one.unit)} on"
    )
    more = f"{one.things}, which the bench lists,"
    after, here = (
        size_with_unit(one.after, one.unit),
        f"it is about {size_with_unit(one.size, one.unit)} here",
    )
    if one.enough:
        return (
            f"These data separate {pair} {before}; {more} would separate them from {after} on, "
            f"and {here}."
        )
    what = "Rotations" if one.turning else "Still poses at 1 g"
    return (
        f"{what} hardly separate {pair}: these data do {before}, {more} from {after} on, and "
        f"{here}. {capitalized(beyond)} may."
    )
