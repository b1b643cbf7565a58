"""Lines that begin with words: one sample per line, or several kinds of lines per sample."""

import math
from collections import Counter

from imucal_wizard.devices.formats.base import Column
from imucal_wizard.devices.formats.labels import described
from imucal_wizard.devices.formats.numbers import NUMBER, decimals, number
from imucal_wizard.devices.formats.presets import Kind
from imucal_wizard.devices.formats.text import TextDecoder

LEARN_FROM = 24
"""Lines with numbers from which the kinds of an unknown device are learned."""


class LabelledDecoder(TextDecoder):
    """Numbers behind words. A sample is complete when each of its kinds of line has come.

    Args:
        kinds: the kinds of line; learned from the first lines where it is empty.
        columns: channels and units by place that override those of the kinds.
        name: name of the format.
    """

    def __init__(
        self,
        kinds: tuple[Kind, ...] = (),
        columns: tuple[Column, ...] = (),
        name: str = "labels",
    ) -> None:
        super().__init__(name)
        self._override = columns
        self._kinds: tuple[Kind, ...] = ()
        self._learning: list[str] = []
        self._values: dict[int, list[float]] = {}
        self._printed: dict[int, list[int]] = {}
        if kinds:
            self._use(kinds)

    def _use(self, kinds: tuple[Kind, ...]) -> None:
        self._kinds = kinds
        own = tuple(c for kind in kinds for c in kind.columns)
        self._columns = self._override if len(self._override) == len(own) else own

    def _read(self, line: bytes, first: bool) -> None:
        text = line.decode("utf-8", errors="replace").strip()
        if not self._kinds:
            self._learn(text, first)
            return
        place = next((i for i, k in enumerate(self._kinds) if text.startswith(k.prefix)), None)
        if place is None:
            if "\ufffd" in text:
                self._spoilt()
            return
        self._part(place, text)

    def _part(self, place: int, text: str) -> None:
        """One line of a known kind."""
        kind = self._kinds[place]
        body = unchecked(text) if kind.checked else text
        fields = [] if body is None else NUMBER.findall(body[len(kind.prefix) :])
        if len(fields) != len(kind.columns):
            self._spoilt()
            return
        if kind.often and place in self._values:  # a line of the sample before was lost
            self._spoilt()
            self._forget()
        scales = kind.scales or (1.0,) * len(fields)
        raw = [field.encode() for field in fields]
        numbers = [number(field) for field in raw]
        self._values[place] = [
            math.nan if v is None else v * s for v, s in zip(numbers, scales, strict=True)
        ]
        self._printed[place] = [
            decimals(f) if s in (1.0, -1.0) else -1 for f, s in zip(raw, scales, strict=True)
        ]
        self._complete()

    def _complete(self) -> None:
        """Give the sample away once every kind that is part of each sample has come."""
        if any(k.often and i not in self._values for i, k in enumerate(self._kinds)):
            return
        values: list[float] = []
        printed: list[int] = []
        for place, kind in enumerate(self._kinds):
            width = len(kind.columns)
            values += self._values.get(place, [math.nan] * width)
            printed += self._printed.get(place, [-1] * width)
        self._forget()
        self._row(values, printed)

    def _broken(self) -> None:
        super()._broken()
        self._forget()

    def _forget(self) -> None:
        """Begin a new sample; one of which only some lines have arrived is none."""
        self._values.clear()
        self._printed.clear()

    def _learn(self, text: str, first: bool) -> None:
        if not NUMBER.search(text) or first:
            return
        self._learning.append(text)
        if len(self._learning) < LEARN_FROM:
            return
        kinds = learned(self._learning)
        if not kinds:
            self._learning.pop(0)
            return
        self._use(kinds)
        waiting, self._learning = self._learning, []
        for line in waiting:
            self._read(line.encode(), False)


def learned(lines: list[str]) -> tuple[Kind, ...]:
    """The kinds of line that make up a sample, by how often each comes.

    Args:
        lines: some consecutive lines with numbers.

    Returns:
        Kinds with a channel that is known, in order of appearance; one without channels where
        there is no other; nothing where no kind repeats.
    """
    about = [described(line) for line in lines]
    counts = Counter((prefix, len(columns)) for prefix, columns in about)
    first = {(prefix, len(columns)): columns for prefix, columns in reversed(about)}
    repeated = {key: first[key] for key in dict.fromkeys(counts) if counts[key] > 1}
    useful = _distinct({k: v for k, v in repeated.items() if any(c.channel for c in v)})
    if sum(len(columns) for columns in useful.values()) < 3:
        bare = [key for key in repeated if key[1] >= 3]
        best = max(bare, key=lambda key: counts[key], default=None)
        return (Kind(best[0], repeated[best]),) if best else ()
    needed = [counts[k] for k, v in useful.items() if any(c.channel in ("ax", "gx") for c in v)]
    usual = max(needed or counts.values())
    return tuple(
        Kind(prefix, columns, often=counts[prefix, width] >= 0.5 * usual)
        for (prefix, width), columns in useful.items()
    )


def _distinct(
    kinds: dict[tuple[str, int], tuple[Column, ...]],
) -> dict[tuple[str, int], tuple[Column, ...]]:
    """Each channel in the first kind that has it; kinds that bring nothing new are left out."""
    seen: set[str] = set()
    kept = {}
    for key, columns in kinds.items():
        own = tuple(Column("", "", c.name) if c.channel in seen else c for c in columns)
        if any(c.channel for c in own):
            kept[key] = own
            seen |= {c.channel for c in own if c.channel}
    return kept


def unchecked(sentence: str) -> str | None:
    """The body of a sentence whose checksum is right, without it; None when it is wrong."""
    body, star, given = sentence.partition("*")
    total = 0
    for character in body[1:]:
        total ^= ord(character)
    try:
        right = star == "*" and len(given) == 2 and int(given, 16) == total
    except ValueError:
        right = False
    return body if right else None
