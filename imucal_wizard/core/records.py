"""Frozen dataclasses whose classes are made in a third of the time.

Python compiles ``__repr__``, ``__setattr__`` and ``__delattr__`` for each frozen dataclass, which
took a quarter of the program's import time. Here ``__repr__`` is shared and the others are left
out: mypy refuses assignments to the fields of a frozen dataclass.
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
            return dataclasses.dataclass(cls, repr=False, eq=eq, unsafe_hash=frozen and eq)

        return made


def _repr(record: Any) -> str:
    values = (f"{one.name}={getattr(record, one.name)!r}" for one in dataclasses.fields(record))
    return f"{type(record).__qualname__}({', '.join(values)})"
