"""Noise of known coefficients, synthesised from its spectrum: nothing of the program is used."""

import numpy as np

from imucal_wizard.core.readings import FloatArray


def power_law_noise(
    rng: np.random.Generator,
    count: int,
    rate: float,
    *,
    white: float,
    flicker: float = 0.0,
    walk: float = 0.0,
) -> FloatArray:
    """Noise of one axis, shape (count,), after IEEE 952, annex B.

    White noise N has the two-sided spectrum N², flicker noise ``B²/(2π f)``, the random walk is the
    sum of independent steps ``K/√rate``.
    """
    found = white * np.sqrt(rate) * rng.standard_normal(count)
    if flicker:
        # of twice the length, so that the ends are not alike
        frequency = np.fft.rfftfreq(2 * count, 1.0 / rate)[1:]
        amplitude = np.sqrt(flicker**2 / (2.0 * np.pi * frequency))
        phases = rng.standard_normal(len(frequency)) + 1j * rng.standard_normal(len(frequency))
        spectrum = np.concatenate([[0.0], amplitude * phases / np.sqrt(2.0)])
        found += np.fft.irfft(spectrum, 2 * count)[:count] * np.sqrt(2 * count * rate)
    if walk:
        found += np.cumsum(walk / np.sqrt(rate) * rng.standard_normal(count))
    return np.asarray(found)


def three_axes(seed: int, count: int, rate: float, **parts: float) -> FloatArray:
    """Three independent axes, shape (count, 3)."""
    rng = np.random.default_rng(seed)
    return np.column_stack([power_law_noise(rng, count, rate, **parts) for _ in range(3)])


def csv_of(time: FloatArray, force: FloatArray, rate: FloatArray | None = None) -> bytes:
    """A recording as text."""
    names, columns = "t[s],ax[m/s^2],ay[m/s^2],az[m/s^2]", [time, *force.T]
    if rate is not None:
        names, columns = f"{names},gx[rad/s],gy[rad/s],gz[rad/s]", [*columns, *rate.T]
    rows = zip(*(column.tolist() for column in columns), strict=True)
    lines = [",".join([f"{row[0]:.4f}", *(f"{value:.7f}" for value in row[1:])]) for row in rows]
    return "\n".join([names, *lines, ""]).encode()
