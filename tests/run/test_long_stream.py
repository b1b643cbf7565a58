"""A long stream through the reader: no sample is lost, memory and descriptors stay as they are."""

import pytest

from benchmarks.attacks import Outcome
from benchmarks.attacks.long_runs import stream


@pytest.mark.study
def test_two_minutes_of_samples_at_full_speed_lose_nothing_and_leave_nothing() -> None:
    outcome = Outcome()
    stream(120.0, outcome)
    assert outcome.lost == []
    assert outcome.tries > 190_000
