"""Adding without being asked: what the evidence carries and data held out confirm, and no more."""

from dataclasses import replace

from imucal_wizard.bench.labels import Terms
from imucal_wizard.bench.lacking import lacking_base
from imucal_wizard.bench.session import Bench, Findings
from imucal_wizard.bench.verdict import Opinion, Verdict

MOST_ADDED = 4
"""Rounds of adding without being asked; a sensor that lacks more has another problem."""
ALIKE = 0.03
"""What is left, as a share of what was taken away, below which a name stands although more than
noise is left: the two effects of the catalogue that are most alike leave that much of each other
(1 − 0.986²). More of it, and something else was given the name of what it resembles."""


def add_by_itself(bench: Bench) -> Findings:
    """Add what the evidence carries and data held out confirm; stop by itself.

    Parts of the base that were left out come first: what they leave looks like any effect. So does
    a part that the data do not carry; then nothing is added.

    Returns:
        The findings that led to the last step: those of the model before it where something was
        added and nothing is left to say, so that the verdict names what was missing.
    """
    _complete_base(bench)
    below = len(bench.ladder)
    said = bench.look()
    carried = bench.fit.base == bench.whole and not lacking_base(bench)
    for _ in range(MOST_ADDED if carried else 0):
        found = bench.look()
        named = found.opinion.terms
        if found.opinion.verdict not in (Verdict.MISSING, Verdict.AMBIGUOUS) or not named:
            break
        added = _try(bench, named)
        if not added:
            break
        said = replace(found, opinion=_proven(found.opinion, added))
    last = bench.look()
    if last.opinion.verdict is Verdict.COMPLETE:
        return said
    if last.opinion.verdict is Verdict.UNEXPLAINED and _resembles_only(bench, below):
        return _withdrawn(bench, below)
    return last


def _complete_base(bench: Bench) -> None:
    """Put back what was left out of the base, where data held out are for it."""
    for name in bench.whole:
        if name not in bench.fit.base:
            bench.add(name)
            if not bench.confirmed():
                bench.undo()


def _try(bench: Bench, families: tuple[Terms, ...]) -> Terms:
    """Add the plainest likely member of each family; take all back when it is not confirmed.

    Of several, one alone is tried first. They are named by a model that is linear in what is left;
    where that is large, its square looks like an effect of its own until the first one is added.

    Returns:
        What was added.
    """
    order = [effect.name for effect in bench.catalogue]
    chosen = tuple(min(members, key=order.index) for members in families)
    near = {name: bench.likeliest_variant(name) for name in chosen}
    alone = [(name,) for name in chosen] if len(chosen) > 1 else []
    for names in (*alone, chosen):
        for name in names:
            bench.add(name, near=near[name])
        enough = names == chosen or bench.look().opinion.verdict is Verdict.COMPLETE
        if bench.confirmed(len(names)) and enough:
            return names
        for _ in names:
            bench.undo()
    return ()


def _proven(opinion: Opinion, added: Terms) -> Opinion:
    """The opinion that led to adding, with what the deed has shown: what was added comes first."""
    kept = tuple(
        one for one in zip(opinion.families, opinion.terms, strict=True) if {*added} & {*one[1]}
    )
    proven = tuple(sorted(added))
    others = tuple(one for one in opinion.explanations if one != proven)
    return replace(
        opinion,
        families=tuple(family for family, _ in kept),
        terms=tuple(members for _, members in kept),
        explanations=(proven, *others),
    )


def _resembles_only(bench: Bench, below: int) -> bool:
    """Whether too much is left for the names that were given.

    Args:
        bench: with the effects added.
        below: rungs of the ladder before any was.
    """
    if len(bench.ladder) <= below:
        return False
    first, last = bench.ladder[below - 1], bench.ladder[-1]
    noise = bench.fit.fit.floor or 0.0
    left = max(last.rms_fitted**2 - noise**2, 0.0)
    return left > ALIKE * (first.rms_fitted**2 - last.rms_fitted**2)


def _withdrawn(bench: Bench, below: int) -> Findings:
    """Take back all that was added; what it was taken for is not said of the model without it."""
    while len(bench.ladder) > below:
        bench.undo()
    found = bench.look()
    nameless = replace(
        found.opinion, verdict=Verdict.UNEXPLAINED, families=(), terms=(), explanations=()
    )
    return replace(found, opinion=nameless)
