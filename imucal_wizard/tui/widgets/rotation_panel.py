"""The rotation under way: angle so far, rate against the range, what is done and still wanted."""

from imucal_wizard.procedure.state import RotationStatus
from imucal_wizard.procedure.wording import signed
from imucal_wizard.tui.text import Line, Span, bar
from imucal_wizard.tui.widgets.lines import Lines

FULL = 170.0
"""Rotations up to this many degrees can be told apart from their other way round."""
_SPEEDS = 3


class RotationPanel(Lines):
    """Four rows."""

    DEFAULT_CSS = "RotationPanel { height: 4; }"

    def tell(self, rotation: RotationStatus) -> None:
        """Show the newest state."""
        width = self.size.width or 78
        self.show([_angle(rotation, width), _rate(rotation), _done(rotation), _wanted(rotation)])


def _angle(rotation: RotationStatus, width: int) -> Line:
    half = max(8, min(30, (width - 40) // 2))
    filled = min(half, round(abs(rotation.angle) / FULL * half))
    left = "·" * (half - filled) + "█" * filled if rotation.angle < 0 else "·" * half
    right = "█" * filled + "·" * (half - filled) if rotation.angle > 0 else "·" * half
    return (
        (" so far  ", "quiet"),
        (f"{signed(rotation.angle):>5}  ", "strong"),
        (f"▕{left}┃{right}▏", ""),
        (" any angle to ±170°", "quiet"),
    )


def _rate(rotation: RotationStatus) -> Line:
    limit = rotation.range_limit
    words = f"{_whole(rotation.rate)} °/s, fastest {_whole(rotation.fastest)}"
    if limit is None:
        return (" rate    ", "quiet"), (words, ""), (", range not known", "quiet")
    share = rotation.fastest / limit
    fast = "▲ too fast: it would clip" if rotation.range_known else "▲ may clip"
    verdict: Span = ("good", "good") if share < 0.9 else (fast, "warn")
    usual = "" if rotation.range_known else " (usual)"
    return (
        (" rate    ", "quiet"),
        (f"{words}, range {_whole(limit)}{usual}  ", ""),
        (bar(share, 14) + " ", ""),
        verdict,
    )


def _whole(value: float) -> str:
    return f"{value:.0f}".replace("-0", "0").replace("-", "−")


def _done(rotation: RotationStatus) -> Line:
    angles = " ".join(signed(angle) for angle in rotation.done[-8:])
    head = f" done    {len(rotation.done)} of {rotation.wanted}  "
    return (head, "quiet"), (angles, "strong")


def _wanted(rotation: RotationStatus) -> Line:
    speeds = rotation.speeds >= _SPEEDS
    some = "" if speeds else f" ({rotation.speeds} so far)"
    return (
        (" wanted  ", "quiet"),
        (f"both senses {_tick(rotation.senses)}", _tone(rotation.senses)),
        (f"   three speeds {_tick(speeds)}{some}", _tone(speeds)),
        (f"   {rotation.advice}", "accent"),
    )


def _tick(done: bool) -> str:
    return "✓" if done else "✗"


def _tone(done: bool) -> str:
    return "good" if done else ""
