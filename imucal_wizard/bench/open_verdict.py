"""The verdict that data do not decide: what it may be, whether it matters, what would decide."""

import numpy as np

from imucal_wizard.bench.amounts import amount
from imucal_wizard.bench.at_one_g import difference_at_one_g
from imucal_wizard.bench.phrases import capital, degrees, fall, named
from imucal_wizard.bench.separating import Apart, explained, rivals
from imucal_wizard.bench.session import Bench
from imucal_wizard.bench.statement import Statement
from imucal_wizard.effects.effect import ACCELEROMETER

BEYOND = {
    "orientation": "forces well over 1 g",
    "time": "a session in which the temperature rises and falls",
    "hold": "holds taken in another order and on another support",
}
"""What decides where still poses do not."""
FASTER = "faster turns, as a rate table makes them,"
FAMILIES = {
    "even-order": "an error that is the same to either side",
    "odd-order": "an error that grows to both sides alike",
    "slow-bias": "a bias that changes slowly",
}


def ambiguous(said: Statement) -> list[str]:
    """What it may be, whether it matters, and what would decide."""
    bench, findings = said.bench, said.findings
    if bench is None or findings is None:
        return []
    opinion = findings.opinion
    if said.waiting:
        seen = " with ".join(_or(members) for members in opinion.terms)
        return [f"What is left looks like {seen}."] if seen else []
    if opinion.families:
        kinds = " and ".join(FAMILIES.get(name, name) for name in opinion.families)
        first = f"The {said.sensor} shows {kinds}"
        choice = "; and ".join(_or(members) for members in opinion.terms)
        parts = [f"{first}: {choice}, and these data cannot tell which."]
    else:
        listed = "; ".join(" with ".join(terms) for terms in opinion.explanations[:4])
        parts = [
            (
                f"The {said.sensor}'s misfit has several explanations that these data cannot tell "
                f"apart: {listed}."
            )
        ]
    for term in said.added:
        parts += named(said, bench, term)
    parts += fall(said, bench) if said.added or opinion.families else []
    return parts + _matters(said, bench) + _decides(said, bench)


def _or(members: tuple[str, ...]) -> str:
    return members[0] if len(members) == 1 else f"{', '.join(members[:-1])} or {members[-1]}"


def _matters(said: Statement, bench: Bench) -> list[str]:
    """Whether at 1 g it matters which of the two likeliest it is."""
    if bench.sensor != ACCELEROMETER or said.findings is None:
        return []
    pair = [explained(bench, said.findings, term) for term in rivals(said.findings)[:2]]
    known = [one for one in pair if one is not None and one.effect.kind == "orientation"]
    if len(known) < 2:
        return []
    angle = difference_at_one_g(known[0], known[1])
    noise = np.degrees(bench.ladder[-1].floor / bench.measured.gravity)
    names = " or ".join(one.effect.name for one in known)
    if angle <= noise:
        return [
            (
                f"For use at 1 g and below it does not matter whether it is {names}: up differs by "
                f"{degrees(angle)}, within the noise. It matters at 2 g and more."
            )
        ]
    return [f"Whether it is {names} turns up by {degrees(angle)} rms: it matters at 1 g too."]


def _decides(said: Statement, bench: Bench) -> list[str]:
    """What would tell the explanations apart."""
    kinds = {effect.name: effect.kind for effect in bench.catalogue}
    return [
        _would_decide(one, FASTER if one.turning else BEYOND[kinds[one.first]])
        for one in said.advice.apart
        if one.never or one.poses
    ]


def _would_decide(one: Apart, beyond: str) -> str:
    pair = f"{one.first} from {one.second}"
    if one.never:
        what = "turn" if one.turning else "still pose at 1 g"
        return f"No {what} tells {pair}, whatever their size; {beyond} would."
    before = "at no size" if not np.isfinite(one.before) else f"from {amount(one.before, one.unit)}"
    poses = f"{one.things}, listed as the next ones,"
    here = f"it is about {amount(one.size, one.unit)} here"
    after = amount(one.after, one.unit)
    if one.enough:
        return f"These data tell {pair} {before} on; {poses} would from {after} on, and {here}."
    what = "Turns" if one.turning else "Still poses at 1 g"
    return (
        f"{what} hardly tell {pair}: these data do {before} on, {poses} from {after} "
        f"on, and {here}. {capital(beyond)} would."
    )
