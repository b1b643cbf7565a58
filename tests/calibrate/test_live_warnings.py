"""What is noticed while measuring stands beside the result too, on the screen and in the file."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from imucal_wizard.core.readings import FloatArray
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.report.calibration_record import from_report
from imucal_wizard.report.document import fit_document
from imucal_wizard.run.engine import Engine
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.panels.report import fit_summary
from imucal_wizard.tui.services import WizardServices
from tests.run.performance import pieces, recorded, settings
from tests.tui.terminals import printed


def _lines(change: Callable[[FloatArray], FloatArray]) -> bytes:
    """The performance with its table of time, forces, rates and temperature changed."""
    lines = recorded().decode().splitlines()
    head = [line for line in lines if line[0] in "#t"]
    table = np.array([line.split(",") for line in lines if line[0] not in "#t"], float)
    rows = [",".join(f"{value:.6f}" for value in row) for row in change(table)]
    return "\n".join([*head, *rows, ""]).encode()


def _measured(data: bytes) -> FitReport:
    """The result of the wizard on these bytes."""
    engine = Engine(settings=settings())
    engine.command("start")
    for arrival, piece in pieces(data, 4096):
        engine.receive(piece, arrival)
    engine.end()
    return WizardServices(WizardOptions()).fit(engine.collected(), engine.snapshot())


def _clipped(table: FloatArray) -> FloatArray:
    table[:, 4:7] = np.clip(table[:, 4:7], -2.2, 2.2)
    return table


def _softly_clipped(table: FloatArray) -> FloatArray:
    """Clipped at 60 °/s before a filter and noise: no two readings on the plateau are equal."""
    end, chance = np.radians(60.0), np.random.default_rng(3)
    table[:, 4:7] = uniform_filter1d(np.clip(table[:, 4:7], -end, end), 3, axis=0)
    table[:, 4:7] += np.radians(0.2) * chance.standard_normal((len(table), 3))
    return table


def _narrow(table: FloatArray) -> FloatArray:
    table[:, 3] = np.clip(table[:, 3], -9.6, 9.6)
    return table


def _thinned(table: FloatArray) -> FloatArray:
    return table[np.random.default_rng(0).random(len(table)) > 0.03]


def _later(table: FloatArray) -> FloatArray:
    table[len(table) // 2 :, 0] += 5000.0
    return table


def _twice(table: FloatArray) -> FloatArray:
    again = np.repeat(table, 2, axis=0)
    again[1::2, 0] += np.diff(table[:2, 0]) / 2.0
    return again


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (_clipped, ("the gyroscope reaches the end of its range", "turn more slowly")),
        (_clipped, ("rotations are not used", "clipped at the end of its range")),
        (_softly_clipped, ("the gyroscope reaches the end of its range", "turn more slowly")),
        (_narrow, ("accelerometer's z axis reads 9.6 ", "the end of its range")),
        (_thinned, ("More than one sample in a hundred is missing",)),
        (_later, ("time jumped by more than an hour",)),
        (_twice, ("repeat",)),
    ],
)
def test_it_is_said_again_with_the_result(
    change: Callable[[FloatArray], FloatArray], words: tuple[str, ...]
) -> None:
    """In the report's warnings, in ``fit --json``, in the saved file and on the result screen."""
    report = _measured(_lines(change))
    # what is wrong is said once, with the place in the recording where that is known
    assert sum("range in the device" in text for text in report.warnings) <= 1
    saved = from_report(report, "a test", "2024-01-01T00:00:00+00:00")
    for texts in (report.warnings, fit_document(report)["warnings"], saved.warnings):
        assert any(all(word in text for word in words) for text in texts), texts
    shown = " ".join(printed(fit_summary(report, {}, {})).split())
    assert all(word in shown for word in words)


def test_a_faultless_stream_says_nothing_of_the_kind() -> None:
    """The same performance as it was: no word of streams or rotations."""
    report = _measured(recorded())
    words = ("not used", "sample", "end of its range")
    assert not any(word in text for text in report.warnings for word in words)
