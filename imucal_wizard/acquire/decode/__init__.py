"""Wire formats, one file each, found by discovery through their ``FORMATS``.

A new format is a new file here with ``FORMATS = (Format(…),)``: a decoder (``lines.TextDecoder`` or
``frames.FrameDecoder``) and a detector.
"""

from functools import cache
from importlib import import_module
from pkgutil import iter_modules

from imucal_wizard.acquire.decode.base import Column, Decoder, Format
from imucal_wizard.core.errors import FormatError


@cache
def formats() -> dict[str, Format]:
    """All formats by name, the most certain ones first."""
    names = sorted(module.name for module in iter_modules(__path__))
    modules = (import_module(f"{__name__}.{name}") for name in names)
    found: list[Format] = [one for module in modules for one in getattr(module, "FORMATS", ())]
    return {one.name: one for one in sorted(found, key=lambda one: one.rank)}


def is_binary(name: str) -> bool:
    """Whether this is the name of a format of frames; False for lines and for unknown names."""
    return name in formats() and formats()[name].binary


def format_names() -> tuple[str, ...]:
    """The names under which formats can be chosen."""
    return tuple(formats())


def decoder_for(name: str, columns: tuple[Column, ...] = (), *, whole: bool = False) -> Decoder:
    """A fresh decoder.

    Args:
        name: name of a format.
        columns: the columns in order, if known.
        whole: whether the bytes begin with a whole line, as those of a file do.

    Raises:
        FormatError: there is no such format.
    """
    found = formats().get(name)
    if found is None:
        names = ", ".join(format_names())
        raise FormatError(f"there is no format {name!r}; use auto or one of {names}")
    return found.decoder(columns, whole)
