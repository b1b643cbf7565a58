"""Work in a thread that a quit does not wait for."""

import asyncio
import threading
from collections.abc import Callable
from contextlib import suppress
from typing import TypeVar

from imucal_wizard.tui.leaving import worker_is_left

_T = TypeVar("_T")


async def in_thread(work: Callable[[], _T]) -> _T:
    """What ``work`` gives, computed in a thread of its own.

    ``asyncio.to_thread`` serves for what must be finished, such as a file being written: leaving
    the program waits for it. A fit or a look at the ports may be left in the middle.

    Raises:
        Exception: whatever ``work`` raises.
        CancelledError: the screen that waits for it is being left.
    """
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[_T] = loop.create_future()

    def give(result: Callable[[], None]) -> None:
        with suppress(RuntimeError):  # the program has been left meanwhile
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
        if worker_is_left():
            raise asyncio.CancelledError
