"""The virtual IMU as a source: its line is read like any port, its hand is moved by keys."""

import time

from imucal_wizard.devices.link import Transport
from imucal_wizard.devices.setup import StreamSetup
from imucal_wizard.devices.virtual import VirtualHand, VirtualImu
from imucal_wizard.devices.virtual.hand import PREVIEW
from imucal_wizard.live.engine import Engine
from imucal_wizard.live.reader import Prepare, Reader
from imucal_wizard.procedure.collected import Collected
from imucal_wizard.procedure.state import Status

_CATCH_UP = 5.0
"""Wall seconds, beyond those of the samples, after which an order waits no more for the samples."""
_POLL = 0.01


class KeyHand:
    """The virtual hand as the keys see it.

    Args:
        hand: the hand.
        following: whether it does by itself what the wizard asks.

    Attributes:
        first: which of the procedure's samples is the device's first.
    """

    def __init__(self, hand: VirtualHand, *, following: bool) -> None:
        self._hand = hand
        self._following = following
        self.first: int | None = None
        if following:
            hand.heed()

    @property
    def following(self) -> bool:
        """Whether it does by itself what the wizard asks."""
        return self._following

    @following.setter
    def following(self, on: bool) -> None:
        self._following = on
        if not on:
            self._hand.drop()
            self._hand.unhand()

    @property
    def trembling(self) -> bool:
        """Whether the device is held and not laid down."""
        return self._hand.trembling

    def turn(self, axis: str, degrees: float) -> None:
        """Turn the device about one of its axes."""
        self.following = False
        self._hand.turn(axis, degrees)

    def snap_to(self, target: str) -> None:
        """Bring a pose on top."""
        self.following = False
        self._hand.snap_to(target)

    def tremble(self, on: bool) -> None:
        """Hold the device in the hand, or lay it down."""
        self._hand.tremble(on)

    def pass_steel(self) -> None:
        """Let something of steel pass by: the field is disturbed for a moment."""
        self._hand.pass_steel()

    def hear(self, status: Status, samples: int) -> None:
        """What the wizard says of so many samples; followed when the hand is to follow."""
        if self._following and self.first is not None:
            self._hand.follow(status, samples - self.first)

    @property
    def halting(self) -> bool:
        """Whether the device stands still as soon as it has made what was asked of it."""
        return self._following and self._hand.halting

    def resting(self, samples: int) -> bool:
        """Whether the device waits for the wizard, which has been fed all there is."""
        if self.first is None or not self._hand.standing:
            return False
        return samples - self.first == self._hand.sample


class _VirtualLine(Transport):
    """The line, named after what is at its other end."""

    @property
    def description(self) -> str:
        """What is read, in words."""
        return f"virtual IMU on {super().description}"


class VirtualReader(Reader):
    """Reads the line of a virtual IMU that lives as long as this reader.

    While the hand follows, an order in a step in which the device stands still waits until all its
    samples have come, so that it falls on the same sample in every run.

    Args:
        imu: the device, not started.
        engine: what its bytes go through.
        following: whether the hand does everything by itself from the beginning.
        prepare: run first by the thread (a session is read again).

    Attributes:
        hand: moves the device.

    Raises:
        LinkError: the system gives no line for it.
    """

    def __init__(
        self,
        imu: VirtualImu,
        engine: Engine,
        *,
        following: bool = False,
        prepare: Prepare | None = None,
    ) -> None:
        self.hand = KeyHand(imu.hand, following=following)
        self._imu = imu
        self._late: list[tuple[str, str, float]] = []
        super().__init__(
            _VirtualLine(imu.start()), engine, prepare=prepare, listener=self.hand.hear
        )

    def stop(self) -> None:
        """End both threads."""
        super().stop()
        self._imu.stop()

    def collected(self) -> Collected:
        """What has been measured, once the samples that are on their way have come."""
        end = time.monotonic() + self._patience
        while self._running and self._on_the_way and time.monotonic() < end:
            time.sleep(_POLL)  # the thread that reads gets on with it meanwhile
        return super().collected()

    @property
    def _on_the_way(self) -> bool:
        """Whether the device will stand still, and has not yet, or has not been heard out."""
        return self.hand.halting and not self.hand.resting(self._engine.samples)

    @property
    def _resting(self) -> bool:
        """A device that stands still waits for the wizard, and not the other way round."""
        return self.hand.resting(self._engine.samples)

    @property
    def _patience(self) -> float:
        return _CATCH_UP + PREVIEW / self._imu.speed

    def _opened(self) -> None:
        self.hand.first = self._engine.samples

    def _set_setup(self, setup: StreamSetup) -> None:
        if self.hand.first is not None:  # what was read is forgotten, and counted anew
            self.hand.first -= self._engine.samples
        super()._set_setup(setup)

    def _command(self, name: str, argument: str) -> None:
        if self._on_the_way:
            self._late.append((name, argument, time.monotonic() + self._patience))
        else:
            super()._command(name, argument)

    def _publish(self) -> None:
        while self._late and (not self._on_the_way or time.monotonic() > self._late[0][2]):
            super()._command(*self._late.pop(0)[:2])
        super()._publish()
