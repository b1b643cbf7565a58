"""Work in a thread that a quit does not wait for."""

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

from textual.dom import DOMNode
from textual.widget import Widget
from textual.worker import NoActiveWorker, get_current_worker

_T = TypeVar("_T")


async def in_thread(work: Callable[[], _T]) -> _T:
    """The result of ``work``, computed in a daemon thread.

    Quitting does not wait for it: a fit or a search for ports may be abandoned. Work that must be
    finished, such as writing a file, uses ``asyncio.to_thread`` instead.

    Raises:
        Exception: whatever ``work`` raises.
        CancelledError: the screen that waits for it is being closed.
    """
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[_T] = loop.create_future()

    def give(result: Callable[[], None]) -> None:
        with suppress(RuntimeError):  # the program has ended meanwhile
            loop.call_soon_threadsafe(lambda: None if answer.done() else result())

    def run() -> None:
        try:
            value = work()
        except BaseException as error:  # noqa: BLE001 - handed over to whoever waits, as it is
            failure = error
            give(lambda: answer.set_exception(failure))
        else:
            give(lambda: answer.set_result(value))

    threading.Thread(target=run, name=f"work {id(answer):x}", daemon=True).start()
    try:
        return await answer
    finally:
        if _worker_is_left():
            raise asyncio.CancelledError


def being_left(node: DOMNode) -> bool:
    """Whether a screen is being removed; its widgets are removed before it."""
    removed = isinstance(node, Widget) and node._pruning
    return removed or not node.is_attached or not node.app.is_running


def _worker_is_left() -> bool:
    """Whether the screen of the present worker is being removed."""
    try:
        return being_left(get_current_worker().node)
    except NoActiveWorker:
        return False
