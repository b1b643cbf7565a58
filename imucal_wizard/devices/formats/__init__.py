"""One file per wire format: bytes to rows of samples, without I/O."""

from imucal_wizard.devices.formats.base import Column, Decoder, Rows
from imucal_wizard.devices.formats.delimited import DelimitedDecoder
from imucal_wizard.devices.formats.json_lines import JsonDecoder
from imucal_wizard.devices.formats.labelled import LabelledDecoder
from imucal_wizard.devices.formats.presets import COLUMN_PRESETS, HEADER_PRESETS, PRESETS
from imucal_wizard.errors import FormatError

__all__ = ["Column", "Decoder", "Rows", "decoder_for", "format_names", "format_titles"]

_GENERIC = {
    "csv": "numbers between commas, semicolons, tabs or blanks, with or without a header",
    "labels": "numbers behind words, such as AccelX:0.12",
    "json": "one JSON object per line",
}


def format_titles() -> dict[str, str]:
    """What ``--format`` takes, and what each is."""
    return (
        _GENERIC
        | {p.name: p.title for p in PRESETS}
        | {name: title for name, (title, _) in COLUMN_PRESETS.items()}
        | {name: title for name, (title, _, _) in HEADER_PRESETS.items()}
    )


def format_names() -> tuple[str, ...]:
    """What ``--format`` takes."""
    return tuple(format_titles())


def format_note(name: str) -> str:
    """What a user of this format should know; ``""`` for most."""
    return next((p.note for p in PRESETS if p.name == name), "")


def decoder_for(name: str, columns: tuple[Column, ...] = ()) -> Decoder:
    """A fresh decoder.

    Args:
        name: name of a format.
        columns: the columns by their place where they are known.

    Raises:
        FormatError: there is no such format.
    """
    if name == "csv":
        return DelimitedDecoder(columns)
    if name == "json":
        return JsonDecoder(columns)
    if name == "labels":
        return LabelledDecoder((), columns)
    for preset in PRESETS:
        if preset.name == name:
            return LabelledDecoder(preset.kinds, columns, name)
    if name in COLUMN_PRESETS:
        return DelimitedDecoder(columns or COLUMN_PRESETS[name][1], name)
    if name in HEADER_PRESETS:
        return DelimitedDecoder(columns, name, HEADER_PRESETS[name][2])
    names = ", ".join(format_names())
    raise FormatError(f"There is no format {name!r}; use auto or one of {names}")
