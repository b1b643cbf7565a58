"""A stream that nobody can read yet is kept from its beginning, and not for ever."""

from hypothesis import given
from hypothesis import strategies as st

from imucal_wizard.acquire.search import Backlog


@given(st.lists(st.binary(max_size=30), max_size=40), st.integers(0, 60))
def test_the_newest_pieces_are_kept_in_order_and_the_sum_stays_small(
    pieces: list[bytes], most: int
) -> None:
    kept = Backlog(most)
    for arrival, data in enumerate(pieces):
        kept.add(data, float(arrival))
        assert sum(len(one) for one, _ in kept) <= max(most, len(data))
    left = kept.taken()
    assert [data for data, _ in left] == pieces[len(pieces) - len(left) :]
    assert kept.taken() == []
