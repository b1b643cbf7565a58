"""An effect whose fit does not converge: the bench goes on without it and says so."""

import numpy as np
import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.diagnose.bench import Bench, entries_of
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.diagnose.profile_likelihood import most_likely_setting
from imucal_wizard.diagnose.survey import diagnose_benches
from imucal_wizard.diagnose.verdict import Verdict
from imucal_wizard.estimate.experiment import Experiment
from imucal_wizard.estimate.fit import Minimum, refined_minimum
from imucal_wizard.estimate.result import SensorFit
from imucal_wizard.model.effects.second_order import SecondOrder
from imucal_wizard.model.effects.warm_up import WarmUp
from imucal_wizard.model.formula import FormulaEffect
from imucal_wizard.model.terms import Term
from tests.diagnose.recordings import fitted
from tests.model.restless import restless

BASE = ("bias", "scale", "non-orthogonality")
REFUSED = "econd-order cannot be fitted to these data"

pytestmark = pytest.mark.usefixtures("no_sizes_throughout")


@pytest.fixture
def bench() -> Bench:
    """Of an accelerometer whose x axis bends by 5 mg/g²."""
    return Benches(*fitted("second-order:5:x")).accelerometer


def test_it_is_refused_in_words_and_the_bench_keeps_its_model(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    restless(monkeypatch, SecondOrder)
    with pytest.raises(DataError, match=f"^s{REFUSED}: the fit of the accelerometer with it"):
        bench.add("second-order")
    bench.add("third-order")
    with pytest.raises(DataError, match=r"^third-order and second-order .* together"):
        bench.add("second-order")
    assert bench.fit.model == (*BASE, "third-order")


def test_what_adds_by_itself_leaves_it_out_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    benches = Benches(*fitted("second-order:5:x"))
    restless(monkeypatch, SecondOrder)
    said = diagnose_benches(benches, {}, automatic=True)[0]
    assert said.verdict is Verdict.UNEXPLAINED
    assert f"S{REFUSED}" in said.says
    assert said.added == ()
    assert benches.accelerometer.fit.model == BASE


def test_a_part_of_the_base_that_cannot_be_fitted_stays_out(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    report, readings = fitted("second-order:5:x")
    benches = Benches(report, readings, {"accelerometer": ("bias", "scale")})
    benches.accelerometer.add("second-order")
    restless(monkeypatch, SecondOrder)
    said = diagnose_benches(benches, {}, automatic=True)[0]
    assert f"S{REFUSED}" in said.says
    assert "non-orthogonality" not in benches.accelerometer.fit.model


def test_more_data_that_refuse_it_are_said_to(monkeypatch: pytest.MonkeyPatch) -> None:
    first = Benches(*fitted("second-order:5:x"))
    first.accelerometer.add("second-order")
    restless(monkeypatch, SecondOrder)
    again = Benches(*fitted("second-order:5:x", poses="26"), before=first)
    said = diagnose_benches(again, {}, automatic=False)[0]
    assert f"S{REFUSED}" in said.says
    assert again.accelerometer.fit.model == BASE


def test_a_setting_that_does_not_converge_is_no_candidate(bench: Bench) -> None:
    known = WarmUp()
    settings = known.variants(bench.measured.circumstances)

    def fit_below(most: float) -> SensorFit:
        def fit_of(term: Term) -> Minimum[Experiment]:
            if term.variant is None or term.variant > most:
                raise DataError("the fit does not converge")
            return refined_minimum(bench.measured, [term], None)

        return most_likely_setting(fit_of, Term(known, settings[0]), settings)

    found = fit_below(np.inf).terms[0].variant
    assert found is not None
    below = fit_below(0.9 * found).terms[0].variant
    assert below is not None
    assert below < found
    with pytest.raises(DataError, match="does not converge"):
        fit_below(0.0)


def test_a_formula_without_a_value_on_these_holds_is_listed_with_the_reason(
    bench: Bench,
) -> None:
    """The axis that is up reads a little more than gravity."""
    bench.offer(FormulaEffect("k*sqrt(1 - a*a)", "accelerometer", "mine"))
    entry = next(one for one in entries_of(bench, bench.look()) if one.term == "mine")
    assert "mine has no value for some of these data" in entry.lacking
    with pytest.raises(DataError, match="mine cannot be added"):
        bench.add("mine")
