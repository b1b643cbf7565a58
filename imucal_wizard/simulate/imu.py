"""The virtual IMU as a source that makes its samples when it is read.

It has no thread of its own, and makes no sample that is not read. The samples depend on the seed
and on the actions of the hand, never on the speed or the pieces of reading.
"""

import math
import time
from collections.abc import Iterable

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.instruction import Instruction
from imucal_wizard.core.units import COUNT
from imucal_wizard.simulate.forward import STEP_TIME
from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.hidden import (
    Hidden,
    check_sensors,
    draws_current,
    needs_shaking,
    parse_hidden,
)
from imucal_wizard.simulate.magnetometer import TrueField, VirtualMagnetometer
from imucal_wizard.simulate.samples import VirtualLoad, VirtualSamples, VirtualStream
from imucal_wizard.simulate.sensor import SensorModel

HEADER_PERIOD_SECONDS = 5.0
"""Time between two headers, s, for readers that start late."""
READ_TICK_SECONDS = 0.02
"""Time that a read waits for samples, s of the wall clock; lines arrive in pieces of this
length."""
MAX_SAMPLES_PER_READ = 512
"""Samples of one read at most, so that a read is short at unlimited speed."""
MAX_CATCH_UP_SECONDS = 0.25
"""Time that the device catches up after a pause, s of the wall clock; after longer pauses it is
late."""


class VirtualImu:
    """A virtual IMU that prints one line per sample.

    Args:
        rate: samples per second of device time.
        seed: seed of the sensor's errors, the noise and the hand.
        hand_seed: seed of the hand, if it is another one.
        speed: device seconds per second of the wall clock; ``inf`` for unlimited speed.
        sensor: the sensor; drawn from the seed if not given.
        hidden: additional effects of the sensor, parsed or as ``TERM:SIZE:AXIS``.
        magnetometer: whether it has a magnetometer, drawn from the seed.
        ammeter: whether it always measures the board's current.
        following: whether the hand follows the procedure's instructions.
        bias_step: time of a ``bias-step`` and a ``scale-step``, minutes.
        line_end: line end.

    Attributes:
        hand: the hand that moves the device.
        speed: speed, as above; may be changed at any time.
        sensor: the sensor's true parameters.
        stream: source of its samples.
        printer: printer of its lines.
        description: description of the source.

    Raises:
        UsageError: a hidden effect cannot be parsed or belongs to a missing sensor, or a rate or
            speed is impossible.
    """

    description = "virtual IMU"

    def __init__(
        self,
        rate: float = 100.0,
        seed: int = 0,
        speed: float = 1.0,
        sensor: SensorModel | None = None,
        hidden: Iterable[Hidden | str] = (),
        *,
        hand_seed: int | None = None,
        magnetometer: bool = False,
        ammeter: bool = False,
        following: bool = False,
        bias_step: float = STEP_TIME,
        line_end: str = "\r\n",
    ) -> None:
        if not speed > 0.0:
            raise UsageError(f"a speed of {speed:g} is impossible; give one like 1 or 20")
        self.speed = speed
        self.sensor = SensorModel.drawn(seed) if sensor is None else sensor
        effects = [parse_hidden(h) if isinstance(h, str) else h for h in hidden]
        check_sensors(effects, magnetometer=magnetometer)
        moved_by = seed if hand_seed is None else hand_seed
        self.hand = VirtualHand(rate, moved_by, shaken=needs_shaking(effects), following=following)
        load = VirtualLoad(seed) if ammeter or draws_current(effects) else None
        field = VirtualMagnetometer(TrueField.drawn(seed), seed) if magnetometer else None
        self.stream = VirtualStream(
            self.hand,
            self.sensor,
            effects,
            rate=rate,
            seed=seed,
            step=bias_step,
            magnetometer=field,
            load=load,
        )
        self.printer = LinePrinter(self.sensor, line_end, field=magnetometer, load=load is not None)
        self._rate = rate
        self._header_in = 0
        self._owed = 0.0
        self._last = time.monotonic()

    def open(self) -> None:
        """Begin to print with a header; no time has passed since the last read."""
        self.print_header()
        self._owed, self._last = 0.0, time.monotonic()

    def reopen(self) -> bool:
        """Always True: the link cannot be lost."""
        return True

    def close(self) -> None:
        """Nothing to close."""

    def print_header(self) -> None:
        """Print the header again before the next line."""
        self._header_in = 0

    def read(self, timeout: float = READ_TICK_SECONDS) -> bytes:
        """The lines that are due by the wall clock; waits at most ``timeout`` seconds for some.

        Returns:
            Whole lines; nothing while the device stands still (see ``VirtualHand``).
        """
        ahead = self.hand.ahead
        if ahead == 0 and self.hand.unattended:
            time.sleep(timeout)
            self._owed, self._last = 0.0, time.monotonic()
            return b""
        due = self._due(min(timeout, READ_TICK_SECONDS))
        self._owed = max(0.0, self._owed - due)
        # while the procedure requests something, the device does not wait for it
        return self._lines(min(due, ahead) if ahead else due)

    def rest(self) -> bytes:
        """The lines that remain before the device stands still; empty if it does not."""
        return self._lines((self.hand.ahead or 0) if self.hand.unattended else 0)

    @property
    def waiting(self) -> bool:
        """Whether it stands still until the next instruction."""
        return self.hand.unattended and self.hand.ahead == 0

    def follow(self, instruction: Instruction, samples: int) -> None:
        """Pass an instruction to the hand, given after ``samples`` of the device's samples."""
        if self.hand.following:
            self.hand.follow(instruction, samples)

    def _due(self, wait: float) -> int:
        """Number of samples due by the wall clock; waits if there are none."""
        if math.isinf(self.speed):
            return MAX_SAMPLES_PER_READ
        per_second = self._rate * self.speed
        if self._owed < 1.0:
            time.sleep(wait)
        now = time.monotonic()
        owed = self._owed + (now - self._last) * per_second
        self._owed, self._last = min(owed, max(1.0, MAX_CATCH_UP_SECONDS * per_second)), now
        return min(int(self._owed), MAX_SAMPLES_PER_READ)

    def _lines(self, n: int) -> bytes:
        """The next ``n`` lines, with the header where it is due."""
        parts = []
        while n > 0:
            if self._header_in <= 0:
                parts.append(self.printer.header)
                self._header_in = max(1, round(HEADER_PERIOD_SECONDS * self._rate))
            count = min(n, self._header_in)
            parts.append(self.printer.lines(self.stream.take(count)))
            self._header_in -= count
            n -= count
        return b"".join(parts)


