"""The diagnosis of a session: each sensor in its order, with effects added where that is asked."""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace

import numpy as np

from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.core.notices import UNLIKE_HOLDS
from imucal_wizard.core.statistics import complement, root_mean_square
from imucal_wizard.diagnose.bench import Bench, BenchFindings, falls
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.change_text import reasons_of
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.next_poses import disturbed_parts, first_requests, next_requests
from imucal_wizard.diagnose.verdict import (
    MAX_SHARE_LEFT_BY_NAME,
    MAX_SHARE_LEFT_BY_PROBABLE,
    Opinion,
    Terms,
    Verdict,
    nameless,
    share_left,
    unconfirmed,
)
from imucal_wizard.diagnose.verdict_text import verdict_text
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.model.effect import SENSORS

MAX_ROUNDS_OF_ADDING = 4
"""Rounds of adding without being asked; a sensor that lacks more has another problem."""
MAX_CANCELLED = 3.0
"""Rms of one of several effects in the readings over that of all together, above which they undo
one another: effects that act by themselves leave about the root of the sum of their squares."""


def add_by_itself(bench: Bench) -> BenchFindings:
    """Add what the evidence carries and data held out confirm; stop by itself.

    Parts of the base that were left out come first: what they leave looks like any effect. So does
    a part that the data do not determine; then nothing is added.

    Returns:
        The findings that led to the last step: those of the model before it where something was
        added and only noise is left, so that they name what was missing.
    """
    _complete_base(bench)
    below = len(bench.ladder)
    before = said = bench.look()
    carried = bench.fit.base == bench.whole and not bench.undetermined
    last = before
    for _ in range(MAX_ROUNDS_OF_ADDING if carried else 0):
        named = last.opinion.terms
        if last.opinion.verdict not in (Verdict.MISSING, Verdict.AMBIGUOUS) or not named:
            break
        added = _try(bench, last.opinion)
        if not added:
            # what data held out do not confirm is not missing for certain
            last = bench.with_curves(replace(last, opinion=unconfirmed(last.opinion)))
            break
        said = replace(last, opinion=_proven(last.opinion, added, bench))
        bench.keep(reasons_of(bench, added, last.opinion))
        last = bench.look()
    if len(bench.ladder) > below and _cancel(bench, below):
        return _withdrawn(bench, below, probable=False)
    if last.opinion.shapeless:
        # what was missing is said with the model before; how much is left, with the present one
        left_now = replace(said.opinion, lack=last.opinion.lack)
        complete = last.opinion.verdict is Verdict.COMPLETE
        return replace(said, opinion=left_now) if complete else last
    without_name = last.opinion.verdict in (Verdict.UNEXPLAINED, Verdict.NOT_REPEATABLE)
    was, left = before.opinion.lack, last.opinion.lack
    if without_name and len(bench.ladder) > below:
        share = share_left(was, left)
        if share > MAX_SHARE_LEFT_BY_NAME:
            return _withdrawn(bench, below, probable=share < MAX_SHARE_LEFT_BY_PROBABLE)
    return last


def _cancel(bench: Bench, below: int) -> bool:
    """Whether effects that were added undo one another: then none of them has the shape wanted.

    Of two that are nearly alike, two large ones make what is left of either by itself: a bow in
    time of a drift and a warm-up.
    """
    found = bench.fit.minimum
    added = {rung.added for rung in bench.ladder[below:]}
    if found is None:
        return False
    columns, values = found.system.columns, found.system.value[found.sizes]
    # what the base takes up of an effect is no part of what it explains
    unseen = complement(columns[:, : found.sizes.start])
    own = unseen.T @ columns[:, found.sizes]
    parts = [
        own[:, group] @ values[group]
        for term, group in zip(found.terms.terms, found.terms.groups, strict=True)
        if term.name in added
    ]
    most = max((root_mean_square(one) for one in parts), default=0.0)
    return len(parts) > 1 and most > MAX_CANCELLED * root_mean_square(np.sum(parts, axis=0))


def _complete_base(bench: Bench) -> None:
    """Put back what was left out of the base, where data held out are for it."""
    for name in bench.whole:
        if name not in bench.fit.base:
            with suppress(DataError):  # the bench keeps why it cannot be fitted
                bench.add(name)
                if not bench.confirmed():
                    bench.undo()


