"""One file per wire format: bytes to rows of samples, without I/O."""

from imucal_wizard.devices.formats.base import Column, Decoder, Rows
from imucal_wizard.devices.formats.delimited import DelimitedDecoder
from imucal_wizard.errors import FormatError

__all__ = ["Column", "Decoder", "Rows", "decoder_for", "format_names"]


def format_names() -> tuple[str, ...]:
    """What ``--format`` takes."""
    return ("csv",)


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
    raise FormatError(f"There is no format {name!r}; use one of {', '.join(format_names())}, auto")
