"""Names given to the columns that the data have."""

from pathlib import PurePath

from imucal_wizard.devices.formats.base import Column
from imucal_wizard.devices.formats.names import belongs, with_gravity
from imucal_wizard.devices.formats.words import sensor_word
from imucal_wizard.errors import RecordingError
from imucal_wizard.recordings.header import column, is_time_of_day
from imucal_wizard.recordings.layout import is_number, shown, words_of
from imucal_wizard.units import canonical

_IGNORED = Column("", name="-")
_MAY_COME_TWICE = ("", "t", "temp", "counter")
_SHOWN_NAMES = 12
_SHOWN = 200


def named(names: list[str], fields: list[str] | None, file: str = "") -> list[Column]:
    """The column of each field, by the names of a header or of ``--columns``.

    A separator at the end of the lines or of the header makes an empty field without a name.

    Args:
        names: the names.
        fields: the fields of the first line of data; None when that line may be incomplete.
        file: name of the file, which says of which sensor the bare axes ``x``, ``y``, ``z`` are.

    Raises:
        RecordingError: names and fields differ in number, or an axis is named twice.
    """
    columns = named_loosely(names, file)
    if names[0] == "":
        columns[0] = Column("counter", name="column 1")
    if fields is None:
        return _once(columns, [])
    if len(columns) == len(fields) + 1 and not names[-1]:
        columns.pop()
    if len(columns) == len(fields) - 1 and not fields[-1]:
        columns.append(_IGNORED)
    if len(columns) != len(fields):
        raise RecordingError(_other_number(names, fields))
    return _once(columns, fields)


def named_loosely(names: list[str], file: str = "") -> list[Column]:
    """What each name means, without regard to how many there are and what comes twice."""
    return list(with_gravity(tuple(_of_file(column(name), file) for name in names)))


def with_units(names: list[str], units: list[str]) -> list[str]:
    """The names with the units that stand in a line of their own below them; without, unchanged."""
    if len(names) != len(units):
        return names
    columns = [
        column(f"{name}[{unit}]" if unit else name) for name, unit in zip(names, units, strict=True)
    ]
    good = [belongs(one.channel, canonical(one.unit)) for one in columns if one.channel]
    return [one.name for one in columns] if sum(good) > len(good) / 2 else names


def _of_file(one: Column, file: str) -> Column:
    """A bare ``x`` in ``Gyroscope.csv`` is ``gx``."""
    axis = one.name.strip().lower()
    if one.channel or axis not in ("x", "y", "z"):
        return one
    words = [w for w in words_of(PurePath(file).stem) if w.startswith(("acc", "gyr", "mag"))]
    sensors = {sensor_word(word) for word in words} - {""}
    return Column(sensors.pop() + axis, "", one.name) if len(sensors) == 1 else one


def _other_number(names: list[str], fields: list[str]) -> str:
    some = ",".join(names[:_SHOWN_NAMES]) + (",…" if len(names) > _SHOWN_NAMES else "")
    some = some if len(some) <= _SHOWN else some[:_SHOWN] + "…"
    if len(names) < len(fields) <= 2 * len(names) and not any("." in field for field in fields):
        return (
            f"{len(names)} columns are named ({some}), but the first line of data has"
            f" {len(fields)} fields and no decimal point: its numbers seem to be written with a"
            " decimal comma between commas; export it again with points, or with semicolons"
            " between the columns"
        )
    return (
        f"{len(names)} columns are named ({some}), but the first line of data has"
        f" {len(fields)}; give --columns with {len(fields)} names (- for one to leave out)"
    )


def _once(columns: list[Column], fields: list[str]) -> list[Column]:
    """Each channel once: a second time or temperature is left out, a second axis is an error."""
    best = _best_time(columns, fields)
    columns = [
        _IGNORED if one.channel == "t" and i != best else one for i, one in enumerate(columns)
    ]
    seen: dict[str, Column] = {}
    result = []
    for one in columns:
        if one.channel in seen and one.channel not in _MAY_COME_TWICE:
            raise RecordingError(
                f"two columns are {one.channel}: {shown(seen[one.channel].name)} and"
                f" {shown(one.name)}; give --columns with - for the one to leave out"
            )
        result.append(_IGNORED if one.channel in seen else one)
        seen.setdefault(one.channel, one)
    return result


def _best_time(columns: list[Column], fields: list[str]) -> int:
    """The place of the time that says most: a number, of a known unit, no clock on the wall."""

    def rank(place: int) -> tuple[bool, bool, bool]:
        one = columns[place]
        text = bool(fields) and not is_number(fields[place])
        return (is_time_of_day(one), text, not belongs("t", one.unit))

    places = [i for i, one in enumerate(columns) if one.channel == "t"]
    return min(places, key=rank, default=-1)
