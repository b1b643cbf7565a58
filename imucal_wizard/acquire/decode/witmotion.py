"""WitMotion's binary frames: ``55 | type | four int16 | sum``, several types per sample.

Source: the protocol in the vendor's data sheets (WT901 and others), USB, serial and Bluetooth SPP.
"""

import struct
from collections import Counter
from itertools import pairwise

from imucal_wizard.acquire.decode.base import Column, Format, axes
from imucal_wizard.acquire.decode.frames import FrameDecoder, FrameDetector, FrameShape, sum8

_FRAME_BYTES = 11
_TYPES = range(0x50, 0x60)
_ACCELERATION, _RATE, _FIELD = 0x51, 0x52, 0x54
_USED = {
    _ACCELERATION: (
        (16.0 / 32768.0, 16.0 / 32768.0, 16.0 / 32768.0, 0.01),
        (*axes("a", "g"), Column("temp", "degC", "temp")),
    ),
    _RATE: (
        (2000.0 / 32768.0,) * 3,
        axes("g", "deg/s"),
    ),
    _FIELD: ((1.0,) * 3, axes("m", "count")),
}
"""Factors and columns of the numbers in each frame type. The scale of the magnetometer differs
between models, so it stays in counts."""
_LEARNED_CYCLES = 3
"""Whole samples from which the frame types of a sample are learned."""


def _length(header: bytes) -> int:
    return _FRAME_BYTES if header[1] in _TYPES else 0


SHAPE = FrameShape(
    sync=b"\x55",
    header=2,
    length=_length,
    valid=sum8,
)


class WitMotionDecoder(FrameDecoder):
    """One sample is one cycle of frame types; the last type in use completes it.

    Args:
        columns: the columns, if the user has named them differently.
    """

    def __init__(self, columns: tuple[Column, ...] = ()) -> None:
        super().__init__("witmotion", SHAPE)
        self._override = columns
        self._types: tuple[int, ...] = ()
        self._learning: list[tuple[bytes, bool]] = []
        self._sample: dict[int, list[float]] = {}
        self._incomplete = False

    def broken(self) -> None:
        """Drop the unfinished frame and sample after a break of the link."""
        super().broken()
        self._sample.clear()

    def _read(self, frame: bytes, gap: bool) -> None:
        if self._types:
            self._take(frame, gap)
        else:
            self._learn(frame, gap)

    def _learn(self, frame: bytes, gap: bool) -> None:
        """Wait for several whole cycles, which show the frame types of a sample."""
        self._learning.append((frame, gap))
        types = [one[1] for one, _ in self._learning]
        starts = [i for i, kind in enumerate(types) if kind == _ACCELERATION]
        if len(starts) <= _LEARNED_CYCLES:
            del self._learning[: -_LEARNED_CYCLES * len(_TYPES)]
            return
        cycles = Counter(
            tuple(kind for kind in dict.fromkeys(types[a:b]) if kind in _USED)
            for a, b in pairwise(starts)
        )
        # a cycle that lost a frame is rarer than whole ones, or shorter
        self._types = max(cycles, key=lambda cycle: (cycles[cycle], len(cycle)))
        own = tuple(column for kind in self._types for column in _USED[kind][1])
        self.columns = self._override if len(self._override) == len(own) else own
        waiting, self._learning = self._learning[starts[0] :], []
        for one in waiting:
            self._take(*one)

    def _take(self, frame: bytes, gap: bool) -> None:
        """Take one frame; drop a sample if one of its frames was lost."""
        kind = frame[1]
        if kind not in self._types:
            return
        if self._sample and (gap or kind in self._sample):
            self._drop()
        elif gap and kind == self._types[0]:
            self._malformed += 1  # garbage between two samples
        if kind == self._types[0]:
            self._incomplete = False
        elif not self._sample:
            self._drop()
            return
        factors = _USED[kind][0]
        numbers = struct.unpack_from("<4h", frame, 2)
        self._sample[kind] = [n * f for n, f in zip(numbers, factors, strict=False)]
        if kind != self._types[-1]:
            return
        if len(self._sample) < len(self._types):
            self._drop()
            return
        self._row([value for one in self._types for value in self._sample[one]])
        self._sample.clear()

    def _drop(self) -> None:
        """Count an incomplete sample once."""
        if not self._incomplete:
            self._lost()
        self._incomplete = True
        self._sample.clear()


FORMATS = (
    Format(
        "witmotion",
        "WitMotion, binary frames 0x55 0x51 … (USB, serial, Bluetooth SPP)",
        lambda columns, _whole: WitMotionDecoder(columns),
        lambda _columns: FrameDetector(SHAPE),
        "WitMotion devices zero their gyroscope at rest unless automatic calibration is switched "
        "off (register 0x63 = 1).",
        rank=0,
        binary=True,
    ),
)
