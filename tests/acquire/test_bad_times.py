"""A device's time that is wrong, jumps or stands still is noticed, and nothing else is."""

import numpy as np
import pytest

from imucal_wizard.acquire.intake import Intake
from imucal_wizard.core.readings import FloatArray
from tests.acquire.streams import HEADER, at_rest, feed, printed, spoilt, warned


def test_a_device_that_was_away_for_a_while_dropped_nothing() -> None:
    def leave(values: FloatArray) -> None:
        values[600:, 0] += 60.0

    intake = Intake()
    feed(intake, HEADER + printed(spoilt(leave)))
    assert intake.lost == 6000
    assert intake.warnings == ()


def test_a_restart_and_a_wrap_of_time_are_explained() -> None:
    restarted = at_rest(400)
    restarted[200:, 0] -= 4.0
    assert "it has restarted" in warned(restarted)
    wrapped = at_rest(400)
    wrapped[:, 0] = np.mod(wrapped[:, 0] + 4290.0, 2**32 / 1e6)
    assert "counter was full" in warned(wrapped)


def test_a_clock_that_is_wrong_by_a_factor_is_noticed_by_the_hosts() -> None:
    intake = Intake()
    for i, row in enumerate(at_rest(1500, rate=204.8)):
        intake.feed((HEADER if i == 0 else b"") + printed(row[None]), i / 102.4)
    assert any("204.8 samples/s, but 102.4 arrive" in text for text in intake.warnings)


def test_a_pause_or_faster_replay_is_not_a_wrong_clock() -> None:
    intake, silent = Intake(), 0.0
    for i, row in enumerate(at_rest(3000)):
        silent = 60.0 if i > 1000 else 0.0
        intake.feed((HEADER if i == 0 else b"") + printed(row[None]), i / 100 + silent)
    assert intake.warnings == ()
    fast = Intake()
    for i, row in enumerate(at_rest(3000)):
        fast.feed((HEADER if i == 0 else b"") + printed(row[None]), i / 300)
    assert fast.warnings == ()


def test_time_in_milliseconds_under_a_header_of_seconds_is_noticed() -> None:
    intake = Intake()
    values = at_rest(1000)
    values[:, 0] *= 1000
    for i, row in enumerate(values):
        intake.feed((HEADER if i == 0 else b"") + printed(row[None]), i / 100)
    assert intake.rate == pytest.approx(100.0, rel=0.01)
    assert "The time column in s would mean 0.1 samples/s" in intake.warnings[0]
    assert "so it is in ms" in intake.warnings[0]


def test_a_time_column_that_stands_still_is_replaced_by_arrival() -> None:
    intake = Intake()
    values = at_rest(400)
    values[:, 0] = 7.0
    for i, row in enumerate(values):
        intake.feed((HEADER if i == 0 else b"") + printed(row[None]), i / 100)
    assert intake.ready
    assert intake.rate == pytest.approx(100.0, rel=0.01)
    assert any("does not run" in text for text in intake.warnings)


def test_a_unit_of_time_that_cannot_be_is_replaced_by_what_the_arrivals_say() -> None:
    intake = Intake()
    header = HEADER.replace(b"t[s]", b"t[ns]")
    values = at_rest(400)
    for i, row in enumerate(values):
        intake.feed((header if i == 0 else b"") + printed(row[None]), i / 100)
    assert intake.rate == pytest.approx(100.0, rel=0.01)
    assert "The time column in ns would mean 1e+11 samples/s" in intake.warnings[0]


def test_lost_samples_are_counted_and_named() -> None:
    values = np.delete(at_rest(1200), slice(None, None, 10), axis=0)
    assert "one sample in a hundred is missing" in warned(values)
