"""Records behave as the frozen dataclasses that they stand for."""

import dataclasses
from typing import Any

from imucal_wizard.core.records import dataclass


@dataclass(frozen=True)
class Point:
    """Two numbers and a note that does not count."""

    x: float
    y: float = 0.0
    note: str = dataclasses.field(default="", compare=False)


@dataclass(frozen=True)
class Other:
    """The same fields in another class."""

    x: float
    y: float = 0.0


@dataclass()
class Mutable:
    """A record that may change has no hash."""

    x: float


@dataclass(frozen=True, eq=False)
class Unique:
    """A record of arrays is equal to itself only."""

    x: float


def test_records_of_one_class_are_equal_by_their_values() -> None:
    assert Point(1.0) == Point(1.0, 0.0, "seen")
    assert Point(1.0) != Point(1.0, 2.0)
    other: Any = Other(1.0)
    assert Point(1.0) != other
    assert hash(Point(1.0)) == hash(Point(1.0, note="seen"))
    assert len({Point(1.0), Point(1.0, note="seen"), Point(2.0)}) == 2


def test_records_without_equality_or_hash() -> None:
    assert Unique(1.0) != Unique(1.0)
    assert len({Unique(1.0), Unique(1.0)}) == 2
    assert Mutable(1.0) == Mutable(1.0)
    assert Mutable.__hash__ is None


def test_a_record_shows_its_fields_and_can_be_replaced() -> None:
    assert repr(Point(1.0)) == "Point(x=1.0, y=0.0, note='')"
    assert dataclasses.replace(Point(1.0), y=3.0) == Point(1.0, 3.0)
