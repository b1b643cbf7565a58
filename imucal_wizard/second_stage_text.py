"""The second stage as text and as JSON."""

from typing import Any

import numpy as np

from imucal_wizard.digits import finite
from imucal_wizard.solver.second_stage.found import Headings, SecondStage
from imucal_wizard.solver.second_stage.heading import turned

SIDED = 10.0
"""Degrees of dip from which it tells the one half of the Earth from the other."""
MOST_HEADINGS = 6
"""Still positions shown in the text; the JSON has all of them."""


def second_stage_lines(stage: SecondStage) -> list[str]:
    """Alignment, clocks, what the gyroscope gains, headings; lines of at most 80 columns."""
    alignment = stage.alignment
    dip, doubt, rms = np.degrees([alignment.dip, alignment.dip_error, alignment.rms])
    used = int(alignment.used.sum())
    where = f"the same in {used} still positions to {rms:.2f}°"
    lines = [
        "SECOND STAGE  the sensors by one another",
        f"  dip {dip:.2f} ± {doubt:.2f}°, {where}",
    ]
    if abs(dip) > SIDED:
        here, there = ("north", "south") if dip > 0.0 else ("south", "north")
        # m and −m tell the same of gravity and of every turn: only the user knows which it is
        lines.append(
            f"  that is {here} of the magnetic equator: if you are {there}, an axis is mirrored"
        )
    left = len(alignment.used) - used
    if left:
        lines.append(f"  {left} still positions do not fit and were left out (iron near them?)")
    if stage.clock is not None:
        late = f"{1e3 * stage.clock.seconds:+.2f}".replace("-", "−")
        error = f"{1e3 * stage.clock.standard_error:.2f}"
        lines.append(f"  the magnetometer's clock is {late} ± {error} ms off the gyroscope's")
    lines += _gyroscope(stage) + _headings(stage.headings)
    return lines + [f"  {note}" for note in stage.notes]


def _gyroscope(stage: SecondStage) -> list[str]:
    added = stage.added
    if added is None:
        return []
    before, after = np.degrees([added.heading_before, added.heading_after])
    tilt = np.degrees([added.tilt_before, added.tilt_after])
    lines = [
        f"  gyroscope over {added.turns} turns, those about the vertical included, held out:",
        f"    closure about the vertical {before:.3f}° by gravity alone, {after:.3f}° by both",
        f"    closure across it          {tilt[0]:.3f}° by gravity alone, {tilt[1]:.3f}° by both",
    ]
    if added.standard_errors is not None:
        share = 100.0 * added.standard_errors
        lines.append(f"    standard errors of its gains are {share:.0f} % of what they were")
    return lines


def _headings(headings: Headings) -> list[str]:
    """Rms over all positions, and the first few."""
    change, expected = heading_summary(headings)
    if not np.isfinite(change):
        return []
    lines = [
        "  heading of the x axis, tilt-compensated, before and after the calibration:",
        f"    they differ by {np.degrees(change):.1f}° rms, error left {np.degrees(expected):.2f}°",
    ]
    seen = np.flatnonzero(np.isfinite(headings.after) & np.isfinite(headings.before))
    for index in seen[:MOST_HEADINGS]:
        before, after, error = np.degrees(
            [headings.before[index], headings.after[index], headings.error[index]]
        )
        lines.append(
            f"    hold {headings.hold[index] + 1:3}: before {before % 360.0:6.1f}°, after "
            f"{after % 360.0:6.1f} ± {error:.2f}°"
        )
    return lines


def heading_summary(headings: Headings) -> tuple[float, float]:
    """Rms change of heading by the calibration, and rms of the error expected after it, rad."""
    change = turned(headings.after, headings.before)
    seen = np.isfinite(change)
    if not seen.any():
        return float("nan"), float("nan")
    return (
        float(np.sqrt(np.mean(change[seen] ** 2))),
        float(np.sqrt(np.mean(headings.error[seen] ** 2))),
    )


def second_stage_document(stage: SecondStage) -> dict[str, Any]:
    """The same for scripts, in rad and s."""
    alignment, added, headings = stage.alignment, stage.added, stage.headings
    return {
        "rotation": alignment.rotation.tolist(),
        "rotation_covariance": alignment.covariance.tolist(),
        "dip": alignment.dip,
        "dip_standard_error": alignment.dip_error,
        "dip_rms": alignment.rms,
        "positions": int(alignment.used.sum()),
        "clock_offset": None
        if stage.clock is None
        else {"seconds": stage.clock.seconds, "standard_error": stage.clock.standard_error},
        "gyroscope": None
        if added is None
        else {name: getattr(added, name) for name in added.__dataclass_fields__},
        "headings": [
            {"hold": int(hold), "before": finite(b), "after": finite(a), "error": finite(e)}
            for hold, b, a, e in zip(
                headings.hold, headings.before, headings.after, headings.error, strict=True
            )
        ],
        "notes": list(stage.notes),
    }
