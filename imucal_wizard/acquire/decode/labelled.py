"""Numbers behind labels: one sample per line, or several kinds of line per sample."""

import math
import re
from collections import Counter, deque
from collections.abc import Sequence

from imucal_wizard.acquire.decode.base import Column, Format, TextLine, is_object
from imucal_wizard.acquire.decode.delimited import are_numbers, split_fields
from imucal_wizard.acquire.decode.lines import TextDecoder
from imucal_wizard.acquire.decode.numbers import NUMBER, printed_decimals, printed_number
from imucal_wizard.acquire.decode.vocabulary import (
    channel_of,
    quantity_of,
    sensor_word,
    unit_belongs,
)
from imucal_wizard.core import units
from imucal_wizard.core.records import dataclass

MIN_LABELLED_LINES = 24
"""Lines with numbers from which the kinds of line of an unknown device are learned."""
_WORD = re.compile(r"[A-Za-z]+")
_BRACKETED_UNIT = re.compile(r"[\[(]\s*([A-Za-zµμ°/^0-9²*]+)\s*[\])]")


@dataclass(frozen=True)
class LineKind:
    """One kind of line.

    Attributes:
        prefix: beginning of such a line; ``""`` if it begins with a number.
        columns: one per number on the line.
        scales: factor of each number before its unit applies; all 1 if empty.
        in_every_sample: belongs to every sample; otherwise it is rarer and applies to the next one.
        checked: whether the line ends with an NMEA checksum ``*HH``, the exclusive or of all
            characters between ``$`` and ``*``.
    """

    prefix: str
    columns: tuple[Column, ...]
    scales: tuple[float, ...] = ()
    in_every_sample: bool = True
    checked: bool = False


class LabelledDecoder(TextDecoder):
    """Decodes labelled numbers; a sample is complete when all its kinds of line have arrived.

    Args:
        kinds: the kinds of line; if empty, they are learned from the first lines.
        columns: channels and units in order that override those of the kinds.
        name: name of the format.
        whole: the bytes begin with a whole line.
    """

    def __init__(
        self,
        kinds: tuple[LineKind, ...] = (),
        columns: tuple[Column, ...] = (),
        name: str = "labels",
        *,
        whole: bool = False,
    ) -> None:
        super().__init__(name, whole=whole)
        self._override = columns
        self._kinds: tuple[LineKind, ...] = ()
        self._learning: list[str] = []
        self._values: dict[int, list[float]] = {}
        self._printed: dict[int, list[int]] = {}
        if kinds:
            self._use(kinds)

    def _use(self, kinds: tuple[LineKind, ...]) -> None:
        self._kinds = kinds
        own = tuple(c for kind in kinds for c in kind.columns)
        self.columns = self._override if len(self._override) == len(own) else own

    def _read(self, line: bytes, first: bool) -> None:
        text = line.decode("utf-8", errors="replace").strip()
        if not self._kinds:
            self._learn(text, first)
            return
        place = next((i for i, k in enumerate(self._kinds) if text.startswith(k.prefix)), None)
        if place is None:
            if "\ufffd" in text:
                self._spoilt(text.encode())
            return
        self._part(place, text)

    def _part(self, place: int, text: str) -> None:
        """One line of a known kind."""
        kind = self._kinds[place]
        body = _verified_body(text) if kind.checked else text
        fields = [] if body is None else NUMBER.findall(body[len(kind.prefix) :])
        if len(fields) != len(kind.columns):
            self._spoilt(text.encode())
            return
        if kind.in_every_sample and place in self._values:  # a line of the previous sample was lost
            self._spoilt(text.encode())
            self._forget()
        scales = kind.scales or (1.0,) * len(fields)
        raw = [field.encode() for field in fields]
        numbers = [printed_number(field) for field in raw]
        self._values[place] = [
            math.nan if v is None else v * s for v, s in zip(numbers, scales, strict=True)
        ]
        self._printed[place] = [
            printed_decimals(f) if s in (1.0, -1.0) else -1
            for f, s in zip(raw, scales, strict=True)
        ]
        self._complete()

    def _complete(self) -> None:
        """Complete the sample once every kind that belongs to each sample has arrived."""
        if any(k.in_every_sample and i not in self._values for i, k in enumerate(self._kinds)):
            return
        values: list[float] = []
        printed: list[int] = []
        for place, kind in enumerate(self._kinds):
            width = len(kind.columns)
            values += self._values.get(place, [math.nan] * width)
            printed += self._printed.get(place, [-1] * width)
        self._forget()
        self._row(values, printed)

    def _break(self) -> None:
        super()._break()
        self._forget()

    def _forget(self) -> None:
        """Begin a new sample and drop an incomplete one."""
        self._values.clear()
        self._printed.clear()

    def _learn(self, text: str, first: bool) -> None:
        if not NUMBER.search(text) or first:
            return
        self._learning.append(text)
        if len(self._learning) < MIN_LABELLED_LINES:
            return
        kinds = _learn_line_kinds(self._learning)
        if not kinds:
            self._learning.pop(0)
            return
        self._use(kinds)
        waiting, self._learning = self._learning, []
        for line in waiting:
            self._read(line.encode(), False)


