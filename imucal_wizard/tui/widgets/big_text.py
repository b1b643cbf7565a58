"""The instruction, as large as there is room for."""

from imucal_wizard.tui.text import Line, clean, line, wrapped
from imucal_wizard.tui.widgets.drawn import Drawn
from imucal_wizard.tui.widgets.font import dots, full_blocks, half_blocks


class BigText(Drawn):
    """Words in block letters; spaced capitals where block letters do not fit."""

    DEFAULT_CSS = "BigText { height: 4; }"

    def __init__(self, text: str = "", *, id: str | None = None) -> None:  # noqa: A002 (Textual's own name for it)
        super().__init__(id=id)
        self._text = text
        self._style_name = "strong"

    @property
    def text(self) -> str:
        """The words shown now."""
        return self._text

    def say(self, text: str, style: str = "strong") -> None:
        """Show other words."""
        if (text, style) != (self._text, self._style_name):
            self._text, self._style_name = text, style
            self.draw()

    def draw(self) -> None:
        """Show it in the room there is."""
        width, height = self.size
        if not width or not height:
            return
        rows = enlarged(clean(self._text), width, height)
        self.show([line(row, self._style_name) for row in rows])


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
