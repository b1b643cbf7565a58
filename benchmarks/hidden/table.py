"""What is counted over many recordings of one kind, and how it is printed."""

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np

from benchmarks.hidden.scenarios import FAMILY, Scenario
from benchmarks.hidden.trialled import Trialled
from benchmarks.measure import Wanted
from imucal_wizard.diagnose.verdict import Opinion, Verdict
from imucal_wizard.simulate.hidden import Hidden

COLUMNS = (
    *("named", "family", "part", "listed", "cannot"),
    *("unexpl", "disturb", "repeat", "complete", "WRONG"),
)
"""``named``: the effect itself, alone. ``family``: all hidden families and no other, ``named``
among them. ``part``: one of two. ``listed``: no name, but the truth among the explanations.
``cannot``: no name and the truth not listed. ``WRONG``: a family that is not hidden.
``repeat``: not repeatable. ``seen``: p ≤ 0.01. ``inside``: the size, once added, ± its 95 %
interval holds the truth."""


class Answered(Protocol):
    """What was hidden in a recording, and what was said of it."""

    @property
    def hidden(self) -> tuple[Hidden, ...]:
        """The effects."""

    @property
    def families(self) -> tuple[str, ...]:
        """Theirs, sorted."""

    @property
    def opinion(self) -> Opinion:
        """What the program says."""


def outcome(one: Answered) -> str:
    """The column that a recording belongs to; ``named`` counts for ``family`` too."""
    said = one.opinion
    if set(said.families) - set(one.families):
        return "WRONG"
    if said.families and said.families == one.families:
        terms = {hidden.term for hidden in one.hidden}
        return "named" if {t for own in said.terms for t in own} == terms else "family"
    if said.families:
        return "part"
    if said.verdict is Verdict.AMBIGUOUS:
        listed = [tuple(sorted({FAMILY[t] for t in terms})) for terms in said.explanations]
        return "listed" if one.families and one.families in listed else "cannot"
    words = {
        Verdict.UNEXPLAINED: "unexpl",
        Verdict.DISTURBED: "disturb",
        Verdict.NOT_REPEATABLE: "repeat",
    }
    return words.get(said.verdict, "complete")


def judge(
    wanted: Wanted,
    kind: str,
    rows: Mapping[str, Sequence[Answered]],
    promised: Callable[[Answered], bool] = lambda _one: True,
) -> None:
    """What of a table is not reached: single effects at 1x named, nothing named wrongly.

    Args:
        wanted: where it is kept.
        kind: of recordings.
        rows: recordings by the name of their row.
        promised: whether the program calls the effect of a recording nameable at any size.
    """
    single = [
        one
        for name, own in rows.items()
        for one in own
        if name.endswith(" 1x") and len(one.hidden) == 1 and promised(one)
    ]
    right = sum(outcome(one) in ("named", "family") for one in single)
    wanted.share(f"{kind}: right family at 1x", right, len(single), 90.0)
    every = [one for own in rows.values() for one in own]
    wrong = sum(outcome(one) == "WRONG" for one in every)
    wanted.share(f"{kind}: wrong names", wrong, len(every), 0.0, 1.0)


def heading(design: str, colour: str, count: int) -> str:
    """The lines above the table."""
    columns = "".join(f"{name:>9}" for name in COLUMNS)
    return (
        f"\n{design} poses, {colour} noise, {count} recordings each; per cent of them\n"
        f"{'hidden':<40}{'size':>16}{columns}{'seen':>6}{'inside':>8}"
        f"{'held out: before → linear / fitted, mg':>42}"
    )


def line(scenario: Scenario, trials: Sequence[Trialled]) -> str:
    """One row."""
    counts = Counter(outcome(one) for one in trials)
    counts["family"] += counts["named"]
    share = 100.0 / len(trials)
    cells = "".join(f"{share * counts[name]:9.1f}" for name in COLUMNS)
    seen = share * sum(one.p <= 0.01 for one in trials)
    errors = np.array([(one.before, one.linear, one.after) for one in trials])
    sure = [abs(one.sure) < 1.0 for one in trials if one.sure is not None]
    inside = f"{100.0 * np.mean(sure):.0f}" if sure else ""
    refused = np.isnan(errors[:, 2]) & ~np.isnan(errors[:, 0])
    before, linear, after = np.sqrt(np.nanmean(errors[~refused] ** 2, axis=0))
    fall = f"{before:.3f} → {linear:.3f} / {after:.3f}"
    noted = f"  without {refused.sum()} that cannot be fitted" if refused.any() else ""
    return f"{scenario.name:<40}{_size(trials):>16}{cells}{seen:6.0f}{inside:>8}{fall:>42}{noted}"


def _size(trials: Sequence[Trialled]) -> str:
    """Median size hidden, of a single effect."""
    if not all(len(one.hidden) == 1 for one in trials):
        return ""
    size = float(np.median([abs(one.hidden[0].size) for one in trials]))
    return f"{size:.3g} {trials[0].hidden[0].unit}"
