"""Frozen dataclasses whose classes are made in a third of the time.

Python compiles ``__repr__``, ``__eq__``, ``__hash__``, ``__setattr__`` and ``__delattr__`` for each
frozen dataclass, which took a third of the program's import time. Here none of the first three is
compiled and the others are left out: mypy refuses assignments to the fields of a frozen dataclass.
"""

import dataclasses
from operator import attrgetter
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
            dataclasses.dataclass(cls, repr=False, eq=False)
            if eq:
                values = attrgetter(*(one.name for one in dataclasses.fields(cls) if one.compare))
                cls.__eq__ = lambda self, other: (
                    values(self) == values(other) if type(other) is type(self) else NotImplemented
                )
                cls.__hash__ = (lambda self: hash(values(self))) if frozen else None
            return cls

        return made


def _repr(record: Any) -> str:
    values = (f"{one.name}={getattr(record, one.name)!r}" for one in dataclasses.fields(record))
    return f"{type(record).__qualname__}({', '.join(values)})"
