"""The virtual IMU in one terminal, the wizard on its port in another: pyserial's whole path."""

import subprocess
from pathlib import Path

from tests.terminal.terminal import Terminal

FACES = ("+x", "-x", "+y", "-y", "+z", "-z")


def on_a_port(binary: str, folder: Path) -> None:
    """The device's poses are typed in its own terminal; the wizard takes them from the port."""
    pipe = subprocess.PIPE
    device = [binary, "virtual", "--seed", "4", "--speed", "10"]
    with subprocess.Popen(device, stdin=pipe, stdout=pipe, text=True) as virtual:
        assert virtual.stdin is not None
        assert virtual.stdout is not None
        path = virtual.stdout.readline().strip()
        with Terminal([binary, "--port", path, "--sessions", str(folder / "port")]) as terminal:
            terminal.wait_for("is this what you expect")
            terminal.press("\r")
            terminal.wait_for("▸UP/DOWN")
            for face in FACES:
                print(face, "rest 40", sep="\n", file=virtual.stdin, flush=True)
            terminal.wait_for("▸18 POSES")
            terminal.press("q")
            assert terminal.wait() == 0
        print("quit", file=virtual.stdin, flush=True)
        assert virtual.wait(10.0) == 0
    print(f"on a port: {path} is read, and all six faces are taken")
