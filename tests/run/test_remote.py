"""A device behind a terminal server on the network (``rfc2217://``) is read like one at hand."""

from collections.abc import Iterator

import pytest

from imucal_wizard.acquire.transport import Transport
from imucal_wizard.core.errors import LinkError
from imucal_wizard.guide.kinds import EventKind
from imucal_wizard.run.engine import Engine
from imucal_wizard.run.reader import Pump, Reader
from imucal_wizard.simulate.imu import VirtualImu
from tests.acquire.ports import server
from tests.acquire.remote import RemotePort
from tests.simulate.served import served_on_a_socket
from tests.waiting import received, wait_for

pytestmark = pytest.mark.filterwarnings("ignore:set(Daemon|Name):DeprecationWarning")  # pyserial's


@pytest.fixture
def remote() -> Iterator[RemotePort]:
    """The virtual IMU behind a server on this machine.

    pyserial takes the protocol apart byte by byte: a faster device fills the connection of a busy
    machine before the speed is agreed on.
    """
    with served_on_a_socket(VirtualImu(speed=2.0)) as url, RemotePort(url) as port:
        yield port


def test_a_remote_device_is_read_decoded_lost_and_found_again(remote: RemotePort) -> None:
    reader = Reader(Pump(Transport(remote.url)), Engine())
    reader.start()
    try:
        wait_for(lambda: reader.snapshot().stream.samples >= 100)
        stream = reader.snapshot().stream
        assert (stream.connected, stream.problem, stream.malformed) == (True, "", 0)
        assert stream.rate == pytest.approx(100.0)
        remote.hang_up()
        wait_for(lambda: EventKind.LINK_BACK in [e.kind for e in reader.snapshot().events])
        seen = reader.snapshot().stream.samples
        wait_for(lambda: reader.snapshot().stream.samples >= seen + 100)
        assert reader.snapshot().stream.problem == ""
    finally:
        reader.stop()


def test_the_speed_asked_for_is_that_of_the_remote_port(remote: RemotePort) -> None:
    transport = Transport(remote.url, 57600)
    transport.open()
    assert remote.port.baudrate == 57600
    transport.close()


def test_a_remote_port_that_is_lost_says_so_and_is_opened_again(remote: RemotePort) -> None:
    transport = Transport(remote.url)
    transport.open()
    assert len(received(transport.read, 500)) >= 500
    remote.hang_up()
    with pytest.raises(LinkError, match=r"has ended .*Check the server"):
        received(transport.read, 10**9)
    assert transport.reopen()
    assert received(transport.read, 10)
    transport.close()


def test_a_server_that_does_not_speak_the_protocol_is_told_from_one_that_does() -> None:
    """A plain socket that says nothing: the message names the way to read it."""
    with server() as listening:
        url = f"rfc2217://127.0.0.1:{listening.getsockname()[1]}"
        with pytest.raises(LinkError, match=r"not seem to support RFC2217.*socket://HOST:PORT"):
            Transport(url).open()
