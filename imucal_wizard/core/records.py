"""Frozen dataclasses whose classes are made in a tenth of the time.

Python compiles ``__init__``, ``__repr__``, ``__eq__``, ``__hash__``, ``__setattr__`` and
``__delattr__`` for each frozen dataclass, which took half of the program's import time. Here the
``__init__`` of all records with as many fields is compiled once and gets the names of the fields,
the next three are not compiled, and the others are left out: mypy refuses assignments to the fields
of a frozen dataclass.
"""

import dataclasses
from functools import cache
from operator import attrgetter
from types import CodeType, FunctionType
from typing import TYPE_CHECKING, Any

__all__ = ["dataclass", "fields_of"]

if TYPE_CHECKING:
    from dataclasses import dataclass
else:

    def dataclass(*, frozen: bool = False, eq: bool = True):
        """``dataclasses.dataclass`` with these options."""

        def made(cls: type) -> type:
            if cls.__repr__ is object.__repr__:
                cls.__repr__ = _repr
            plain = _is_plain(cls)
            dataclasses.dataclass(cls, init=not plain, repr=False, eq=False)
            if plain:
                cls.__init__ = _init(cls)
            if eq:
                values = attrgetter(*(one.name for one in dataclasses.fields(cls) if one.compare))
                cls.__eq__ = lambda self, other: (
                    values(self) == values(other) if type(other) is type(self) else NotImplemented
                )
                cls.__hash__ = (lambda self: hash(values(self))) if frozen else None
            return cls

        return made


def fields_of(record: Any) -> dict[str, Any]:
    """The fields of a record by name, for a document; their values are not converted."""
    return {one.name: getattr(record, one.name) for one in dataclasses.fields(record)}


def _is_plain(cls: type) -> bool:
    """Whether ``__init__`` assigns its arguments and does nothing else."""
    if hasattr(cls, "__post_init__") or any(map(dataclasses.is_dataclass, cls.__bases__)):
        return False
    special = [one for one in vars(cls).values() if isinstance(one, dataclasses.Field)]
    return all(one.init and one.default_factory is dataclasses.MISSING for one in special)


def _init(cls: type) -> FunctionType:
    fields = dataclasses.fields(cls)
    names = tuple(one.name for one in fields)
    code = _assignments(len(names)).replace(co_varnames=("self", *names), co_names=names)
    defaults = tuple(one.default for one in fields if one.default is not dataclasses.MISSING)
    init = FunctionType(code, {}, "__init__", defaults)
    init.__qualname__ = f"{cls.__qualname__}.__init__"
    init.__annotations__ = {**{one.name: one.type for one in fields}, "return": None}
    return init


@cache
def _assignments(count: int) -> CodeType:
    """Compiled ``__init__`` of a record with so many fields."""
    names = [f"field_{place}" for place in range(count)]
    lines = [f"def __init__({', '.join(['self', *names])}):"]
    lines += [f" self.{name} = {name}" for name in names]
    space: dict[str, FunctionType] = {}
    exec("\n".join(lines), space)  # noqa: S102 (a text without anything from outside)
    return space["__init__"].__code__


def _repr(record: Any) -> str:
    values = (f"{one.name}={getattr(record, one.name)!r}" for one in dataclasses.fields(record))
    return f"{type(record).__qualname__}({', '.join(values)})"
