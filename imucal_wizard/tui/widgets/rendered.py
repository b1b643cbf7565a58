"""A Rich renderable that is rendered once for each width."""

from collections.abc import Iterator

from rich.console import Console, ConsoleOptions, RenderableType
from rich.segment import Segment


class Rendered:
    """Keeps the segments: Textual asks for the height, and then for the rows, at each layout.

    Args:
        renderable: does not change any more.
    """

    def __init__(self, renderable: RenderableType) -> None:
        self._renderable = renderable
        self._segments: dict[int, list[Segment]] = {}

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Segment]:
        """The segments at the width of the options."""
        width = options.max_width
        if width not in self._segments:
            self._segments[width] = list(console.render(self._renderable, options))
        yield from self._segments[width]
