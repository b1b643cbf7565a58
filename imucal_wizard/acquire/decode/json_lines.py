"""One JSON object per line; the keys name the columns."""

import math
from collections import deque
from collections.abc import Sequence
from typing import Any

from imucal_wizard.acquire.decode.base import Column, Format, TextLine, is_object
from imucal_wizard.acquire.decode.lines import TextDecoder
from imucal_wizard.acquire.decode.vocabulary import (
    column_of_name,
    columns_of_names,
    quantity_of,
    unique_channels,
)
from imucal_wizard.core.readings import MAX_READING


class JsonDecoder(TextDecoder):
    """``json``: ``{"t": 1.5, "ax": 0.1, …}``, also nested (``{"acc": [0.1, 0.2, 9.8]}``).

    Args:
        columns: the columns, named by their keys, if known; otherwise the keys of the first object.
        whole: the bytes begin with a whole line.
    """

    def __init__(self, columns: tuple[Column, ...] = (), *, whole: bool = False) -> None:
        super().__init__("json", columns, whole=whole)

    def _read(self, line: bytes, first: bool) -> None:
        if first and not line.lstrip().startswith(b"{"):
            return
        import json  # no other format needs it

        try:
            value = json.loads(line, parse_int=float)
        except (ValueError, RecursionError):
            self._spoilt(line)
            return
        flat = _flatten_object(value) if isinstance(value, dict) else {}
        if not self.columns and len(flat) >= 3:
            self.columns = _columns(list(flat))
        if not self.columns or not any(c.name in flat for c in self.columns):
            self._spoilt(line)
            return
        row = [_real(flat.get(c.name, math.nan)) for c in self.columns]
        self._row(row, [_digits(v) for v in row])


def _flatten_object(value: Any, key: str = "", depth: int = 0) -> dict[str, Any]:
    """Nested objects and arrays flattened to one level; the keys are joined with dots."""
    if depth > 8:
        return {}
    if isinstance(value, dict):
        parts = [(str(k), v) for k, v in value.items()]
    elif isinstance(value, list):
        parts = [(str(i), v) for i, v in enumerate(value)]
    else:
        return {key: value} if _is_number(value) else {}
    found: dict[str, Any] = {}
    for name, inner in parts:
        found.update(_flatten_object(inner, f"{key}.{name}" if key else name, depth + 1))
    return found


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _real(value: Any) -> float:
    return float(value) if value is not None and abs(value) < MAX_READING else math.nan


def _digits(value: float) -> int:
    """Decimals of the shortest text that represents this number."""
    text = repr(value)
    return 17 if "e" in text else len(text.partition(".")[2].rstrip("0"))


def _columns(keys: list[str]) -> tuple[Column, ...]:
    """The columns of the keys; the last parts of a path name the sensor and the axis."""
    found = [_column(key) for key in keys]
    if not any(quantity_of(one.channel) == "accelerometer" for one in found):
        found = [
            one if one.channel else other
            for one, other in zip(found, columns_of_names(keys), strict=True)
        ]
    return unique_channels(found)


def _column(key: str) -> Column:
    parts = key.split(".")
    tails = [".".join(parts[-length:]) for length in range(len(parts), 0, -1)]
    found = next((c for c in map(column_of_name, tails) if c.channel), Column(""))
    return Column(found.channel, found.unit, key)


class _Detector:
    """Recognises the format by lines that look like objects."""

    _WINDOW, _AGREE = 8, 3

    def __init__(self, _columns: tuple[Column, ...]) -> None:
        self._objects: deque[bool] = deque(maxlen=self._WINDOW)

    def feed(self, _data: bytes, lines: Sequence[TextLine]) -> bool:
        """Whether the format is certain."""
        for line in lines:
            if not line.first:
                self._objects.append(is_object(line.raw))
        return bool(self._objects) and self._objects[-1] and sum(self._objects) >= self._AGREE


FORMATS = (
    Format(
        "json",
        "one JSON object per line",
        lambda columns, whole: JsonDecoder(columns, whole=whole),
        _Detector,
        rank=3,
    ),
)
