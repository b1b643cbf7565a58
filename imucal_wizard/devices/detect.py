"""Which text format speaks here, from its lines; or why none does."""

from collections import Counter, deque

from imucal_wizard.devices.formats import numbers
from imucal_wizard.devices.formats.delimited import are_numbers, split, whole
from imucal_wizard.devices.formats.labelled import LEARN_FROM, learned
from imucal_wizard.devices.formats.labels import described
from imucal_wizard.devices.formats.lines import LineCutter
from imucal_wizard.devices.formats.names import header
from imucal_wizard.devices.formats.numbers import NUMBER
from imucal_wizard.devices.formats.presets import HEADER_PRESETS, PRESETS
from imucal_wizard.devices.garbage import Garbage, unreadable

_WINDOW = 8
_AGREE = 6
_UNREADABLE = 0.2
"""A degree sign or two may be there; a line of more such bytes is no text."""
PATIENCE = 60
"""Lines after which it is said that nothing can be read of them."""


class Detector:
    """Looks at lines until one format is plain. The answer depends on the lines alone."""

    def __init__(self) -> None:
        self._cutter = LineCutter()
        self._garbage = Garbage()
        self._families: deque[str] = deque(maxlen=_WINDOW)
        self._labelled: deque[str] = deque(maxlen=LEARN_FROM)
        self._prefixes: Counter[str] = Counter()
        self._lines = 0

    @property
    def problem(self) -> str:
        """Why nothing is understood and what to do, where that is so; else ``""``."""
        if self._garbage.problem:
            return self._garbage.problem
        if self._lines < PATIENCE:
            return ""
        return (
            "Lines arrive, but no format known here: print the samples as "
            "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s], or name the format "
            "with --format."
        )

    def feed(self, data: bytes) -> str:
        """The name of the format; ``""`` while it is not plain.

        Args:
            data: at most one line.
        """
        self._garbage.feed(data)
        for line in self._cutter.feed(data):
            name = self._look(line, self._lines == 0)
            self._lines += 1
            if name:
                return name
        return ""

    def _look(self, line: bytes, first: bool) -> str:
        if unreadable(line) > _UNREADABLE:
            self._families.append("")
            return ""
        text = line.decode("utf-8", errors="replace").strip()
        name = self._preset(text) or self._header(line, first)
        if name or first:
            return name
        family = self._family(line)
        self._families.append(family)
        if family.startswith("csv") and self._families.count(family) >= _AGREE:
            return "csv"
        if family == "json" and self._families.count("json") >= _AGREE // 2:
            return "json"
        return self._labels(text) if family == "words" else ""

    def _preset(self, text: str) -> str:
        for preset in PRESETS:
            for kind in preset.kinds:
                if text.startswith(kind.prefix):
                    self._prefixes[f"{preset.name} {kind.prefix}"] += 1
            seen = [self._prefixes[f"{preset.name} {k.prefix}"] for k in preset.kinds if k.often]
            if min(seen) >= preset.patience:
                return preset.name
        return ""

    def _header(self, line: bytes, first: bool) -> str:
        fields = [field.decode("utf-8", errors="replace") for field in split(line)]
        columns = header(fields)
        if columns is None or (first and not whole(columns)):
            return ""
        names = {field.strip() for field in fields}
        return next((n for n, (_, sign, _) in HEADER_PRESETS.items() if sign in names), "csv")

    def _family(self, line: bytes) -> str:
        if line.lstrip().startswith(b"{") and b":" in line:
            return "json"
        fields = split(line)
        if are_numbers(fields, [numbers.number(field) for field in fields]):
            return f"csv {len(fields)}"
        return "words"

    def _labels(self, text: str) -> str:
        """Lines with words and numbers: plain once most of them are of a kind that repeats."""
        if not NUMBER.search(text) or self._garbage.problem:
            return ""
        self._labelled.append(text)
        lines = list(self._labelled)
        if len(lines) < LEARN_FROM or not learned(lines):
            return ""
        kinds = Counter(described(line)[0] for line in lines)
        return "labels" if sum(n for n in kinds.values() if n > 1) >= 0.7 * LEARN_FROM else ""
