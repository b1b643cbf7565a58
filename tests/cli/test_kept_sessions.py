"""``fit``, ``bench`` and ``compare`` of a session: what the operator let stand counts."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from imucal_wizard.acquire.setup import StreamSetup
from imucal_wizard.cli import main as cli
from imucal_wizard.sessions import Session
from tests.cli.kept_sessions import printed, sat

Capture = pytest.CaptureFixture[str]


def fit(capsys: Capture, path: Path, *options: str) -> dict[str, Any]:
    """What ``fit --json -`` writes, without the verdict's cost."""
    assert cli.main(["fit", str(path), "--no-verdict", *options, "--json", "-"]) == 0
    document: dict[str, Any] = json.loads(capsys.readouterr().out)
    return document


def starts(document: dict[str, Any]) -> list[float]:
    """When the holds of a fit began."""
    return [hold["start"] for hold in document["holds"]]


def test_the_holds_fitted_are_those_the_wizard_kept(tmp_path: Path, capsys: Capture) -> None:
    """The same holds and rotations as on the result's screen, and no word of warning."""
    path = tmp_path / "a.imucal"
    kept = sat(path).collected()
    document = fit(capsys, path)
    assert starts(document) == [hold.start for hold in kept.holds]
    assert len(document["rotations"]) == len(kept.rotations)
    assert document["warnings"] == []


def test_what_was_taken_back_counts_no_more(tmp_path: Path, capsys: Capture) -> None:
    """An undo in the poses: its hold is not fitted, and with --all-samples it is again."""
    path = tmp_path / "a.imucal"
    kept = sat(path, {0.4: ("undo",)}).collected()
    document, everything = fit(capsys, path), fit(capsys, path, "--all-samples")
    assert starts(document) == [hold.start for hold in kept.holds]
    gone = [
        start
        for start in starts(everything)[1:-1]
        if not any(abs(start - own) < 1.5 for own in starts(document))
    ]
    assert len(gone) == 1
    assert any("taken back or repeated once" in text for text in everything["warnings"])


def test_holds_of_the_validation_are_not_fitted(tmp_path: Path, capsys: Capture) -> None:
    """They are what the calibration is held against; the fit must not have seen them."""
    path = tmp_path / "a.imucal"
    kept = sat(path, {0.55: ("goto result", "validate")}).collected()
    assert kept.validation
    document = fit(capsys, path)
    fitted = starts(document)
    assert len(fitted) == len(kept.holds)
    assert not {hold.start for hold in kept.validation} & set(fitted)
    assert document["sensors"]["accelerometer"]["rms_validation"] > 0.0


def test_a_session_left_in_the_middle_counts_as_far_as_it_came(
    tmp_path: Path, capsys: Capture
) -> None:
    """And says where it was left, and how to take everything."""
    path = tmp_path / "a.imucal"
    kept = sat(path, share=0.6).collected()
    document = fit(capsys, path)
    assert starts(document) == pytest.approx([hold.start for hold in kept.holds])
    (warning,) = [text for text in document["warnings"] if "was left in the step" in text]
    assert "poses" in warning
    assert "read it with all samples" in warning


def test_a_session_that_kept_too_little_is_taken_as_a_recording(
    tmp_path: Path, capsys: Capture
) -> None:
    """The wizard never left its preview: the reason, then the fit of all samples."""
    path = tmp_path / "a.imucal"
    assert not sat(path, {0.5: ("undo",)}, start=False).collected().holds
    document = fit(capsys, path)
    assert len(document["holds"]) > 18
    assert any("samples of the session are used instead" in text for text in document["warnings"])
    assert any("taken back or repeated once" in text for text in document["warnings"])


def test_a_session_that_determines_nothing_in_either_way_is_refused(
    tmp_path: Path, capsys: Capture
) -> None:
    path = tmp_path / "a.imucal"
    sat(path, share=0.05)
    assert cli.main(["fit", str(path), "--json", "-"]) == 1
    assert json.loads(capsys.readouterr().out)["sensors"] == {}


def test_gravity_is_that_of_the_session_unless_another_is_given(
    tmp_path: Path, capsys: Capture
) -> None:
    path = tmp_path / "a.imucal"
    sat(path, gravity=9.83)
    assert fit(capsys, path)["gravity"] == 9.83
    assert fit(capsys, path, "--gravity", "9.79")["gravity"] == 9.79


def test_a_unit_given_now_goes_over_the_one_of_the_session(tmp_path: Path, capsys: Capture) -> None:
    """The rates were said to be in deg/s and are in rad/s: no need to measure again."""
    path = tmp_path / "a.imucal"
    plain = printed().replace(b"[rad/s]", b"")
    sat(path, setup=StreamSetup(gyroscope_unit="deg/s"), data=plain)
    wrong = fit(capsys, path)["sensors"]["gyroscope"]["matrix"]
    right = fit(capsys, path, "--gyro-unit", "rad/s")["sensors"]["gyroscope"]["matrix"]
    assert np.diag(wrong) == pytest.approx(np.degrees(np.diag(right)), rel=1e-3)


@pytest.mark.usefixtures("rough_sizes")
@pytest.mark.study
def test_bench_and_compare_look_at_the_same_holds(tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "a.imucal"
    kept = sat(path, {0.4: ("undo",)}).collected()
    assert cli.main(["bench", str(path)]) == 0
    text = capsys.readouterr().out
    rows = text.split("COMPARE")[1].split("SUSPECTS")[0].strip().splitlines()[1:]
    assert len([row for row in rows if row.strip()]) == len(kept.holds)
    assert cli.main(["compare", str(path), "--json", "-"]) == 0
    methods = json.loads(capsys.readouterr().out)["sensors"]["accelerometer"]
    first = next(row for row in methods if row["method"] == "least_squares")
    fitted = fit(capsys, path)["sensors"]["accelerometer"]["rms_fitted"]
    assert first["result"]["rms_fitted"] == pytest.approx(fitted)


def test_a_session_can_be_fitted_while_it_is_being_written(tmp_path: Path, capsys: Capture) -> None:
    path = tmp_path / "a.imucal"
    sat(path)
    with Session.open(path):
        assert fit(capsys, path)["holds"]
