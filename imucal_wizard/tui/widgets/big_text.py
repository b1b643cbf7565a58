"""Text in block letters, as large as fits, to be read from two metres."""

from imucal_wizard.tui.text import Line, clean, line, wrapped
from imucal_wizard.tui.widgets.lines import Lines

_ROWS_A_TO_I = """
 ###  ####   ###  ####  ##### #####  ###  #   # ###
#   # #   # #   # #   # #     #     #   # #   #  #
#   # #   # #     #   # #     #     #     #   #  #
##### ####  #     #   # ####  ####  #  ## #####  #
#   # #   # #     #   # #     #     #   # #   #  #
#   # #   # #   # #   # #     #     #   # #   #  #
#   # ####   ###  ####  ##### #      ###  #   # ###
"""
_ROWS_J_TO_R = """
  ### #   # #     #   # #   #  ###  ####   ###  ####
   #  #  #  #     ## ## ##  # #   # #   # #   # #   #
   #  # #   #     # # # # # # #   # #   # #   # #   #
   #  ##    #     # # # #  ## #   # ####  #   # ####
   #  # #   #     #   # #   # #   # #     # # # # #
#  #  #  #  #     #   # #   # #   # #     #  #  #  #
 ##   #   # ##### #   # #   #  ###  #      ## # #   #
"""
_ROWS_S_TO_Z = """
 #### ##### #   # #   # #   # #   # #   # #####
#       #   #   # #   # #   # #   # #   #     #
#       #   #   # #   # #   #  # #   # #     #
 ###    #   #   # #   # # # #   #     #     #
    #   #   #   # #   # # # #  # #    #    #
    #   #   #   #  # #  ## ## #   #   #   #
####    #    ###    #   #   # #   #   #   #####
"""
_ROWS_0_TO_9 = """
 ###    #    ###  #####    #  #####  ###  #####  ###   ###
#   #  ##   #   #     #   ##  #     #         # #   # #   #
#  ##   #       #    #   # #  ####  #        #  #   # #   #
# # #   #      #    ##  #  #      # ####    #    ###   ####
##  #   #     #       # #####     # #   #   #   #   #     #
#   #   #    #    #   #    #  #   # #   #   #   #   #     #
 ###   ###  #####  ###     #   ###   ###    #    ###   ###
"""


def _cut(rows: str, letters: str, wide: int = 6) -> dict[str, tuple[str, ...]]:
    lines = [row.ljust(wide * len(letters)) for row in rows.strip("\n").split("\n")]
    return {
        letter: _trimmed([row[i * wide : i * wide + wide - 1] for row in lines])
        for i, letter in enumerate(letters)
    }


def _trimmed(glyph: list[str]) -> tuple[str, ...]:
    used = [x for x in range(len(glyph[0])) if any(row[x] == "#" for row in glyph)]
    return tuple(row[used[0] : used[-1] + 1] for row in glyph) if used else ("   ",) * 7


GLYPHS: dict[str, tuple[str, ...]] = {
    **_cut(_ROWS_A_TO_I, "ABCDEFGHI"),
    **_cut(_ROWS_J_TO_R, "JKLMNOPQR"),
    **_cut(_ROWS_S_TO_Z, "STUVWXYZ"),
    **_cut(_ROWS_0_TO_9, "0123456789"),
    "+": ("     ", "  #  ", "  #  ", "#####", "  #  ", "  #  ", "     "),
    "−": ("     ", "     ", "     ", "#####", "     ", "     ", "     "),
    "°": ("## ", "## ", "   ", "   ", "   ", "   ", "   "),
    ".": (" ", " ", " ", " ", " ", " ", "#"),
    ",": ("  ", "  ", "  ", "  ", "  ", " #", "# "),
    ":": (" ", " ", "#", " ", "#", " ", " "),
    "!": ("#", "#", "#", "#", "#", " ", "#"),
    "?": (" ### ", "#   #", "    #", "   # ", "  #  ", "     ", "  #  "),
    "/": ("    #", "    #", "   # ", "  #  ", " #   ", "#    ", "#    "),
    " ": ("  ",) * 7,
}
"""Seven rows of ``#`` and space per character."""
_SAME = {"-": "−", "–": "−"}


_CLOSE = {" ": ("",) * 7}
"""A narrow space, for text that would not fit otherwise."""


def dots(text: str, *, close: bool = False) -> list[str] | None:
    """The text as seven rows of ``#`` and space, or None if a character has no glyph."""
    known = {**GLYPHS, **_CLOSE} if close else GLYPHS
    glyphs = [known.get(_SAME.get(c, c)) for c in text.upper()]
    if not glyphs or None in glyphs:
        return None
    return [" ".join(glyph[y] for glyph in glyphs if glyph) for y in range(7)]


def half_blocks(rows: list[str]) -> list[str]:
    """Two dots per cell, one above the other: four rows of text for seven rows of dots."""
    padded = [*rows, " " * len(rows[0])] if len(rows) % 2 else rows
    signs = {"##": "█", "# ": "▀", " #": "▄", "  ": " "}
    return [
        "".join(signs[a + b] for a, b in zip(upper, lower, strict=True))
        for upper, lower in zip(padded[::2], padded[1::2], strict=True)
    ]


def full_blocks(rows: list[str]) -> list[str]:
    """Two cells per dot, so that a dot is nearly square."""
    return ["".join("██" if dot == "#" else "  " for dot in row) for row in rows]


class BigText(Lines):
    """Text in block letters; spaced capitals if block letters do not fit."""

    DEFAULT_CSS = "BigText { height: 4; }"

    def __init__(self, text: str = "", *, id: str | None = None) -> None:  # noqa: A002 (Textual's own name for it)
        super().__init__(id=id)
        self._text = text
        self._style_name = "strong"

    @property
    def text(self) -> str:
        """The text shown now."""
        return self._text

    def say(self, text: str, style: str = "strong") -> None:
        """Show a text."""
        if (text, style) != (self._text, self._style_name):
            self._text, self._style_name = text, style
            self.draw(self._enlarged)

    def _enlarged(self, width: int, height: int) -> list[Line]:
        rows = enlarged(clean(self._text), width, height)
        return [line(row, self._style_name) for row in rows]


def enlarged(text: str, width: int, height: int) -> list[str]:
    """The text in the largest letters that fit, as ``height`` rows at most."""
    shape = dots(text)
    if shape and 2 * len(shape[0]) <= width and height >= 7:
        return _centred(full_blocks(shape), height)
    if shape and len(shape[0]) <= width and height >= 4:
        return _centred(half_blocks(shape), height)
    near = dots(text, close=True)
    if near and len(near[0]) <= width and height >= 4:
        return _centred(half_blocks(near), height)
    split = _two_rows(text, width) if height >= 8 else None
    if split:
        return split
    spaced = "   ".join(" ".join(word) for word in text.upper().split())
    if len(spaced) <= width:
        return _centred([spaced], height)
    plain: list[Line] = wrapped(text.upper(), width)
    return _centred([row[0][0] for row in plain][:height], height)


def _two_rows(text: str, width: int) -> list[str] | None:
    words = text.split()
    for cut in range(len(words) - 1, 0, -1):
        pair = [dots(" ".join(part)) for part in (words[:cut], words[cut:])]
        if all(shape and len(shape[0]) <= width for shape in pair):
            return [row for shape in pair if shape for row in half_blocks(shape)]
    return None


def _centred(rows: list[str], height: int) -> list[str]:
    above = (height - len(rows)) // 2
    return [""] * above + rows