def _learn_line_kinds(lines: list[str]) -> tuple[LineKind, ...]:
    """The kinds of line that make up a sample, from how often each occurs.

    Args:
        lines: consecutive lines with numbers.

    Returns:
        Kinds with known channels in order of appearance; one kind without channels if there is no
        other; nothing if no kind repeats.
    """
    about = [describe_line(line) for line in lines]
    counts = Counter((prefix, len(columns)) for prefix, columns in about)
    first = {(prefix, len(columns)): columns for prefix, columns in reversed(about)}
    repeated = {key: first[key] for key in dict.fromkeys(counts) if counts[key] > 1}
    useful = _distinct({k: v for k, v in repeated.items() if any(c.channel for c in v)})
    if sum(len(columns) for columns in useful.values()) < 3:
        bare = [key for key in repeated if key[1] >= 3]
        best = max(bare, key=lambda key: counts[key], default=None)
        return (LineKind(best[0], repeated[best]),) if best else ()
    needed = [counts[k] for k, v in useful.items() if any(c.channel in ("ax", "gx") for c in v)]
    usual = max(needed or counts.values())
    return tuple(
        LineKind(prefix, columns, in_every_sample=counts[prefix, width] >= 0.5 * usual)
        for (prefix, width), columns in useful.items()
    )


def _distinct(
    kinds: dict[tuple[str, int], tuple[Column, ...]],
) -> dict[tuple[str, int], tuple[Column, ...]]:
    """Keep each channel in the first kind that has it; drop kinds without new channels."""
    seen: set[str] = set()
    kept = {}
    for key, columns in kinds.items():
        own = tuple(Column("", "", c.name) if c.channel in seen else c for c in columns)
        if any(c.channel for c in own):
            kept[key] = own
            seen |= {c.channel for c in own if c.channel}
    return kept


def _verified_body(sentence: str) -> str | None:
    """The body of an NMEA sentence without its checksum; None if the checksum is wrong."""
    body, star, given = sentence.partition("*")
    total = 0
    for character in body[1:]:
        total ^= ord(character)
    try:
        right = star == "*" and len(given) == 2 and int(given, 16) == total
    except ValueError:
        right = False
    return body if right else None


