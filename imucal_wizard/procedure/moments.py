"""The stream one block at a time: what a step of the procedure looks at and decides on."""

from dataclasses import dataclass

import numpy as np

from imucal_wizard.procedure.blocks import BlockCutter, Blocks
from imucal_wizard.procedure.stillness import WindowMaker, Windows
from imucal_wizard.readings import FloatArray, Readings, Series, joined


@dataclass(frozen=True, eq=False)
class Moment:
    """One block, the half second that ends with it, and its samples.

    Attributes:
        block: the block alone (``len(block) == 1``).
        window: the window that ends with it (``len(window) == 1``).
        time: sample times, s, shape (n,).
        acceleration: accelerometer readings, shape (n, 3).
        rate: gyroscope readings, shape (n, 3), or None without a gyroscope.
        seconds: nominal length of the block, s.
        field: the magnetometer's samples since the block before, at times of their own; None as
            long as there has been none.
    """

    block: Blocks
    window: Windows
    time: FloatArray
    acceleration: FloatArray
    rate: FloatArray | None
    seconds: float
    field: Series | None = None

    @property
    def end(self) -> float:
        """Time at which the block ends, s."""
        return float(self.block.end[0])

    @property
    def full(self) -> bool:
        """Whether the window is full, without a gap."""
        return bool(self.window.full[0])

    @property
    def mean_a(self) -> FloatArray:
        """Mean accelerometer reading of the block, shape (3,)."""
        return np.asarray(self.block.mean_a[0], float)


class MomentMaker:
    """Cuts a stream into moments; the same ones however the readings are cut."""

    def __init__(self, rate: float) -> None:
        self._cutter = BlockCutter(rate)
        self._windows = WindowMaker()
        self._seconds = self._cutter.size / rate
        self._rest: list[FloatArray] = []
        self._field: Series | None = None

    def feed(self, readings: Readings) -> list[Moment]:
        """The moments that these readings complete."""
        if not len(readings):
            return []
        columns = self._columns(readings)
        self._field = joined([self._field, readings.magnetometer])
        blocks = self._cutter.feed(readings)
        size, count = self._cutter.size, len(blocks)
        self._rest = [column[count * size :] for column in columns]
        if not count:
            return []
        windows = self._windows.feed(blocks)
        return [self._moment(blocks, windows, columns, index, size) for index in range(count)]

    def _columns(self, readings: Readings) -> list[FloatArray]:
        new = [readings.accelerometer.time, readings.accelerometer.values]
        if readings.gyroscope is not None:
            new.append(readings.gyroscope.values)
        if not self._rest:
            return new
        return [np.concatenate(pair) for pair in zip(self._rest, new, strict=True)]

    def _moment(
        self, blocks: Blocks, windows: Windows, columns: list[FloatArray], index: int, size: int
    ) -> Moment:
        row = slice(index, index + 1)
        pieces = [column[index * size : (index + 1) * size].copy() for column in columns]
        window = Windows(
            windows.std_a[row],
            None if windows.std_g is None else windows.std_g[row],
            None if windows.mean_g is None else windows.mean_g[row],
            windows.full[row],
        )
        rate = pieces[2] if len(pieces) > 2 else None
        field = self._field_until(float(pieces[0][-1]))
        return Moment(blocks.select(row), window, pieces[0], pieces[1], rate, self._seconds, field)

    def _field_until(self, last: float) -> Series | None:
        """The magnetometer's samples up to a block's last sample; what comes later waits."""
        series = self._field
        if series is None:
            return None
        count = int(np.searchsorted(series.time, last, side="right"))
        self._field = series.part(count, len(series))
        return series.part(0, count)
