"""A flight controller over real MAVLink: parameters, samples, refusals."""

import socket
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from imucal_wizard.acquire.mavlink import HEADER, VehicleLink
from imucal_wizard.core.errors import LinkError, UsageError
from imucal_wizard.report.vehicle import undoing, undone_text

mavutil = pytest.importorskip("pymavlink.mavutil")

ARDUPILOT, PX4 = 3, 12
ARMED = 128
OFFSET, SCALE, RATE = (0.3, -0.2, 0.1), (1.02, 0.98, 1.01), (0.02, -0.03, 0.01)
FORCE, TURNING = (1.0, -2.0, 9.5), (0.5, -0.25, 0.125)
"""What the bare sensor reads, m/s² and rad/s."""
AXES = "XYZ"
PARAMETERS = {
    ARDUPILOT: {
        **{f"INS_ACCOFFS_{a}": v for a, v in zip(AXES, OFFSET, strict=True)},
        **{f"INS_ACCSCAL_{a}": v for a, v in zip(AXES, SCALE, strict=True)},
        **{f"INS_GYROFFS_{a}": v for a, v in zip(AXES, RATE, strict=True)},
        "INS_TCAL1_ENABLE": 0.0,
        "AHRS_ORIENTATION": 0.0,
    },
    PX4: {
        **{f"CAL_ACC0_{a}OFF": v for a, v in zip(AXES, OFFSET, strict=True)},
        **{f"CAL_ACC0_{a}SCALE": v for a, v in zip(AXES, SCALE, strict=True)},
        **{f"CAL_GYRO0_{a}OFF": v for a, v in zip(AXES, RATE, strict=True)},
        "SENS_BOARD_ROT": 0.0,
    },
}


def vehicle(
    port: int,
    stopping: threading.Event,
    autopilot: int,
    mode: Callable[[], int],
    changed: dict[str, float],
) -> None:
    """A vehicle: heartbeats, answers to questions about parameters, samples."""
    link = mavutil.mavlink_connection(f"udpout:127.0.0.1:{port}", source_system=1)
    values = {**PARAMETERS[autopilot], **changed}
    force = np.array(SCALE) * (np.array(FORCE) - OFFSET)
    rate = np.array(TURNING) - RATE
    start, beats = time.monotonic(), -1
    while not stopping.is_set():
        now = time.monotonic() - start
        if int(5 * now) > beats:
            beats = int(5 * now)
            link.mav.heartbeat_send(2, autopilot, mode(), 0, 4)
        asked = link.recv_match(type="PARAM_REQUEST_READ", blocking=True, timeout=0.005)
        if asked is not None and asked.param_id in values:
            link.mav.param_value_send(asked.param_id.encode(), values[asked.param_id], 9, 1, 0)
        stamp = int(1e6 * now)
        if autopilot == ARDUPILOT:
            milli = np.round([*(force / 9.80665e-3), *(1e3 * rate)]).astype(int).tolist()
            link.mav.raw_imu_send(stamp, *milli, 0, 0, 0)
        else:
            link.mav.highres_imu_send(stamp, *force, *rate, *[0.0] * 7, 63)
    link.close()


@contextmanager
def flying(
    autopilot: int,
    mode: Callable[[], int] = lambda: 0,
    changed: dict[str, float] | None = None,
) -> Iterator[VehicleLink]:
    """A link to a vehicle that is not open yet."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    stopping = threading.Event()
    thread = threading.Thread(
        target=vehicle, args=(port, stopping, autopilot, mode, changed or {}), daemon=True
    )
    link = VehicleLink(f"mavlink:udpin:127.0.0.1:{port}", 57600, undoing)
    thread.start()
    try:
        yield link
    finally:
        link.close()
        stopping.set()
        thread.join()


@pytest.mark.parametrize(("autopilot", "step"), [(ARDUPILOT, 9.9e-3), (PX4, 1e-5)])
def test_what_is_read_is_the_bare_sensor(autopilot: int, step: float) -> None:
    """Of ArduPilot to the steps of mg and mrad/s in which it sends."""
    with flying(autopilot) as link:
        link.open()
        text = b""
        while text.count(b"\n") < 5:
            text += link.read()
    assert text.startswith(HEADER)
    rows = np.array([line.split(b",") for line in text.splitlines()[1:]], float)
    assert (np.diff(rows[:, 0]) > 0.0).all()
    assert np.abs(rows[:, 1:] - [*FORCE, *TURNING]).max() < step
    said = undone_text(link.autopilot, link.parameters)
    name = {ARDUPILOT: "ArduPilot", PX4: "PX4"}[autopilot]
    assert said.startswith(f"undone, as {name} had applied it: ")
    assert "0.3000, −0.2000, 0.1000" in said
    assert "1.020, 0.9800, 1.010" in said


def test_an_armed_vehicle_is_refused() -> None:
    with flying(ARDUPILOT, lambda: ARMED) as link, pytest.raises(LinkError, match="is armed"):
        link.open()


def test_a_vehicle_that_is_armed_meanwhile_ends_the_reading() -> None:
    mode = [0]
    with flying(ARDUPILOT, lambda: mode[0]) as link:
        link.open()
        mode[0] = ARMED
        end = time.monotonic() + 10.0

        def read_on() -> None:
            while time.monotonic() < end:
                link.read()

        with pytest.raises(LinkError, match="is armed"):
            read_on()


@pytest.mark.parametrize(
    ("changed", "says"),
    [({"AHRS_ORIENTATION": 8.0}, "AHRS_ORIENTATION 8"), ({"INS_TCAL1_ENABLE": 1.0}, "temperature")],
)
def test_what_cannot_be_undone_is_refused(changed: dict[str, float], says: str) -> None:
    with flying(ARDUPILOT, changed=changed) as link, pytest.raises(UsageError, match=says):
        link.open()
