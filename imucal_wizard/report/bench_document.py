"""The JSON document of ``bench`` (bench/1)."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from imucal_wizard.core.quantities import finite_or_none
from imucal_wizard.diagnose.bench import Rung
from imucal_wizard.diagnose.curve_shape import CurveShape, rms_size
from imucal_wizard.diagnose.diagnosis import Diagnosis
from imucal_wizard.diagnose.effect_text import seen_from
from imucal_wizard.diagnose.free_curves import shape_of
from imucal_wizard.diagnose.suspects import Suspect
from imucal_wizard.diagnose.verdict import Opinion, Verdict
from imucal_wizard.estimate.result import SensorFit

BENCH_SCHEMA = "imucal-wizard/bench/1"


def bench_document(statements: Sequence[Diagnosis], warnings: Sequence[str] = ()) -> dict[str, Any]:
    """The diagnoses as a document of lists and numbers."""
    return {
        "schema": BENCH_SCHEMA,
        "warnings": list(warnings),
        "sensors": {one.sensor: _sensor(one) for one in statements},
    }


def _sensor(said: Diagnosis) -> dict[str, Any]:
    bench, findings = said.bench, said.findings
    opinion = None if findings is None else findings.opinion
    return {
        "model": [] if bench is None else list(bench.fit.model),
        "unit": None if bench is None else bench.fit.unit,
        "parameters": {} if bench is None else _parameters(bench.fit),
        "degrees_of_freedom": None if bench is None else bench.fit.degrees_of_freedom,
        "ladder": [_rung(one) for one in said.ladder],
        "noise": None if bench is None else _noise(bench.ladder[-1]),
        # the model that suspects, explanations, families, p and closures are about: the one before
        # "added", whose effects they show with their evidence
        "suspects_of": [] if findings is None else list(findings.fit.model),
        "suspects": _suspects(said.suspects, opinion),
        "curves": _curves(said),
        "gyroscope_closure": _closures(opinion),
        "not_tested": _not_tested(said),
        "explanations": [list(terms) for terms in said.explanations],
        "verdict": said.verdict.value,
        "families": [] if opinion is None else list(dict.fromkeys(opinion.families)),
        "added": list(said.added),
        "found": [
            {"term": one.term, "reason": one.reason, "decided_by": one.decided_by}
            for one in said.found
        ],
        "p": None if findings is None else findings.p,
        "disturbed_holds": list(said.disturbed_holds),
        "disturbed_rotations": list(said.disturbed_rotations),
        "disturbed_stretches": [list(one) for one in said.disturbed_stretches],
        "next_poses": [
            {
                "direction": pose.direction.tolist(),
                "why": pose.why,
                "pose": pose.pose,
                "warm": pose.warm,
                "axis": pose.axis or None,
                "turns": pose.turns,
            }
            for pose in said.next_poses
        ],
        "apart": [
            {
                "terms": [one.first, one.second],
                "before": finite_or_none(one.before),
                "after": finite_or_none(one.after),
                "size": finite_or_none(one.size),
                "unit": one.unit,
            }
            for one in said.apart
        ],
        "says": said.says,
    }


def _parameters(fit: SensorFit) -> dict[str, Any]:
    return {
        one.name: {
            "value": finite_or_none(one.value),
            "standard_error": finite_or_none(one.standard_error),
            "unit": one.unit,
        }
        for one in fit.parameters
    }


def _rung(one: Rung) -> dict[str, Any]:
    return {
        "model": list(one.model),
        "added": one.added,
        "rms_fitted": finite_or_none(one.rms_fitted),
        "rms_held_out": finite_or_none(one.rms_held_out),
        "rms_late": finite_or_none(one.rms_late),
        "floor": finite_or_none(one.floor),
        "floor_fitted": finite_or_none(one.floor_fitted),
    }


def _noise(one: Rung) -> dict[str, Any]:
    floors, repeats = one.floors, one.floors.repeats
    return {
        "unit": floors.unit,
        "within_holds": finite_or_none(floors.within),
        "slow": finite_or_none(floors.slow),
        "rounding": finite_or_none(floors.rounding),
        "dithered": floors.dithered,
        "repeats": None if repeats is None else finite_or_none(repeats.rms),
        "repeats_interval": None if repeats is None else [*map(finite_or_none, repeats.interval)],
        "degrees_of_freedom": 0 if repeats is None else repeats.freedom,
        "p_repeatable": None if repeats is None else finite_or_none(repeats.p),
        "repeatable": None if repeats is None else repeats.repeatable,
    }


def _closures(opinion: Opinion | None) -> dict[str, Any] | None:
    """What the gyroscope says of the explanations: error held out, and logarithm of the evidence.

    None where it was not asked.
    """
    if opinion is None or opinion.heard is None:
        return None
    now = opinion.heard.now
    return {
        "now": finite_or_none(now.closure),
        "with": [
            {
                "terms": list(terms),
                "closure": finite_or_none(one.closure),
                "log_evidence": finite_or_none(one.log_evidence - now.log_evidence),
            }
            for terms, one in opinion.heard.with_terms.items()
        ],
        "decided": list(opinion.decided),
    }


def _suspects(suspects: Sequence[Suspect], opinion: Opinion | None) -> list[dict[str, Any]]:
    """The effects; a disturbed hold, which competes with them, is in ``disturbed_holds``."""
    return [_suspect(one, opinion) for one in suspects if one.candidate is not None]


def _suspect(one: Suspect, opinion: Opinion | None) -> dict[str, Any]:
    named: set[str] = set()
    if opinion is not None and opinion.verdict is Verdict.MISSING:
        named = {term for members in opinion.terms for term in members}
    closures = None if opinion is None else opinion.closures((one.term,))
    trial, candidate = one.trial, one.candidate
    sizes = np.zeros(0) if trial is None else trial.size
    errors = np.zeros(0) if trial is None else trial.standard_error
    names = [] if candidate is None else list(candidate.names)
    if candidate is not None and candidate.effect.free:  # one size, that of the curve
        spread = None if trial is None else trial.covariance
        sizes, errors = (np.array([one]) for one in rms_size(sizes, errors, spread))
        names = [names[0][:1]]
    return {
        "term": one.term,
        "p": finite_or_none(one.p),
        "parameters": names,
        "size": [finite_or_none(value) for value in sizes],
        "standard_error": [finite_or_none(value) for value in errors],
        "unit": "" if candidate is None else candidate.unit,
        "variant": None if candidate is None else candidate.variant,
        "rms_after": None if trial is None else finite_or_none(trial.rms_fitted),
        "rms_held_out_after": None if trial is None else finite_or_none(trial.rms_held_out),
        "detectable": finite_or_none(one.detectable_on_any_axis),
        "nameable": finite_or_none(one.nameable_on_any_axis),
        "detectable_interval": one.detectable_interval,
        "nameable_interval": one.nameable_interval,
        "detectable_by_parameter": [finite_or_none(value) for value in one.detectable],
        "nameable_by_parameter": [finite_or_none(value) for value in one.nameable],
        "sizes_at": None if one.sized is None else one.sized.variant,
        "seen_from": seen_from(one),
        "told_apart": not one.like or not named.isdisjoint({one.term, *one.like}),
        "like": list(one.like),
        "log_odds": finite_or_none(one.log_odds),
        "gyroscope_closure": None if closures is None else [*map(finite_or_none, closures)],
    }


def _curves(said: Diagnosis) -> list[dict[str, Any]]:
    """The free curves of the model and those among the suspects."""
    if said.bench is None:
        return []
    fit, free = said.bench.fit, [one.name for one in said.bench.fit.terms if one.effect.free]
    free += [one.term for one in said.suspects if one.candidate and one.candidate.effect.free]
    shapes = [shape_of(fit, term, said.suspects) for term in dict.fromkeys(free)]
    return [_curve(one, one.term in fit.model) for one in shapes if one is not None]


def _curve(one: CurveShape, in_model: bool) -> dict[str, Any]:
    steep = one.steep
    return {
        "term": one.term,
        "in_model": in_model,
        "axis": one.axis,
        "against": one.against,
        "x_unit": one.x_unit,
        "unit": one.unit,
        "span": finite_or_none(one.span),
        "span_standard_error": finite_or_none(one.span_error),
        "steep": None
        if steep is None
        else {
            "at": finite_or_none(steep.at),
            "width": finite_or_none(steep.width),
            "width_interval": list(steep.width_interval),
            "between": list(steep.between),
            "holds_inside": steep.inside,
            "bump": steep.bump,
            "sharp": steep.sharp,
        },
        "says": f"{one.words()}; {one.unknown}",
        "x": one.x.tolist(),
        "y": one.y.tolist(),
        "standard_error": one.standard_error.tolist(),
    }


def _not_tested(said: Diagnosis) -> dict[str, str]:
    """The effects that these data cannot show, and why."""
    bench = said.bench
    if bench is None:
        return {}
    known = set(bench.fit.model)
    found = {one.name: bench.lacking(one) for one in bench.catalogue if one.name not in known}
    return {name: why for name, why in found.items() if why is not None}
