"""A block alphabet seven dots high, for words that are read from two metres."""

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
"""Words that stand closer together, where they would not fit otherwise."""


def dots(text: str, *, close: bool = False) -> list[str] | None:
    """The text as seven rows of ``#`` and space, or None when a character has no glyph."""
    known = {**GLYPHS, **_CLOSE} if close else GLYPHS
    glyphs = [known.get(_SAME.get(c, c)) for c in text.upper()]
    if not glyphs or None in glyphs:
        return None
    return [" ".join(glyph[y] for glyph in glyphs if glyph) for y in range(7)]


def half_blocks(rows: list[str]) -> list[str]:
    """Two dots in every cell, one above the other: four rows of text for seven of dots."""
    padded = [*rows, " " * len(rows[0])] if len(rows) % 2 else rows
    signs = {"##": "█", "# ": "▀", " #": "▄", "  ": " "}
    return [
        "".join(signs[a + b] for a, b in zip(upper, lower, strict=True))
        for upper, lower in zip(padded[::2], padded[1::2], strict=True)
    ]


def full_blocks(rows: list[str]) -> list[str]:
    """Two cells for every dot, so that a dot is about square."""
    return ["".join("██" if dot == "#" else "  " for dot in row) for row in rows]
