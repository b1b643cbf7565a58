"""What the bench does in threads: open, add, fit again, look again; it never blocks the screen."""

from collections.abc import Callable

from textual import work

from imucal_wizard.bench.benches import Benches
from imucal_wizard.bench.session import Bench
from imucal_wizard.errors import ImucalError
from imucal_wizard.tui.bench.sight import Sight, look
from imucal_wizard.tui.screens.bench_layout import BenchLayout
from imucal_wizard.tui.threads import in_thread

Act = Callable[[Bench], object]
"""Something done to a bench in a thread."""
_ROSE = "▲ The held-out error did not fall: only the fitted one did. u takes it back."


class BenchWork(BenchLayout):
    """One thing at a time; what goes wrong is said, and the model stays as it was.

    Args:
        make: makes the benches; called in a thread.
        sensor: whose bench to look at first; "" for the first there is.
        predict: tell nothing before a guess.
    """

    def __init__(
        self, make: Callable[[], Benches], sensor: str = "", *, predict: bool = False
    ) -> None:
        super().__init__()
        self.sensor = sensor
        self.desk.hidden = predict
        self._make = make
        self._benches: Benches | None = None
        self._chosen = ""
        self.busy = "Opening the bench …"

    def begin(self) -> None:
        """Make the benches."""
        super().begin()
        self.open()

    @work
    async def open(self) -> None:
        """Make the benches and look at the first."""
        try:
            benches = await in_thread(self._make)
        except ImucalError as error:
            self.busy, self.note = "", (str(error), "bad")
            self.redraw()
            return
        self.busy, self._benches, self.sensors = "", benches, benches.sensors
        self.sensor = self.sensor if self.sensor in self.sensors else self.sensors[0]
        self.look()

    def look(self) -> None:
        """Look at the sensor chosen."""
        self.do(f"Looking for what the {self.sensor} lacks …", lambda _bench: None)

    def do(self, words: str, act: Act, choose: str = "") -> None:
        """Change the model in a thread, then look again; one thing at a time.

        Args:
            words: what is being done.
            act: does it.
            choose: the suspect to choose then.
        """
        if self._benches is not None and not self.busy:
            self.busy, self.note, self._chosen = words, ("", ""), choose
            self.redraw()
            self._work(self._benches, self.sensor, act)

    @work
    async def _work(self, benches: Benches, sensor: str, act: Act) -> None:
        try:
            sight = await in_thread(lambda: _done(benches, sensor, act))
        except ImucalError as error:
            self.note = (str(error), "bad")
        else:
            self.desk.show(sight)
            self.desk.select(self._chosen)
            if sight.rose(len(sight.ladder) - 1):
                self.note = (_ROSE, "warn")
        self.busy = ""
        self.redraw()


def _done(benches: Benches, sensor: str, act: Act) -> Sight:
    """Do it and look again; runs in a thread.

    Raises:
        ImucalError: it cannot be done, and why.
    """
    bench = benches.bench(sensor) or benches.accelerometer
    act(bench)
    return look(benches, bench)
