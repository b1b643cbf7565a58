"""The suspects as a table: what adding each would do, how sure, how large, what looks the same."""

import math

from imucal_wizard.bench.amounts import detectable
from imucal_wizard.tui.bench.entries import Entry, by_name
from imucal_wizard.tui.bench.model_rows import pair, unit_words
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.report_rows import SHOWN
from imucal_wizard.tui.text import Line, Span, line, number, wrapped

STRONG = 0.01
"""Noise alone makes such a suspect once in a hundred recordings."""
BLIND = "no size"
WIDE = 100
"""Columns from which what looks the same stands in the table."""
_FALLS = 0.97
"""A prediction must be this much lower to be called a fall."""


def order(sight: Sight, *, hidden: bool = False) -> tuple[Entry, ...]:
    """The entries in the order shown; by name while the answer is hidden."""
    return by_name(sight.entries) if hidden else sight.entries


def table_rows(
    sight: Sight, width: int, height: int, chosen: int | None, *, hidden: bool = False
) -> list[Line]:
    """Heading, what is now, as many suspects as there is room for, about the chosen one.

    Args:
        sight: what to show.
        width: columns there are.
        height: rows there are; at least six.
        chosen: place of the suspect to mark.
        hidden: show nothing but the names, so that one guesses first.
    """
    entries = order(sight, hidden=hidden)
    about = [] if chosen is None else about_rows(sight, entries[chosen], width, hidden=hidden)
    about = about[: max(1, height - 5)]
    room = max(2, height - 2 - len(about))
    first = 0 if chosen is None else min(max(0, chosen - room + 1), max(0, len(entries) - room))
    rows = [
        entry_row(sight, entry, width, here=first + k == chosen, hidden=hidden)
        for k, entry in enumerate(entries[first : first + room])
    ]
    rows += [line("")] * (room - len(rows))
    return [*head_rows(sight, width, hidden=hidden), *rows, *about]


def head_rows(sight: Sight, width: int, *, hidden: bool = False) -> list[Line]:
    """What the columns mean, and the errors now."""
    if hidden:
        return [line("  what may be missing", "quiet"), line("")]
    fit = sight.fit
    _, unit = SHOWN[fit.fit.unit]
    wide = f"  {'seen from':<12}{'looks like'}" if width >= WIDE else ""
    names = f"  {'with it, error would be':<24}{'fitted':>8}{'held out':>9}   "
    return [
        line(f"{names}{'p':<7}{'largest size ± error':<26}{wide}"[:width], "quiet"),
        (
            (f"  {'now':<24}", "quiet"),
            (f"{_short(fit.rms_fitted, fit.fit.unit):>8}", "strong"),
            (f"{_short(fit.rms_held_out, fit.fit.unit):>9}", "strong"),
            (f" {unit}", "quiet"),
        ),
    ]


def entry_row(sight: Sight, entry: Entry, width: int, *, here: bool, hidden: bool = False) -> Line:
    """One suspect."""
    mark: Span = ("▸ " if here else "  ", "accent")
    name: Span = (f"{title_of(entry):<24}", "strong" if here else "")
    if hidden or entry.lacking:
        told = "" if hidden else f"  cannot be seen here: {entry.lacking}"
        return mark, name, (told[: max(0, width - 26)], "quiet")
    unit, room = sight.fit.fit.unit, max(0, width - 53)
    falls = _falls(sight, entry)
    spans: list[Span] = [
        mark,
        name,
        (f"{_short(entry.rms_fitted, unit):>8}", ""),
        (f"{_short(entry.rms_held_out, unit):>9}", "good" if falls == "▼" else ""),
        (f" {falls} ", "good" if falls == "▼" else "warn"),
        (f"{chance(entry):<7}", "strong" if _strong(entry) else "quiet"),
        (f"{size_text(entry, room):<26}"[:room], ""),
    ]
    if width >= WIDE:
        spans.append((f"  {_seen_from(entry):<12}{', '.join(_like(entry))}"[: width - 79], "quiet"))
    return tuple(spans)


def title_of(entry: Entry) -> str:
    """The suspect's name, as it stands in the table."""
    if entry.term == "disturbed" and entry.suspect is not None:
        hold = entry.suspect.hold
        return "a disturbed hold" if hold is None else f"disturbed (#{hold + 1})"
    return entry.term


def chance(entry: Entry) -> str:
    """The p-value, as far as the simulations go."""
    if entry.suspect is None:
        return "base"
    return "<0.003" if entry.suspect.p < 0.003 else f"{entry.suspect.p:.2g}"


def size_text(entry: Entry, room: int = 99) -> str:
    """Size ± standard error of the parameter that stands out most; its unit where there is room."""
    suspect = entry.suspect
    if suspect is None or suspect.trial is None or suspect.candidate is None:
        return ""
    k, trial = entry.largest, suspect.trial
    name, unit = suspect.candidate.names[k], unit_words(suspect.candidate.unit)
    size = f"{name} {pair(float(trial.size[k]), float(trial.standard_error[k]))}"
    return f"{size} {unit}" if len(size) + 1 + len(unit) <= room else size[:room]


def about_rows(sight: Sight, entry: Entry, width: int, *, hidden: bool = False) -> list[Line]:
    """What else there is to say of the chosen suspect."""
    if hidden:
        text = "enter: commit to this one   l: its lesson, with the picture of what it leaves"
        return wrapped(f"  {text}", width, "quiet", indent="  ")
    words = [] if entry.effect is None else [entry.effect.title]
    if entry.suspect is None and entry.effect is None:
        words.append("a part of the base model that every sensor needs")
    elif entry.term == "disturbed":
        words.append("one hold that is simply wrong: somebody touched it. Measure it again")
    if entry.lacking:
        words.append(f"cannot be seen here: {entry.lacking}")
    elif _seen_from(entry) == BLIND:
        words.append("these data cannot show it, whatever its size")
    elif _seen_from(entry):
        words.append(f"these data show it from {_seen_from(entry)}")
    if _like(entry):
        words.append(f"looks the same here as {', '.join(_like(entry))}")
    elif entry.suspect is not None and entry.suspect.candidate is not None:
        words.append("nothing else looks like it here")
    if entry.rms_held_out is not None and _falls(sight, entry) == "▲":
        words.append("▲ the held-out error would not fall")
    return wrapped("  " + "; ".join(words), width, "quiet", indent="  ")


def _short(value: float | None, unit: str) -> str:
    if value is None:
        return "–"
    return number(value * SHOWN[unit][0], 3)


def _falls(sight: Sight, entry: Entry) -> str:
    now, then = sight.fit.rms_held_out, entry.rms_held_out
    if now is None or then is None:
        return " "
    return "▼" if then < _FALLS * now else "▲" if then > now else " "


def _strong(entry: Entry) -> bool:
    return entry.suspect is not None and entry.suspect.p <= STRONG


def _seen_from(entry: Entry) -> str:
    if entry.suspect is None or entry.suspect.candidate is None:
        return ""
    size = detectable(entry.suspect)
    if not math.isfinite(size):
        return BLIND
    return f"{number(size, 2)} {unit_words(entry.suspect.candidate.unit)}"


def _like(entry: Entry) -> tuple[str, ...]:
    return () if entry.suspect is None else entry.suspect.like
