"""Streams as devices print them, made from numbers that are known."""

from collections.abc import Callable

import numpy as np

from imucal_wizard.acquire.intake import Intake
from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.core.readings import FloatArray, Readings, join_readings

HEADER = b"t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s],temp[degC]\r\n"


def at_rest(count: int, rate: float = 100.0, seed: int = 1) -> FloatArray:
    """Columns t, a, g, temperature of a device that lies still, shape (count, 8)."""
    rng = np.random.default_rng(seed)
    gravity = np.array([0.1, -0.2, 9.8])
    return np.column_stack(
        (
            np.arange(count) / rate + 3.0,
            gravity + rng.normal(0, 0.02, (count, 3)),
            rng.normal(0.01, 0.002, (count, 3)),
            np.full(count, 24.5),
        )
    )


def printed(values: FloatArray, form: str = "%.6f", separator: str = ",") -> bytes:
    """Rows as lines."""
    return "".join(separator.join(form % v for v in row) + "\r\n" for row in values).encode()


def contract(count: int, rate: float = 100.0) -> bytes:
    """The CSV of the virtual IMU: header and rows."""
    return HEADER + printed(at_rest(count, rate))


def read(data: bytes, setup: StreamSetup | None = None, chunk: int = 64) -> tuple[Intake, Readings]:
    """Everything a stream says, fed in chunks that arrive as they would at 115200 baud."""
    intake = Intake(setup)
    return intake, feed(intake, data, chunk)


def feed(intake: Intake, data: bytes, chunk: int = 64, start: float = 100.0) -> Readings:
    """What an Intake makes of these bytes."""
    parts = []
    for place in range(0, len(data), chunk):
        arrival = start + (place + chunk) / 11520
        parts.append(intake.feed(data[place : place + chunk], arrival))
    parts.append(intake.flush())
    there = [part for part in parts if part is not None]
    return join_readings(there) if there else _NOTHING


def warned(values: FloatArray, header: bytes = HEADER, form: str = "%.6f") -> str:
    """All warnings about a stream of these rows."""
    data = header + printed(values, form)
    intake = Intake(compare_arrivals=False)
    feed(intake, data)
    assert intake.samples > 0
    return " | ".join(intake.warnings)


def spoilt(change: Callable[[FloatArray], None], count: int = 1200) -> FloatArray:
    """A device at rest with one thing wrong."""
    values = at_rest(count)
    change(values)
    return values


def same(one: Readings, other: Readings) -> bool:
    """Whether two readings agree to the last bit."""
    pairs = [
        (getattr(one, name), getattr(other, name))
        for name in ("accelerometer", "gyroscope", "magnetometer", "temperature")
    ]
    return all(
        (a is None and b is None)
        or (
            a is not None
            and b is not None
            and a.unit == b.unit
            and np.array_equal(a.time, b.time)
            and np.array_equal(a.values, b.values)
        )
        for a, b in pairs
    )


def _nothing() -> Readings:
    from imucal_wizard.core.readings import Series

    return Readings(Series(np.zeros(0), np.zeros((0, 3)), ""))


_NOTHING = _nothing()
