"""Frozen dataclasses whose classes are made in a quarter of the time.

Python compiles ``__repr__``, ``__eq__``, ``__hash__``, ``__setattr__`` and ``__delattr__`` for each
frozen dataclass, which took a quarter of the program's import time. Here the first three are shared
and the others are left out: mypy refuses assignments to the fields of a frozen dataclass.
"""

import dataclasses
from typing import TYPE_CHECKING, Any

__all__ = ["dataclass"]

if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(*, frozen: bool = False, eq: bool = True):
        """``dataclasses.dataclass`` with these options."""

        def made(cls: type) -> type:
            if cls.__repr__ is object.__repr__:
                cls.__repr__ = _repr
            if eq:
                cls.__eq__, cls.__hash__ = _equal, _hash if frozen else None
            return dataclasses.dataclass(cls, repr=False, eq=False)

        return made


def _repr(record: Any) -> str:
    values = (f"{one.name}={getattr(record, one.name)!r}" for one in dataclasses.fields(record))
    return f"{type(record).__qualname__}({', '.join(values)})"


def _values(record: Any) -> tuple[Any, ...]:
    return tuple(getattr(record, one.name) for one in dataclasses.fields(record) if one.compare)


def _equal(record: Any, other: object) -> Any:
    if other.__class__ is not record.__class__:
        return NotImplemented
    return _values(record) == _values(other)


def _hash(record: Any) -> int:
    return hash(_values(record))
