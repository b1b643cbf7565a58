"""What is to be said of a model, in plain words."""

from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.effects.effect import Effect
from imucal_wizard.procedure.poses import DIRECTIONS, POSE_TOLERANCE_DEG, nearest
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.report_rows import shown
from imucal_wizard.tui.text import signed

_FAMILIES = {
    "even-order": "bends the same way for a push from either side",
    "odd-order": "bends both ends of the scale alike",
    "slow-bias": "moves the zero slowly during the session",
}


def says(sight: Sight) -> tuple[str, str]:
    """A sign's style (``good``, ``warn``, ``accent``) and the sentences."""
    if sight.missing_base:
        gone = " and ".join(sight.missing_base)
        return "warn", (
            f"{gone[0].upper()}{gone[1:]} of the base model {_are(sight.missing_base)} left out, "
            "and every sensor needs it: what is left comes from that first. Put it back (enter) "
            "before you believe another name."
        )
    opinion = sight.findings.opinion
    left = shown(sight.fit.rms_fitted, sight.fit.fit.unit)
    floor = shown(sight.ladder[-1].floor, sight.fit.fit.unit)
    match opinion.verdict:
        case Verdict.COMPLETE:
            return "good", (
                f"Nothing is missing that these data could show: {left} is left, and noise alone "
                f"makes {floor}."
            )
        case Verdict.MISSING:
            names = " and ".join(_named(sight, members[0]) for members in opinion.terms)
            return "accent", (
                f"Something is missing: {names}. No other explanation of what is left ({left}; "
                f"noise makes {floor}) holds as well. enter adds it; l tells what it is."
            )
        case Verdict.AMBIGUOUS:
            return "warn", _ambiguous(sight)
        case Verdict.DISTURBED:
            holds = ", ".join(hold_words(sight, hold) for hold in opinion.holds)
            return "warn", (
                f"No effect, but {holds}: it alone does not fit, somebody may have touched it. "
                "Measure it again."
            )
        case Verdict.UNEXPLAINED:
            return "warn", (
                f"More than noise is left ({left}; noise makes {floor}), and no effect known here "
                "explains it. Do not believe a name: measure more poses, or try a formula (e)."
            )
        case _:
            return "warn", "Too few directions for this model: measure more poses."


def _are(terms: tuple[str, ...]) -> str:
    return "is" if len(terms) == 1 else "are"


def _ambiguous(sight: Sight) -> str:
    opinion = sight.findings.opinion
    for family, members in zip(opinion.families, opinion.terms, strict=True):
        if len(members) > 1:
            what = _FAMILIES.get(family, "explains what is left")
            return (
                f"Something is missing that {what}: {' or '.join(members)}. These data cannot tell "
                "which of them. n shows the poses that could."
            )
    each = "; or ".join(" with ".join(terms) for terms in opinion.explanations[:4])
    return (
        f"Something is missing, and these data cannot tell what: {each}. n shows the poses that "
        "could."
    )


def _named(sight: Sight, term: str) -> str:
    title = title_of(sight.catalogue, term)
    return f"{term} ({title})" if title and title != term else term


def title_of(catalogue: tuple[Effect, ...], term: str) -> str:
    """The plain name of an effect; "" for what is none."""
    return next((effect.title for effect in catalogue if effect.name == term), "")


def pose_at(sight: Sight, hold: int) -> str:
    """The pose of a hold by its direction, or its direction."""
    known = sight.measured.circumstances
    up = known.force[_row(sight, hold)]
    name = nearest(up, DIRECTIONS, POSE_TOLERANCE_DEG)
    return signed(name) + " up" if name else "between poses"


def hold_words(sight: Sight, hold: int) -> str:
    """``pose 7 (+x−y up)``; of a gyroscope it may be a turn."""
    if isinstance(sight.measured, TurnData):
        return f"the pose or turn number {hold + 1}"
    return f"pose {hold + 1} ({pose_at(sight, hold)})"


def _row(sight: Sight, hold: int) -> int:
    if isinstance(sight.measured, TurnData):
        return int(sight.measured.still_rows.searchsorted(hold))
    return hold
