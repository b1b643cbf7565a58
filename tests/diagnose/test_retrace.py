"""More data for the same session: the models that were found are kept, and judged anew."""

import pytest

from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.model.formula import FormulaEffect
from tests.diagnose.recordings import fitted


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
