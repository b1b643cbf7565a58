"""Bytes in, rows or one clear sentence out, of every reader; seeded."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.characters import CHARACTERS
from tests.mutations import KINDS, corpus, judged, mutated_case

CASES = 16
ANY = settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])


@pytest.mark.parametrize("kind", KINDS)
def test_mutated_input_is_read_or_refused_with_a_sentence(kind: str, tmp_path: Path) -> None:
    count = {"answer": 2, "session": 4}.get(kind, CASES)
    found = [mutated_case(kind, 10**6 + number, tmp_path) for number in range(count)]
    assert [problem for problem, _ in found if problem] == []


@pytest.mark.parametrize("kind", sorted(set(KINDS) - {"answer"}))
def test_the_real_input_is_read(kind: str, tmp_path: Path) -> None:
    """Otherwise the mutations would only show that everything is refused."""
    rng = np.random.default_rng(1)
    refused = [judged(kind, data, tmp_path, rng) for data in corpus(kind)]
    assert [problem for problem, _ in refused if problem] == []
    assert np.mean([one for _, one in refused]) < 0.5


@ANY
@given(data=st.binary(max_size=300), kind=st.sampled_from(["recording", "stream", "session"]))
def test_any_bytes_are_read_or_refused(data: bytes, kind: str, tmp_path: Path) -> None:
    head = b"SQLite format 3\0" if kind == "session" else b""
    assert judged(kind, head + data, tmp_path, np.random.default_rng(1))[0] == ""


@ANY
@given(
    text=st.text(CHARACTERS, max_size=80), kind=st.sampled_from(["formula", "limits", "reference"])
)
def test_any_text_is_read_or_refused(text: str, kind: str, tmp_path: Path) -> None:
    data = text.encode("utf-8", "surrogatepass")
    assert judged(kind, data, tmp_path, np.random.default_rng(1))[0] == ""