def _try(bench: Bench, opinion: Opinion) -> Terms:
    """Add the plainest likely member of each family; take all back when it is not confirmed.

    Of several, one alone is tried first. They are named by a model that is linear in what is left;
    where that is large, its square looks like an effect of its own until the first one is added.
    Of two effects of one family and one of them alone, the one must leave no more than noise.

    Returns:
        What was added.
    """
    found, where = bench.look(), bench.measured.circumstances
    settled = {one.name for one in bench.catalogue if one.variants(where) != (None,)}
    # a time constant or a moment is looked for beside the others
    chosen = tuple(sorted(bench.plainest(opinion.terms), key=settled.__contains__))
    ways = [*((name,) for name in chosen if len(chosen) > 1), chosen]
    if opinion.together:
        ways = [*ways, opinion.together[0], chosen]
    of_one_family = opinion.twice or bool(opinion.together)
    both = dict(found.hypotheses.likeliest_effects(found.posterior)) if opinion.twice else {}
    for place, names in enumerate(ways):
        below = len(bench.ladder)
        with suppress(DataError):  # what cannot be fitted is not confirmed; the bench keeps why
            for name in names:
                bench.add(name, near=both.get(name) if len(names) > 1 else None)
            enough = place == len(ways) - 1
            if not enough:
                left = bench.look().opinion
                enough = left.shapeless or names in opinion.together
                enough &= left.lack.within_noise or not of_one_family
            if bench.confirmed(len(names)) and enough:
                return (
                    names
                    if bench.look().opinion.lack.within_noise
                    else _beside(bench, names, chosen)
                )
        while len(bench.ladder) > below:
            bench.undo()
    return ()


def _beside(bench: Bench, names: Terms, chosen: Terms) -> Terms:
    """What was added, or all that was chosen, where the error held out is lower with the rest.

    Where one of several effects leaves much, the rest can pass for noise.
    """
    if set(chosen) <= set(names):
        return names
    alone, below = bench.fit.rms_held_out, len(bench.ladder) - len(names)
    for tried in (chosen, names):
        while len(bench.ladder) > below:
            bench.undo()
        with suppress(DataError):
            for name in tried:
                bench.add(name)
            if tried == names or falls(alone, bench.fit.rms_held_out):
                return tried
    return ()


def _proven(opinion: Opinion, added: Terms, bench: Bench) -> Opinion:
    """The opinion that led to adding, with what adding has shown: what was added comes first.

    Where one effect leaves more than noise, two of its family that are likely may act as well.
    """
    family = {one.name: one.family for one in bench.catalogue}
    if len(added) == len(opinion.families) == 1 and not bench.look().opinion.lack.within_noise:
        likely = [one for one in opinion.explanations if len(one) > 1]
        two = [one for one in likely if {family[term] for term in one} == {*opinion.families}]
        together = tuple(dict.fromkeys([*opinion.together, *two]))
        verdict = Verdict.AMBIGUOUS if together else opinion.verdict
        opinion = replace(opinion, verdict=verdict, together=together)
    kept = tuple(
        one for one in zip(opinion.families, opinion.terms, strict=True) if {*added} & {*one[1]}
    )
    proven = tuple(sorted(added))
    others = tuple(one for one in opinion.explanations if one != proven)
    if proven in opinion.together:
        # what the one effect leaves has decided for two; for which, only where no others are likely
        kept = tuple((opinion.families[0], (one,)) for one in proven)
        if len(opinion.together) == 1:
            opinion = replace(opinion, verdict=Verdict.MISSING, together=())
    return replace(
        opinion,
        families=tuple(family for family, _ in kept),
        terms=tuple(members for _, members in kept),
        explanations=(proven, *others),
    )


def _withdrawn(bench: Bench, below: int, *, probable: bool) -> BenchFindings:
    """Take back all that was added, and do not name it; one name alone may be probable."""
    added = tuple(rung.added for rung in bench.ladder[below:] if rung.added is not None)
    while len(bench.ladder) > below:
        bench.undo()
    found = bench.look()
    opinion = replace(
        found.opinion,
        verdict=nameless(found.opinion.lack),
        families=(),
        terms=(),
        explanations=(),
        probable=added if probable and len(added) == 1 and not found.opinion.refuted else (),
    )
    return bench.with_curves(replace(found, opinion=opinion))


def diagnose_benches(
    benches: Benches, added: Mapping[str, Sequence[str]], automatic: bool
) -> tuple[Diagnosis, ...]:
    """The diagnosis of every sensor, the accelerometer first.

    Args:
        benches: the session's.
        added: terms to add first, by sensor.
        automatic: then add what the evidence carries and data held out confirm. A sensor whose
            reference is the accelerometer is given nothing before that is complete.

    Raises:
        UsageError: a term that the sensor does not have.
        DataError: the data cannot show a term that was asked for.
    """
    found = []
    for sensor in SENSORS:
        missing = sensor == SENSORS[0] and not benches.report.on_table
        if missing or sensor in benches.report.rates:
            found.append(_of(benches, sensor, added.get(sensor, ()), automatic))
        elif added.get(sensor):
            raise UsageError(f"there is no {sensor} in this recording to add a term to")
    return tuple(found)


def _of(benches: Benches, sensor: str, added: Sequence[str], automatic: bool) -> Diagnosis:
    """The diagnosis of one sensor; where it has no bench, why."""
    try:
        bench = benches.bench(sensor)
    except DataError as error:
        return insufficient(sensor, str(error), benches.report)
    if bench is None:
        return insufficient(sensor, benches.report.why_not(sensor), benches.report)
    for name in added:
        bench.add(name)
    findings = add_by_itself(bench) if automatic and not benches.waits(sensor) else None
    return diagnosis_of(benches, bench, findings)


