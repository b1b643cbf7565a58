"""The virtual IMU as a source: its line is read like any port, its hand is moved by keys."""

from collections.abc import Callable

from imucal_wizard.devices.link import Transport
from imucal_wizard.devices.virtual import VirtualHand, VirtualImu
from imucal_wizard.live.engine import Engine
from imucal_wizard.live.reader import Reader
from imucal_wizard.procedure.state import Status


class KeyHand:
    """The virtual hand as the keys see it.

    Args:
        hand: the hand.
        following: whether it does by itself what the wizard asks.
    """

    def __init__(self, hand: VirtualHand, *, following: bool) -> None:
        self._hand = hand
        self._following = following

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

    def hear(self, status: Status) -> None:
        """What the wizard says; followed when the hand is to follow."""
        if self._following:
            self._hand.follow(status)


class _VirtualLine(Transport):
    """The line, named after what is at its other end."""

    @property
    def description(self) -> str:
        """What is read, in words."""
        return f"virtual IMU on {super().description}"


class VirtualReader(Reader):
    """Reads the line of a virtual IMU that lives as long as this reader.

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
        prepare: Callable[[Engine], float] | None = None,
    ) -> None:
        self.hand = KeyHand(imu.hand, following=following)
        self._imu = imu
        super().__init__(
            _VirtualLine(imu.start()), engine, prepare=prepare, listener=self.hand.hear
        )

    def stop(self) -> None:
        """End both threads."""
        super().stop()
        self._imu.stop()
