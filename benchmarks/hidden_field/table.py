"""What is counted over many recordings of one kind, and how it is printed."""

from collections import Counter
from collections.abc import Sequence

import numpy as np

from benchmarks.hidden.table import COLUMNS, outcome
from benchmarks.hidden_field.scenarios import Scenario
from benchmarks.hidden_field.trialled import Trialled


def heading(design: str, count: int) -> str:
    """The lines above the table."""
    columns = "".join(f"{name:>9}" for name in COLUMNS)
    return (
        f"\n{design}; {count} recordings each; per cent of them\n"
        f"{'hidden':<24}{'size':>14}{columns}{'refused':>9}{'seen':>6}{'inside':>8}"
        f"{'held out: before → with it, µT':>32}"
    )


def line(scenario: Scenario, trials: Sequence[Trialled | None]) -> str:
    """One row; what the program refuses to look at is counted as such."""
    own = [one for one in trials if one is not None]
    counts = Counter(outcome(one) for one in own)
    counts["family"] += counts["named"]
    share = 100.0 / len(trials)
    cells = "".join(f"{share * counts[name]:9.1f}" for name in COLUMNS)
    refused = share * (len(trials) - len(own))
    seen = share * sum(one.p <= 0.01 for one in own)
    sure = [abs(one.sure) < 1.96 for one in own if one.sure is not None]
    inside = f"{100.0 * np.mean(sure):.0f}" if sure else ""
    errors = np.array([(one.before, one.after) for one in own]).reshape(-1, 2)
    before, after = np.sqrt(np.nanmean(errors**2, axis=0)) if own else (np.nan, np.nan)
    fall = f"{before:.3f} → {after:.3f}"
    return (
        f"{scenario.name:<24}{_size(own):>14}{cells}{refused:9.1f}{seen:6.0f}{inside:>8}{fall:>32}"
    )


def _size(trials: Sequence[Trialled]) -> str:
    """Median size hidden, of a single effect."""
    if not trials or not all(len(one.hidden) == 1 for one in trials):
        return ""
    size = float(np.median([abs(one.hidden[0].size) for one in trials]))
    return f"{size:.2g} {trials[0].hidden[0].unit}"