class LinePrinter:
    """Formats samples as lines.

    Args:
        sensor: the sensor, which determines the units of the columns.
        end: line end; Arduino's by default.
        field: whether there are columns of a magnetometer, empty without a new sample.
        load: whether there is a column of the motors' current.
    """

    def __init__(
        self,
        sensor: SensorModel,
        end: str = "\r\n",
        *,
        field: bool = False,
        load: bool = False,
    ) -> None:
        force, rate = sensor.accelerometer.unit, sensor.gyroscope.unit
        names = ["t[s]"]
        names += [f"a{axis}[{force}]" for axis in "xyz"]
        names += [f"g{axis}[{rate}]" for axis in "xyz"]
        names += [f"m{axis}[uT]" for axis in "xyz"] if field else []
        names += ["current[A]"] if load else []
        names += ["temp[degC]"]
        self.header = (",".join(names) + end).encode()
        acceleration = "%.0f" if force == COUNT else "%.6f"
        turning = "%.0f" if rate == COUNT else "%.7f"
        magnetic = ["%.1f"] * 3 if field else []
        electric = ["%.2f"] if load else []
        formats = ["%.6f", *[acceleration] * 3, *[turning] * 3, *magnetic, *electric, "%.3f"]
        self._format = ",".join(formats) + end

    def lines(self, samples: VirtualSamples) -> bytes:
        """The lines of these samples; formatting all of them at once is fastest."""
        columns = [samples.time, samples.accelerometer, samples.gyroscope]
        if samples.magnetometer is not None:
            columns.append(samples.magnetometer)
        if samples.current is not None:
            columns.append(samples.current)
        table = np.column_stack([*columns, samples.temperature])
        text = (self._format * len(table)) % tuple(table.ravel().tolist())
        return text.replace("nan", "").encode()
