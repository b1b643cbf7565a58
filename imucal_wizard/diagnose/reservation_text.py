"""What limits a verdict, in sentences: slow noise, repeats, too few data, new poses that differ."""

import numpy as np

from imucal_wizard.core.directions import SAME_DIRECTION, unit_vectors
from imucal_wizard.core.notices import NoticeKind
from imucal_wizard.core.quantities import as_sentence, listed, number, quantity
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.effect_text import sizes_text
from imucal_wizard.diagnose.free_curves import shape_of
from imucal_wizard.diagnose.residuals import beyond_bounds
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.distributions import exceeded
from imucal_wizard.estimate.held_out import items_of
from imucal_wizard.estimate.lack_of_fit import TEST_LEVEL
from imucal_wizard.estimate.repeatability import within_freedom
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.effects.earth_rate import EarthRate

TOO_FEW_RATIO = 3.0
"""An error held out of so many times the fitted one comes from too few data: with twice as many
equations as unknowns the ratio is about two."""
CHANGED_RATIO = 3.0
"""New poses with so many times the error held out disagree with it: in four poses chance makes
twice."""
EARTH_SHOWS = 0.5
"""Of the noise: what is less makes an error larger by less than an eighth."""
_NOTHING_KNOWN_IS_MISSING = (Verdict.COMPLETE, Verdict.UNEXPLAINED)
"""Verdicts in which no effect is missing that would spoil the repeats: no pose is held again
exactly alike, so that a missing effect makes repeats differ, too."""
_WRONG_HOLDS = (NoticeKind.CLIPPED_HOLDS, NoticeKind.STUCK_HOLDS)
"""Warnings about holds that are left out because their readings are not the sensor's."""


def reservation_text(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """What limits the verdict, and what the user did that the data do not support."""
    floors, sentences = bench.ladder[-1].floors, [bench.measured.assumption, _of_earth(bench)]
    found = floors.repeats
    if (
        found is not None
        and not found.repeatable
        and diagnosis.verdict in _NOTHING_KNOWN_IS_MISSING
    ):
        repeats, within = quantity(found.rms, floors.unit), floors.within_text
        if not bench.measured.at_rest:
            where = f"{repeats} from one time to another, {within} within each"
            sentences.append(
                f"The same direction does not repeat: {where}. The field changes from place to "
                "place or in time, the axes are read at different times, or the error differs "
                "between directions that are nearly alike."
            )
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
    lack = diagnosis.opinion.lack
    alone = diagnosis.verdict is Verdict.COMPLETE and lack.p < TEST_LEVEL
    if alone and found is not None and found.repeatable:
        visits = "poses" if bench.measured.at_rest else "directions"
        sentences.append(
            f"What is left is {number(lack.ratio, 2)} times what the noise within each hold makes; "
            f"the model counts as complete because repeated {visits} differ by "
            f"{quantity(found.rms, floors.unit)}, which few repeats tell. An error of the sensor "
            "as small as that may be hidden: repeat more of them."
        )
    fitted, held_out = bench.fit.rms_fitted, bench.fit.rms_held_out
    above_noise = held_out is not None and held_out > (bench.fit.floor or 0.0)
    if above_noise and held_out is not None and held_out > TOO_FEW_RATIO * fitted > 0.0:
        sentences.append(
            f"These {bench.measured.left_out} are too few to predict one that is left out: more of "
            "them lower the held-out error."
        )
    sentences += _slow_noise(diagnosis, bench)
    sentences += _not_shown(bench)
    sentences += _others_as_well(diagnosis, bench)
    sentences += map(as_sentence, bench.refused)
    sentences += diagnosis.warned(*_WRONG_HOLDS)
    return [one for one in sentences if one] + _new_poses(diagnosis)


def _slow_noise(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """What slow noise that long holds show, or do not exclude, has to do with the verdict."""
    floors, lack = bench.ladder[-1].floors, diagnosis.opinion.lack
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


def _not_shown(bench: Bench) -> list[str]:
    """That sizes of a term that the user added are no larger than noise makes them."""
    fit, found = bench.fit, {one.term for one in bench.found}
    ends, covariance, said = np.cumsum([0, *map(len, fit.sizes)]), fit.size_covariance, []
    for term, sizes, first in zip(fit.terms, fit.sizes, ends, strict=False):
        if covariance is None or term.effect.free or term.name in found:
            continue
        own = slice(int(first), int(first) + len(sizes))
        squares = float(sizes @ np.linalg.pinv(covariance[own, own]) @ sizes) / len(sizes)
        freedom = bench.fit.degrees_of_freedom or 1
        chance = exceeded(squares, len(sizes), freedom)
        # the best of so many settings: each may do as well by chance
        settings = term.effect.variants(bench.measured.circumstances)
        tried = 1 if term.variant is None else len(settings)
        if chance * tried > TEST_LEVEL:
            errors = np.sqrt(np.diag(covariance[own, own]))
            shown = sizes_text(term.effect, fit.sensor, sizes, errors)
            text = f"These data do not show {term.name} ({shown}): noise alone may make sizes like "
            text += f"these{f', at the likeliest of {tried} settings' if tried > 1 else ''}."
            # data held out that speak against it say so by themselves
            if bench.ladder[-1].added != term.name or bench.confirmed():
                text += " Take it out, unless other measurements show it."
            said.append(text)
    return said


def _others_as_well(diagnosis: Diagnosis, bench: Bench) -> list[str]:
    """That these data do not decide for a term that the user added, and what it may be as well."""
    found, said = {one.term for one in bench.found}, []
    if diagnosis.verdict is not Verdict.COMPLETE:
        return []
    for term in bench.fit.terms:
        if term.effect.free or term.name in found:
            continue
        opinion = bench.opinion_without(term.name)
        if opinion is None or opinion.verdict is not Verdict.AMBIGUOUS:
            continue
        others = [" with ".join(one) for one in opinion.explanations if term.name not in one]
        if others:
            said.append(
                f"These data do not decide for {term.name}: {listed(others, 'or')} may be the "
                "cause as well."
            )
    return said


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


def curves_of_model_text(bench: Bench) -> list[str]:
    """What the free curves of the model show, and what is not known of them."""
    shapes = [shape_of(bench.fit, one.name, ()) for one in bench.fit.terms if one.effect.free]
    return [
        f"In the model now: {one.term}, the error of {one.axis} over {one.over}: {one.words()}; "
        f"{one.unknown}."
        for one in shapes
        if one is not None
    ]


def differing_in_new_poses(diagnosis: Diagnosis) -> SensorFit | None:
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
    fit = differing_in_new_poses(diagnosis)
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


def repeats_not_measured(bench: Bench) -> list[str]:
    """That no pose was repeated; a field that comes again is at another place of the room."""
    if not bench.measured.at_rest or bench.ladder[-1].floors.repeats is not None:
        return []
    return ["No pose was held twice, so repeatability was not measured."]
