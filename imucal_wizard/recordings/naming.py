"""Names given to the columns that the data have."""

from imucal_wizard.devices.formats.base import Column
from imucal_wizard.errors import RecordingError
from imucal_wizard.recordings.header import column, is_time_of_day

_IGNORED = Column("", name="-")
_MAY_COME_TWICE = ("", "t", "temp", "counter")


def named(names: list[str], fields: list[str] | None) -> list[Column]:
    """The column of each field, by the names of a header or of ``--columns``.

    A separator at the end of the lines or of the header makes an empty field without a name.

    Args:
        names: the names.
        fields: the fields of the first line of data; None when that line may be incomplete.

    Raises:
        RecordingError: names and fields differ in number, or an axis is named twice.
    """
    columns = [column(name) for name in names]
    if names[0] == "":
        columns[0] = Column("counter", name="column 1")
    if fields is None:
        return _once(columns)
    if len(columns) == len(fields) + 1 and not names[-1]:
        columns.pop()
    if len(columns) == len(fields) - 1 and not fields[-1]:
        columns.append(_IGNORED)
    if len(columns) != len(fields):
        raise RecordingError(
            f"{len(columns)} columns are named ({','.join(names)}), but the first line of data has"
            f" {len(fields)}; give --columns with {len(fields)} names (- for one to leave out)"
        )
    return _once(columns)


def _once(columns: list[Column]) -> list[Column]:
    """Each channel once: a second time or temperature is left out, a second axis is an error."""
    times = [one for one in columns if one.channel == "t"]
    if len(times) > 1 and not all(map(is_time_of_day, times)):
        columns = [_IGNORED if is_time_of_day(one) else one for one in columns]
    seen: dict[str, Column] = {}
    result = []
    for one in columns:
        if one.channel in seen and one.channel not in _MAY_COME_TWICE:
            raise RecordingError(
                f"two columns are {one.channel}: {seen[one.channel].name!r} and {one.name!r};"
                " give --columns with - for the one to leave out"
            )
        result.append(_IGNORED if one.channel in seen else one)
        seen.setdefault(one.channel, one)
    return result
