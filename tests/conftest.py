"""What tests of several rooms need."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

# a busy machine may take any time for an example; pytest's own time limit finds what hangs
settings.register_profile("no-deadline", deadline=None)
settings.load_profile("no-deadline")

if TYPE_CHECKING:  # there are systems without pseudo-terminals, on which other tests run
    from tests.acquire.ports import Pty


@pytest.fixture
def pty() -> "Iterator[Pty]":
    """A device on a pseudo-terminal."""
    from tests.acquire.ports import Pty

    device = Pty()
    yield device
    device.unplug()
