"""Characters that are pictures: drawn, because fonts differ in them and leave gaps."""

from assets.drawing.svg import number

CELL, LINE = 8.4, 18.0
"""Width and height of a character."""
_EIGHTHS = "▏▎▍▌▋▊▉█"
_LOWER = "▁▂▃▄▅▆▇"
_SHADES = {"░": 0.25, "▒": 0.5, "▓": 0.75}
_QUADRANTS = {"▖": 4, "▗": 8, "▘": 1, "▝": 2, "▙": 13, "▚": 9, "▛": 7, "▜": 11, "▞": 6, "▟": 14}
_ARMS = {  # left, right, up, down
    "─": "lr", "━": "lr", "│": "ud", "┃": "ud", "╭": "rd", "╮": "ld", "╰": "ru", "╯": "lu",
    "┌": "rd", "┐": "ld", "└": "ru", "┘": "lu", "├": "udr", "┤": "udl", "┬": "lrd", "┴": "lru",
    "┼": "lrud", "╷": "d", "╵": "u", "╴": "l", "╶": "r",
}  # fmt: skip
_DOTS = ((0, 0), (0, 1), (0, 2), (1, 0), (1, 1), (1, 2), (0, 3), (1, 3))
"""Column and row of each bit of a braille character."""


def drawn(character: str, x: float, y: float, colour: str) -> str:
    """A character as shapes in the cell whose corner is given; "" for one that is a letter."""
    if "⠀" <= character <= "⣿":
        return _braille(ord(character) - 0x2800, x, y, colour)
    if character in _ARMS:
        return _lines(_ARMS[character], x, y, colour, heavy=character in "━┃")
    parts = _blocks(character)
    return "".join(_block(x, y, *part, colour) for part in parts)


def _blocks(character: str) -> list[tuple[float, float, float, float, float]]:
    """Left, top, width, height in parts of the cell, and how opaque."""
    if character in _EIGHTHS:
        return [(0.0, 0.0, (_EIGHTHS.index(character) + 1) / 8.0, 1.0, 1.0)]
    if character in _LOWER:
        height = (_LOWER.index(character) + 1) / 8.0
        return [(0.0, 1.0 - height, 1.0, height, 1.0)]
    if character in _SHADES:
        return [(0.0, 0.0, 1.0, 1.0, _SHADES[character])]
    plain = {"▀": (0.0, 0.0, 1.0, 0.5), "▐": (0.5, 0.0, 0.5, 1.0), "▔": (0.0, 0.0, 1.0, 0.125)}
    plain["▕"] = (0.875, 0.0, 0.125, 1.0)
    if character in plain:
        return [(*plain[character], 1.0)]
    mask = _QUADRANTS.get(character, 0)
    corners = ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5))
    return [(x, y, 0.5, 0.5, 1.0) for bit, (x, y) in enumerate(corners) if mask >> bit & 1]


def _block(
    x: float, y: float, left: float, top: float, width: float, height: float, opaque: float,
    colour: str,
) -> str:  # fmt: skip
    where = f'x="{number(x + left * CELL)}" y="{number(y + top * LINE)}"'
    size = f'width="{number(width * CELL)}" height="{number(height * LINE)}"'
    faint = f' fill-opacity="{opaque}"' if opaque < 1.0 else ""
    crisp = ' shape-rendering="crispEdges"'
    return f'<rect {where} {size} fill="{colour}"{faint}{crisp}/>'


def _braille(bits: int, x: float, y: float, colour: str) -> str:
    dots = [place for bit, place in enumerate(_DOTS) if bits >> bit & 1]
    way = "".join(
        f"M{number(x + (0.27 + 0.5 * column) * CELL)} {number(y + (0.14 + 0.25 * row) * LINE)}h0"
        for column, row in dots
    )
    style = f'stroke="{colour}" stroke-width="2.3" stroke-linecap="round"'
    return f'<path d="{way}" {style}/>' if dots else ""


def _lines(arms: str, x: float, y: float, colour: str, *, heavy: bool) -> str:
    middle = (x + CELL / 2.0, y + LINE / 2.0)
    ends = {
        "l": (x, middle[1]),
        "r": (x + CELL, middle[1]),
        "u": (middle[0], y),
        "d": (middle[0], y + LINE),
    }
    start = f"M{number(middle[0])} {number(middle[1])}"
    way = "".join(f"{start}L{number(ends[arm][0])} {number(ends[arm][1])}" for arm in arms)
    width = 2.4 if heavy else 1.1
    return f'<path d="{way}" stroke="{colour}" stroke-width="{width}" fill="none"/>'
