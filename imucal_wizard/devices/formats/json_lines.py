"""One JSON object per line; the keys name the columns."""

import json
import math
from typing import Any

from imucal_wizard.devices.formats.base import Column
from imucal_wizard.devices.formats.names import column, with_gravity
from imucal_wizard.devices.formats.numbers import LARGEST
from imucal_wizard.devices.formats.text import TextDecoder


class JsonDecoder(TextDecoder):
    """``json``: ``{"t": 1.5, "ax": 0.1, …}``, also nested (``{"acc": [0.1, 0.2, 9.8]}``).

    Args:
        columns: the columns, named by their keys, where they are known; else the keys of the
            first object.
    """

    def __init__(self, columns: tuple[Column, ...] = ()) -> None:
        super().__init__("json", columns)

    def _read(self, line: bytes, first: bool) -> None:
        if first and not line.lstrip().startswith(b"{"):
            return
        try:
            value = json.loads(line, parse_int=float)
        except (ValueError, RecursionError):
            self._spoilt()
            return
        flat = flattened(value) if isinstance(value, dict) else {}
        if not self._columns and len(flat) >= 3:
            self._columns = with_gravity(tuple(_column(key) for key in flat))
        if not self._columns or not any(c.name in flat for c in self._columns):
            self._spoilt()
            return
        row = [_real(flat.get(c.name, math.nan)) for c in self._columns]
        self._row(row, [_digits(v) for v in row])


def flattened(value: Any, key: str = "", depth: int = 0) -> dict[str, Any]:
    """Nested objects and arrays as one level; the keys are joined with dots."""
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
        found.update(flattened(inner, f"{key}.{name}" if key else name, depth + 1))
    return found


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def _real(value: Any) -> float:
    return float(value) if value is not None and abs(value) < LARGEST else math.nan


def _digits(value: float) -> int:
    """Decimals of the shortest text that gives this number."""
    text = repr(value)
    return 17 if "e" in text else len(text.partition(".")[2].rstrip("0"))


def _column(key: str) -> Column:
    """The column of a key; of a path, its last parts say which sensor and axis."""
    parts = key.split(".")
    tails = [".".join(parts[-length:]) for length in range(len(parts), 0, -1)]
    found = next((c for c in map(column, tails) if c.channel), Column(""))
    return Column(found.channel, found.unit, key)
