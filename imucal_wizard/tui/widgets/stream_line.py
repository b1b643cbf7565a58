"""The stream in one row: rate, lost samples, temperature, noise, problems."""

from typing import TYPE_CHECKING

from imucal_wizard.tui.text import Span, clean, width_of
from imucal_wizard.tui.widgets.lines import Lines

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.live.snapshot import StreamStatus


class StreamLine(Lines):
    """``100.0 Hz, 0 lost, 24.6 °C  noise 1.2 mg  virtual IMU``.

    The source stands where it fits; the temperature gives way to all that it would push out.
    """

    DEFAULT_CSS = "StreamLine { height: 1; }"

    def tell(
        self, stream: "StreamStatus", noise: str = "", loosened: float = 1.0, muted: bool = False
    ) -> None:
        """Show the newest state of the stream, and how far the limits are from the noise."""
        width = self.size.width or 80
        self.show([stream_row(stream, noise, loosened, muted, width)])


def stream_row(
    stream: "StreamStatus", noise: str, loosened: float, muted: bool, width: int
) -> tuple[Span, ...]:
    """The row, in so many columns where that is possible."""
    head: list[Span] = [(" ", "")]
    if not stream.connected:
        head.append(("▲ not connected  ", "bad"))
    head.append((f"{stream.rate:.1f} Hz, " if stream.rate else "rate not known yet, ", ""))
    head.append((f"{stream.lost} lost", "warn" if stream.lost else ""))
    if stream.malformed:
        head.append((f", {stream.malformed} unreadable", "warn"))
    tail: list[Span] = [("  sound off", "warn")] if muted else []
    if loosened > 1.0:
        tail.append((f"  limits ×{loosened:.0f}", "warn"))
    if noise:
        tail.append((f"  noise {clean(noise)}", ""))
    row = (*head, *tail)
    if stream.temperature is not None:
        warmth: Span = (f", {stream.temperature:.1f} °C".replace("-", "−"), "")
        row = _where_it_fits(row, (*head, warmth, *tail), width)
    return _where_it_fits(row, (*row, (f"  {clean(stream.source)}", "quiet")), width)


def _where_it_fits(row: tuple[Span, ...], longer: tuple[Span, ...], width: int) -> tuple[Span, ...]:
    return longer if width_of(longer) <= width else row
