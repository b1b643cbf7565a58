"""The bench on a recording: the screen alone, without the wizard."""

from collections.abc import Callable

from imucal_wizard.bench.benches import Benches
from imucal_wizard.tui.plain_app import PlainApp
from imucal_wizard.tui.screens.bench_screen import BenchScreen


class BenchApp(PlainApp[None]):
    """Only the bench.

    Args:
        make: makes the benches; called in a thread.
    """

    TITLE = "imucal-wizard bench"

    def __init__(self, make: Callable[[], Benches]) -> None:
        super().__init__()
        self._make = make

    def on_mount(self) -> None:
        """Open it."""
        self.push_screen(BenchScreen(self._make), lambda _none: self.exit())


def run_bench(benches: Benches) -> int:
    """Open the bench's screen and stay until it is left.

    Args:
        benches: of the recording.

    Returns:
        Exit status.
    """
    app = BenchApp(lambda: benches)
    app.run()
    return app.return_code or 0
