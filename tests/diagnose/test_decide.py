"""From probabilities to one word."""

import pytest

from imucal_wizard.diagnose.verdict import Evidence, Label, Shares, Verdict, decide_verdict
from imucal_wizard.estimate.lack_of_fit import LackOfFit

NOISE = LackOfFit(1.0, 0.5)
"""What is left where noise makes it."""


def evidence(
    present: dict[str, float],
    taken: dict[str, float] | None = None,
    strongest: float = 0.0,
    discriminability: float = 0.35,
    lack: LackOfFit = NOISE,
) -> Evidence:
    return Evidence({"nothing": 0.0, **present}, taken or {}, strongest, discriminability, lack)


@pytest.mark.parametrize(
    ("given", "verdict", "named"),
    [
        (evidence({"nothing": 0.9}), Verdict.COMPLETE, ()),
        (evidence({"even-order": 0.95}, {"even-order": 150.0}), Verdict.MISSING, ("even-order",)),
        (evidence({"even-order": 0.95}, {"even-order": 40.0}), Verdict.UNEXPLAINED, ()),
        (evidence({"disturbed": 0.95}, {"disturbed": 80.0}), Verdict.DISTURBED, ("disturbed",)),
        (evidence({"even-order": 0.5, "odd-order": 0.5}, {}, 150.0), Verdict.AMBIGUOUS, ()),
        (evidence({"unknown": 0.9}, {}, 150.0), Verdict.UNEXPLAINED, ()),
    ],
)
def test_each_verdict_has_its_evidence(
    given: Evidence, verdict: Verdict, named: tuple[str, ...]
) -> None:
    """Likely and strong is named; likely and weak is not; rivals are listed; strangers stay so."""
    assert decide_verdict(given) == (verdict, named)


def test_what_another_sensor_refutes_keeps_its_place_in_its_family() -> None:
    """900 in logarithms against each effect alone are beyond the smallest number there is."""
    alone = [Label("effect", (term,), ("slow-bias",)) for term in ("bias-drift", "warm-up")]
    both = Label("pair", ("bias-drift", "warm-up"), ("slow-bias", "slow-bias"))
    before = Shares({alone[0]: 0.5, alone[1]: 0.3, both: 0.2}, {})
    spoken = {one.terms: -900.0 for one in alone} | {both.terms: 0.0}
    after = before.heard(spoken, -100.0)
    family_of = dict.fromkeys(both.terms, "slow-bias")
    assert after.present()["slow-bias"] == pytest.approx(1.0)
    assert after.together(family_of, "slow-bias")[both.terms] == pytest.approx(1.0)
    assert [term for term, _ in after.members(family_of, "slow-bias")] == ["bias-drift", "warm-up"]


def test_structure_without_a_name_forbids_every_name() -> None:
    """A strong family is not named while an unknown shape may be the truth."""
    given = evidence({"even-order": 0.78, "unknown": 0.22}, {"even-order": 150.0}, 150.0)
    assert decide_verdict(given) == (Verdict.UNEXPLAINED, ())


def test_a_weak_second_family_does_not_spoil_the_first_name() -> None:
    """Only what takes away enough by itself is named."""
    taken = {"even-order": 200.0, "hysteresis": 9.0}
    given = evidence({"even-order": 0.99, "hysteresis": 0.9}, taken)
    assert decide_verdict(given) == (Verdict.MISSING, ("even-order",))


@pytest.mark.parametrize(
    ("lack", "verdict"),
    [
        (LackOfFit(1.0, 0.5), Verdict.COMPLETE),
        (LackOfFit(1.6, 1e-6), Verdict.UNEXPLAINED),
        (LackOfFit(1.6, 1e-6, 2.6, 0.4, 1e-6), Verdict.COMPLETE),
        (LackOfFit(1.6, 1e-6, 1.1, 1e-4, 0.3), Verdict.UNEXPLAINED),
        (LackOfFit(1.6, 1e-6, 0.4, 0.12, 0.9), Verdict.UNEXPLAINED),
        (LackOfFit(4.0, 0.0, 16.0, 0.4, 0.0), Verdict.NOT_REPEATABLE),
        # one repeat, by a tenth of what is left
        (LackOfFit(40.0, 0.0, 16.0, 0.06, 1e-3), Verdict.UNEXPLAINED),
        (LackOfFit(4.0, 0.0, 4.0, 0.02, 0.05), Verdict.UNEXPLAINED),
    ],
)
def test_what_has_no_shape_is_noise_only_where_measured_noise_makes_it(
    lack: LackOfFit, verdict: Verdict
) -> None:
    """By the noise within the holds or by repeats; repeats far above that are no noise either."""
    assert decide_verdict(evidence({"nothing": 0.9}, lack=lack)) == (verdict, ())


@pytest.mark.parametrize(
    ("strength", "discriminability", "named"),
    [(150.0, 0.35, True), (150.0, 0.03, False), (550.0, 0.03, True), (80.0, 1.0, False)],
)
def test_where_any_characteristic_looks_bent_a_bent_one_must_be_overwhelming(
    strength: float, discriminability: float, named: bool
) -> None:
    """Eighteen poses show two numbers of a characteristic: effects are listed, none is named."""
    given = evidence(
        {"odd-order": 0.95},
        {"odd-order": strength},
        max(strength, 100.0),
        discriminability=discriminability,
    )
    expected = (Verdict.MISSING, ("odd-order",)) if named else (Verdict.AMBIGUOUS, ())
    assert decide_verdict(given) == expected