def tried_findings(benches: Benches, bench: Bench) -> BenchFindings:
    """The findings of a bench's model; what they call missing is what the bench would add and keep.

    Whether data held out confirm a name, and whether adding it leaves only noise, is known once it
    has been added: it is tried on a copy.
    """
    found = bench.look()
    certain = found.opinion.verdict in (Verdict.MISSING, Verdict.AMBIGUOUS)
    if not certain or benches.waits(bench.sensor):
        return found
    trial = benches.copied().bench(bench.sensor)
    assert trial is not None, "a copy has the same benches"  # noqa: S101 (narrows the type)
    tried = add_by_itself(trial)
    if trial.fit is bench.fit:
        return tried
    every = (*found.opinion.terms, *found.opinion.together)
    named = {name for members in every for name in members}
    kept = tuple(term.name for term in trial.fit.terms if term.name in named)
    if not kept:
        return found
    together = trial.fit_of((*found.fit.model, *kept)) if len(kept) > 1 else None
    return replace(found, opinion=_proven(found.opinion, kept, trial), together=together)


def diagnosis_of(
    benches: Benches, bench: Bench, findings: BenchFindings | None = None
) -> Diagnosis:
    """The diagnosis of one sensor as its bench is now.

    Args:
        benches: the session's.
        bench: that of the sensor.
        findings: those that the verdict is about (see ``add_by_itself``); the present model's when
            left out.
    """
    findings = findings or tried_findings(benches, bench)
    lacking, waiting = bench.undetermined, benches.waits(bench.sensor)
    whole = bench.fit.base == bench.whole
    verdict = _verdict(bench, findings, lacking, waiting, whole)
    if verdict is Verdict.COMPLETE and benches.report.warned(bench.sensor, *UNLIKE_HOLDS):
        # of what does not repeat the means of the holds show only the part that does
        verdict = Verdict.NOT_REPEATABLE
    requests, apart = next_requests(bench, findings, verdict) if whole else ((), ())
    disturbed: tuple[tuple[int, ...], tuple[int, ...], tuple[tuple[float, float], ...]]
    disturbed = (), (), ()
    if verdict in (Verdict.DISTURBED, Verdict.MISSING, Verdict.AMBIGUOUS):
        disturbed = disturbed_parts(bench.rows, findings)
    before = set(findings.fit.model)
    found = Diagnosis(
        sensor=bench.sensor,
        verdict=verdict,
        next_poses=requests,
        apart=apart,
        bench=bench,
        findings=findings,
        present=findings if findings.fit is bench.fit else bench.look(),
        ladder=tuple(bench.ladder),
        added=tuple(term for term in bench.fit.model if term not in before),
        found=bench.found,
        lacking=lacking,
        disturbed_holds=disturbed[0],
        disturbed_rotations=disturbed[1],
        disturbed_stretches=disturbed[2],
        waits_for=_of_accelerometer(benches) if verdict is Verdict.WAITING else None,
        in_reference=benches.hidden_in_reference(bench) if verdict is Verdict.UNEXPLAINED else (),
        report=benches.report,
    )
    return replace(found, says=verdict_text(found))


def _of_accelerometer(benches: Benches) -> Verdict | None:
    """The verdict on the accelerometer's model as it is; None where it has no bench."""
    bench = benches.bench(SENSORS[0])
    return None if bench is None else bench.look().opinion.verdict


def _verdict(
    bench: Bench, findings: BenchFindings, lacking: str, waiting: bool, whole: bool
) -> Verdict:
    """The word for the model at the end.

    What was added is not missing any more; that its family cannot be split is still said.

    While a part of the base is left out nothing is named: what it leaves looks like any effect.
    While the accelerometer is not complete, what it lacks tilts the reference: nothing is the
    gyroscope's for sure, and nothing is known to be missing there.
    """
    if lacking:
        return Verdict.INSUFFICIENT
    if waiting:
        return Verdict.WAITING
    verdict = findings.opinion.verdict
    if findings.fit is not bench.fit:
        last = bench.look().opinion.verdict
        open_ = verdict is Verdict.AMBIGUOUS and last is Verdict.COMPLETE
        verdict = verdict if open_ else last
    return verdict if whole or verdict is Verdict.COMPLETE else Verdict.UNEXPLAINED


def insufficient(sensor: str, reason: str, report: FitReport | None = None) -> Diagnosis:
    """The diagnosis of a sensor whose data determine no model.

    Args:
        sensor: which.
        reason: why, in words.
        report: what was fitted of the other sensors.
    """
    found = Diagnosis(
        sensor,
        Verdict.INSUFFICIENT,
        next_poses=first_requests(sensor),
        lacking=reason,
        report=report,
    )
    return replace(found, says=verdict_text(found))