def describe_line(line: str) -> tuple[str, tuple[Column, ...]]:
    """The label at the start of a line, and a column for each of its numbers.

    ``AccelX:0.1,AccelY:…``, ``Accl: x= 0.1 | y= …``, ``Acceleration X: 0.1, Y: … m/s^2`` and ``Acc
    (mg) [ 1, 2, 3 ], Gyr (DPS) [ …`` are understood; a number with an unknown label gets a column
    without channel.
    """
    found: list[Column] = []
    position, sensor, place, unit = 0, "", 0, ""
    prefix = ""
    for match in NUMBER.finditer(line):
        label = line[position : match.start()]
        if not found:
            prefix = label.strip()
        else:
            found, label = _unit_behind(found, label)
        position = match.end()
        channel, named = _channel(label, sensor, place)
        if channel:
            sensor = named
            place = "xyz".find(channel[-1]) + 1 if len(channel) == 2 else 0
        elif _WORD.search(label):
            sensor, place = named, 0
        bracket = _BRACKETED_UNIT.search(label)
        if bracket or _WORD.search(label):
            unit = units.canonical_unit(bracket[1]) if bracket else unit
        name = " ".join(_WORD.findall(label)) or channel or (found[-1].name if found else "")
        found.append(Column(channel, unit if unit_belongs(channel, unit) else "", name))
    found, _ = _unit_behind(found, line[position:], last=True)
    return prefix, _once(found)


def _channel(label: str, sensor: str, place: int) -> tuple[str, str]:
    """The channel of the number after a label, and the sensor that a label names."""
    words = _WORD.findall(_BRACKETED_UNIT.sub(" ", label))
    if not words:
        axis = "xyz"[place : place + 1]
        return (sensor + axis if sensor in ("a", "g", "m") and axis else ""), sensor
    for taken in (words[-2:], words[-1:]):
        channel = channel_of("".join(taken))
        if channel:
            return channel, channel[0] if len(channel) == 2 else channel
    last = words[-1].lower()
    named = [sensor_word(word) for word in words if word.lower() not in ("x", "y", "z")]
    own = named[-1] if named else sensor
    if own == "temp":
        return "temp", own
    if own not in ("a", "g", "m"):
        return "", ""
    return own + (last if last in ("x", "y", "z") else "x"), own


def _unit_behind(columns: list[Column], text: str, last: bool = False) -> tuple[list[Column], str]:
    """Take a unit behind the numbers to which it belongs; returns the text without it.

    A single letter between numbers is more likely the next label (``g 0.1 0.2``) than a unit.
    """
    match = re.match(r"[\s\])|]*([A-Za-zµμ°/^0-9²]+)(?=[\s,;|\])]|$)", text)
    word = units.canonical_unit(match[1]) if match else ""
    if match is None or not columns or (len(match[1]) == 1 and not last):
        return columns, text
    sensor = quantity_of(columns[-1].channel)
    if not unit_belongs(columns[-1].channel, word):
        return columns, text
    changed = [
        Column(c.channel, word, c.name) if quantity_of(c.channel) == sensor and not c.unit else c
        for c in columns
    ]
    return changed, text[match.end() :]


def _once(columns: list[Column]) -> tuple[Column, ...]:
    """Keep every channel at its first position only."""
    seen: set[str] = set()
    kept = []
    for c in columns:
        kept.append(Column("", "", c.name) if c.channel in seen else c)
        seen.add(c.channel or "-")
    return tuple(kept)


class _Detector:
    """Recognises the format by labelled lines most of which are of a repeating kind."""

    def __init__(self, _columns: tuple[Column, ...]) -> None:
        self._lines: deque[str] = deque(maxlen=MIN_LABELLED_LINES)

    def feed(self, _data: bytes, lines: Sequence[TextLine]) -> bool:
        """Whether the format is certain."""
        new = [line.text for line in lines if not line.first and _has_words(line.raw)]
        self._lines.extend(text for text in new if NUMBER.search(text))
        known = list(self._lines)
        if not new or len(known) < MIN_LABELLED_LINES or not _learn_line_kinds(known):
            return False
        kinds = Counter(describe_line(line)[0] for line in known)
        return sum(n for n in kinds.values() if n > 1) >= 0.7 * MIN_LABELLED_LINES


def _has_words(line: bytes) -> bool:
    """Whether a line is neither an object nor only numbers."""
    if is_object(line):
        return False
    fields = split_fields(line)
    return not are_numbers(fields, [printed_number(field) for field in fields])


FORMATS = (
    Format(
        "labels",
        "numbers behind words, such as AccelX:0.12",
        lambda columns, whole: LabelledDecoder((), columns, whole=whole),
        _Detector,
        rank=4,
    ),
)
