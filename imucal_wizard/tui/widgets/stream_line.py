"""The stream in one row: rate, lost samples, temperature, noise, problems."""

from typing import TYPE_CHECKING

from imucal_wizard.tui.text import Span, clean, width_of
from imucal_wizard.tui.widgets.lines import Lines

if TYPE_CHECKING:  # numpy waits until after the first paint
    from imucal_wizard.live.snapshot import StreamStatus


class StreamLine(Lines):
    """``100.0 Hz, 0 lost, 24.6 °C  noise 1.2 mg  virtual IMU``; the source where it fits."""

    DEFAULT_CSS = "StreamLine { height: 1; }"

    def tell(
        self, stream: "StreamStatus", noise: str = "", loosened: float = 1.0, muted: bool = False
    ) -> None:
        """Show the newest state of the stream, and how far the limits are from the noise."""
        spans: list[Span] = [(" ", "")]
        if not stream.connected:
            spans.append(("▲ not connected  ", "bad"))
        spans.append((f"{stream.rate:.1f} Hz, " if stream.rate else "rate not known yet, ", ""))
        spans.append((f"{stream.lost} lost", "warn" if stream.lost else ""))
        if stream.malformed:
            spans.append((f", {stream.malformed} unreadable", "warn"))
        if stream.temperature is not None:
            spans.append((f", {stream.temperature:.1f} °C".replace("-", "−"), ""))
        if muted:
            spans.append(("  sound off", "warn"))
        if noise:
            spans.append((f"  noise {clean(noise)}", ""))
        if loosened > 1.0:
            spans.append((f"  limits ×{loosened:.0f}", "warn"))
        source: Span = (f"  {clean(stream.source)}", "quiet")
        if width_of((*spans, source)) <= (self.size.width or 80):
            spans.append(source)
        self.show([tuple(spans)])
