"""A port is opened, read, lost and found again, and every failure says what to do."""

import os
import socket
import sys
import threading
from pathlib import Path

import pytest

from imucal_wizard.acquire import link_errors
from imucal_wizard.acquire.ports import PortInfo, hint_for, list_ports
from imucal_wizard.acquire.transport import Transport
from imucal_wizard.core.errors import LinkError
from tests.acquire.ports import Pty, link, server, url_of
from tests.waiting import PATIENCE, received

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs pseudo-terminals")


def test_what_a_device_prints_is_read_whole(pty: Pty) -> None:
    transport = Transport(pty.path)
    transport.open()
    pty.send(b"1.0,2.0,3.0\r\n" * 200)
    assert received(transport.read, 2600) == b"1.0,2.0,3.0\r\n" * 200
    transport.close()


def test_nothing_comes_from_a_silent_device_and_the_wait_is_short(pty: Pty) -> None:
    transport = Transport(pty.path)
    transport.open()
    assert transport.read(timeout=0.01) == b""
    transport.close()


def test_what_is_written_reaches_the_device(pty: Pty) -> None:
    transport = Transport(pty.path)
    transport.open()
    transport.write(b"#o1")
    assert os.read(pty.master, 16) == b"#o1"
    transport.close()


def test_a_missing_port_is_named_with_the_ports_there_are() -> None:
    transport = Transport("/dev/ttyNOTHERE", find=lambda: [PortInfo("/dev/ttyACM7")])
    with pytest.raises(LinkError, match=r"no port /dev/ttyNOTHERE.*/dev/ttyACM7.*Plug") as refused:
        transport.open()
    assert "choose" not in str(
        refused.value
    )  # a session that is resumed has no list to choose from


def test_a_port_that_is_open_elsewhere_is_busy(pty: Pty) -> None:
    first = Transport(pty.path)
    first.open()
    with pytest.raises(LinkError, match=r"in use by .*Close that program"):
        Transport(pty.path).open()
    first.close()
    Transport(pty.path).open()


def test_a_forbidden_port_names_the_group_that_owns_the_node(tmp_path: Path) -> None:
    import grp

    node = tmp_path / "ttyACM0"
    node.touch()
    group = grp.getgrgid(node.stat().st_gid).gr_name
    text = link_errors.open_error_text(str(node), PermissionError(13, "Permission denied"), [])
    assert f"group {group}" in text


def test_joining_a_group_is_advised_where_it_helps_and_never_for_root() -> None:
    assert "usermod -a -G dialout" in link_errors.permission_error_text(
        "/dev/ttyACM0", "dialout", True
    )
    for group, may in (("root", True), ("dialout", False)):
        text = link_errors.permission_error_text("/dev/ttyACM0", group, may)
        assert "usermod" not in text
        assert "chmod a+rw /dev/ttyACM0" in text


def test_a_folder_given_as_a_port_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LinkError, match=r"is a folder, not a serial port"):
        Transport(str(tmp_path)).open()


def test_a_host_that_is_not_known_is_told_from_a_bad_address() -> None:
    with pytest.raises(LinkError, match=r"cannot be reached. Check the host"):
        Transport("socket://no.such.host.invalid:9").open()


