"""Work beside the screen: its answer, its failure, and a quit that does not wait for it."""

import asyncio
import threading

import pytest

from imucal_wizard.core.errors import DataError
from imucal_wizard.tui.threads import in_thread
from tests.waiting import PATIENCE


def test_the_answer_comes_from_another_thread() -> None:
    assert asyncio.run(in_thread(threading.get_ident)) != threading.get_ident()


def test_a_failure_comes_as_it_was_raised() -> None:
    def fail() -> None:
        raise DataError("too few holds")

    with pytest.raises(DataError, match="too few holds"):
        asyncio.run(in_thread(fail))


def test_leaving_does_not_wait_for_work_that_is_under_way() -> None:
    """A fit that takes long is left in the middle; what it gives later disturbs nobody."""
    end, ended = threading.Event(), threading.Event()

    def work() -> None:
        end.wait(PATIENCE)
        ended.set()

    async def leave() -> None:
        with pytest.raises(TimeoutError):
            await asyncio.wait_for(in_thread(work), 0.05)

    asyncio.run(leave())
    assert not ended.is_set()
    end.set()
