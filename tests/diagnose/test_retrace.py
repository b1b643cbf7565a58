"""More data for the same session: the models that were found are kept, and judged anew."""

from dataclasses import replace

import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.model.formula import FormulaEffect
from tests.diagnose.recordings import fitted, refitted


def test_the_ladder_is_climbed_again_on_more_data() -> None:
    first = Benches(*fitted("second-order:5:x"))
    bench = first.accelerometer
    bench.remove("scale")
    bench.add("scale")
    bench.add("second-order")
    more = Benches(*fitted("second-order:5:x", poses="26"), before=first).accelerometer
    assert [rung.added for rung in more.ladder] == [None, None, "scale", "second-order"]
    assert [rung.model for rung in more.ladder] == [rung.model for rung in bench.ladder]
    assert len(more.measured.circumstances) > len(bench.measured.circumstances)
    assert more.fit.sizes[0][0] == pytest.approx(5.0, abs=0.3)
    assert more.undo()
    assert more.fit.model == ("bias", "scale", "non-orthogonality")


def test_an_effect_of_ones_own_is_still_a_suspect() -> None:
    first = Benches(*fitted("second-order:5:x"))
    first.accelerometer.offer(FormulaEffect("k * a**3", "accelerometer", "mine"))
    first.accelerometer.add("mine")
    more = Benches(*fitted("second-order:5:x", poses="26"), before=first).accelerometer
    assert more.fit.model[-1] == "mine"


def test_what_the_other_data_cannot_show_is_left_out_with_the_reason() -> None:
    report, readings = fitted("second-order:5:x")
    first = Benches(report, readings)
    first.accelerometer.add("bias-temperature")
    cold = refitted(report, [replace(hold, temperature=None) for hold in report.holds])
    other = Benches(cold, before=first).accelerometer
    assert "bias-temperature" not in other.fit.model
    (why,) = other.refused
    assert why.startswith("bias-temperature cannot be added: ")


def test_a_term_that_was_refused_once_and_taken_out_later_is_refused_no_more(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fails(*_: object) -> None:
        raise DataError("it does not converge")

    bench = Benches(*fitted("second-order:5:x")).accelerometer
    with monkeypatch.context() as patched:
        patched.setattr("imucal_wizard.diagnose.bench.refined_minimum", fails)
        with pytest.raises(DataError):
            bench.add("second-order")
    assert bench.refused == ("it does not converge",)
    bench.add("second-order")
    bench.remove("second-order")
    assert not bench.refused