def test_a_file_given_as_a_port_is_refused_with_a_hint_to_replay(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text("1,2,3\n")
    with pytest.raises(LinkError, match=r"not a serial port.*as a recording"):
        Transport(str(file)).open()


def test_a_refused_socket_is_reported() -> None:
    listening = server()
    url = url_of(listening)
    listening.close()
    with pytest.raises(LinkError, match="was refused"):
        Transport(url).open()


@pytest.mark.parametrize(
    "url",
    ["nonsense://1", "socket://", "socket://host:notaport", "rfc2217://host", "hwgrep://[",
     "loop://?x=y", "socket://127.0.0.1:99999"],
)  # fmt: skip
def test_a_bad_url_says_which_urls_are_good(url: str) -> None:
    with pytest.raises(LinkError, match="socket://HOST:PORT"):
        Transport(url).open()


def test_an_impossible_speed_is_refused_with_the_reason(pty: Pty) -> None:
    for speed in (-5, 10**12):
        with pytest.raises(LinkError, match="cannot be opened"):
            Transport(pty.path, speed).open()


def test_a_socket_is_read_like_a_port_and_its_end_is_a_loss() -> None:
    with server() as listening:
        transport = Transport(url_of(listening))
        transport.open()
        peer, _ = listening.accept()
        peer.sendall(b"hello\n" * 1000)
        assert len(received(transport.read, 6000)) == 6000
        peer.close()
        with pytest.raises(LinkError, match=r"has ended .*Check the server"):
            received(transport.read, 1)
        with pytest.raises(LinkError, match="is not open"):
            transport.read()


def test_what_a_server_sends_on_connecting_is_not_thrown_away() -> None:
    """A header that is sent once; whether it is there in time is chance, so it is tried often."""
    header = b"ax[g],ay[g],az[g]\n"

    def greet(listening: socket.socket) -> None:
        for _ in range(5):
            peer, _ = listening.accept()
            with peer:
                peer.sendall(header)
                peer.recv(1)  # until the other end closes

    with server() as listening:
        greeter = threading.Thread(target=greet, args=(listening,), daemon=True)
        greeter.start()
        for _ in range(5):
            transport = Transport(url_of(listening))
            transport.open()
            assert received(transport.read, len(header)) == header
            transport.close()
        greeter.join(PATIENCE)


def test_an_unplugged_device_is_noticed_after_all_it_sent_has_been_read(pty: Pty) -> None:
    transport = Transport(pty.path)
    transport.open()
    pty.send(b"last words\n")
    assert received(transport.read, 11) == b"last words\n"
    pty.unplug()
    with pytest.raises(LinkError, match=r"unplugged.*kept"):
        received(transport.read, 1)
    with pytest.raises(LinkError, match="is not open"):
        transport.read()


def test_the_last_bytes_are_read_when_the_other_end_closes_at_once() -> None:
    with server() as listening:
        transport = Transport(url_of(listening))
        transport.open()
        peer, _ = listening.accept()
        peer.sendall(b"x" * 5000)
        peer.close()
        assert len(received(transport.read, 5000)) == 5000
        with pytest.raises(LinkError, match=r"has ended .*Check the server"):
            received(transport.read, 1)


def test_a_device_that_comes_back_is_opened_again_and_marks_the_break(tmp_path: Path) -> None:
    first, second = Pty(), Pty()
    transport = Transport(link(tmp_path / "imu", first.path))
    transport.open()
    first.unplug()
    with pytest.raises(LinkError):
        received(transport.read, 1)
    (tmp_path / "imu").unlink()
    assert not transport.reopen()
    link(tmp_path / "imu", second.path)
    assert transport.reopen()

    second.send(b"again\n")
    assert received(transport.read, 6) == b"again\n"
    transport.close()
    second.unplug()


def _usb(device: str, serial: str = "A1", vid_pid: str = "2341:0043") -> PortInfo:
    return PortInfo(device, "Arduino Uno", vid_pid, serial, hint_for(vid_pid))


def test_a_usb_device_is_found_under_another_name_by_its_serial_number() -> None:
    first, second, other = Pty(), Pty(), Pty()
    ports = [_usb(first.path)]
    transport = Transport(first.path, find=lambda: ports)
    transport.open()
    assert transport.description == f"{first.path}, Arduino"
    first.unplug()
    transport.close()
    ports[:] = [_usb(other.path, serial="B2")]
    assert not transport.reopen()
    ports[:] = [_usb(other.path, serial="B2"), _usb(second.path)]
    assert transport.reopen()
    assert transport.port == second.path
    transport.close()
    second.unplug()
    other.unplug()


def test_another_device_at_the_old_name_is_not_mistaken_for_it(pty: Pty) -> None:
    ports = [_usb(pty.path)]
    transport = Transport(pty.path, find=lambda: ports)
    transport.open()
    ports[:] = [_usb(pty.path, vid_pid="0403:6001")]
    assert not transport.reopen()


def test_closing_twice_and_reading_a_closed_port_are_harmless(pty: Pty) -> None:
    transport = Transport(pty.path)
    transport.open()
    transport.close()
    transport.close()
    with pytest.raises(LinkError, match="not open"):
        transport.read()
    with pytest.raises(LinkError, match="not open"):
        transport.write(b"x")


def test_listing_ports_never_fails_and_says_what_vendors_make() -> None:
    assert all(info.device for info in list_ports())
    assert hint_for("2341:0043") == "Arduino"
    assert hint_for("FFFF:0000") == ""
    assert hint_for("") == ""


def test_control_characters_in_a_device_name_do_not_reach_the_terminal() -> None:
    from imucal_wizard.core.output import sanitise

    assert sanitise("\x1b[31mred\x07\u202etxt\nnext") == "[31mred txt next"
    assert sanitise(b"\xff\x00ok") == "\ufffd ok"
    assert len(sanitise("x" * 1000)) == 200
