"""What tests of several rooms need."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:  # there are systems without pseudo-terminals, on which other tests run
    from tests.devices.ports import Pty


@pytest.fixture
def pty() -> "Iterator[Pty]":
    """A device on a pseudo-terminal."""
    from tests.devices.ports import Pty

    device = Pty()
    yield device
    device.unplug()
