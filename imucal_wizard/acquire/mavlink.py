"""A flight controller over MAVLink, read as lines of text: the bare sensor, before any correction.

ArduPilot's ``RAW_IMU`` and PX4's ``HIGHRES_IMU`` are corrected by the controller's parameters. The
parameters are read first, and a function of the caller undoes them. An armed vehicle is refused: it
would be turned by hand while its motors may start.
"""

import time
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from imucal_wizard.core.errors import LinkError, UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.units import STANDARD_GRAVITY

MAVLINK = "mavlink:"
"""Beginning of such a port's name: ``mavlink:/dev/ttyACM0``, ``mavlink:udpin:0.0.0.0:14550``."""
HEADER = b"t[s],ax[m/s^2],ay[m/s^2],az[m/s^2],gx[rad/s],gy[rad/s],gz[rad/s]\n"
HEADER_LINES = 500
"""Lines between two headers."""
SAMPLE_INTERVAL_US = 10_000
"""Microseconds between the samples requested from the vehicle."""
MAX_HEARTBEAT_SECONDS = 5.0
"""Seconds to wait for the first heartbeat."""
MAX_ANSWER_SECONDS = 0.5
"""Seconds to wait for the answer to one request."""
MAX_PARAMETER_REQUESTS = 4
"""Requests for one parameter; MAVLink may lose some."""
RAW_IMU, HIGHRES_IMU = 27, 105
_FROM_MILLI = np.repeat([STANDARD_GRAVITY / 1000.0, 1e-3], 3)
"""From mg and mrad/s to SI."""
_AUTOPILOTS = {3: "ardupilot", 12: "px4"}
"""Known values of MAV_AUTOPILOT."""
PARAMETERS: Mapping[str, tuple[str, ...]] = {
    "ardupilot": (
        *(f"INS_{one}_{axis}" for one in ("ACCOFFS", "ACCSCAL", "GYROFFS") for axis in "XYZ"),
        "INS_TCAL1_ENABLE",
        "AHRS_ORIENTATION",
    ),
    "px4": (
        *(f"CAL_ACC0_{axis}{one}" for one in ("OFF", "SCALE") for axis in "XYZ"),
        *(f"CAL_GYRO0_{axis}OFF" for axis in "XYZ"),
        "TC_A_ENABLE",
        "TC_G_ENABLE",
        "SENS_BOARD_ROT",
    ),
}
"""Parameters that correct the readings of the first IMU."""
_OPTIONAL = ("_ENABLE",)
"""Endings of parameters that a vehicle may lack; it then lacks that correction."""
_MOUNTED = ("AHRS_ORIENTATION", "SENS_BOARD_ROT")

Undo = Callable[[FloatArray], FloatArray]
"""From corrected accelerations and rates, shape (n, 6), SI, to those of the bare sensor."""


class VehicleLink:
    """A link that reads a flight controller, with the interface of ``transport.Transport``.

    Args:
        port: begins with ``MAVLINK``; then a device or address of pymavlink.
        baud: bits per second of a device.
        undoing: makes the function that undoes the correction, from the autopilot's name and its
            parameters.

    Attributes:
        autopilot: ``ardupilot`` or ``px4``; "" before it is open.
        parameters: of the vehicle.
    """

    def __init__(
        self, port: str, baud: int, undoing: Callable[[str, Mapping[str, float]], Undo]
    ) -> None:
        self._port, self._baud, self._undoing = port, baud, undoing
        self.autopilot = ""
        self.parameters: dict[str, float] = {}
        self._link: Any = None  # pymavlink has no types
        self._undo: Undo = np.asarray
        self._lines = 0

    @property
    def description(self) -> str:
        """Description of the source for the user."""
        return f"{self.autopilot or 'flight controller'} at {self._port.removeprefix(MAVLINK)}"

    def open(self) -> None:
        """Find the vehicle, read its parameters, and ask for its samples; nothing if it is open.

        Raises:
            LinkError: it is not there, or armed.
            UsageError: pymavlink is missing, or the vehicle's correction cannot be undone.
        """
        if self._link is not None:
            return
        self._link = self._connected()
        try:
            self._find_vehicle()
            self.parameters = self._read_parameters()
            for name in _MOUNTED:
                if self.parameters.get(name):
                    raise UsageError(
                        f"the vehicle turns its readings ({name} {self.parameters[name]:g}): set "
                        "that to 0 while it is checked, and restart it"
                    )
            self._undo = self._undoing(self.autopilot, self.parameters)
            self._ask_for_samples()
        except BaseException:
            self.close()
            raise

    def read(self, timeout: float = 0.05) -> bytes:
        """The samples that have arrived, as lines.

        Raises:
            LinkError: the vehicle was armed.
        """
        rows, end = [], time.monotonic() + timeout
        while (left := end - time.monotonic()) > 0.0:
            message = self._receive(left, "HEARTBEAT", "RAW_IMU", "HIGHRES_IMU")
            if message is None:
                break
            if message.get_type() == "HEARTBEAT":
                self._check_disarmed(message)
            else:
                rows.append(_values(message))
        return self._text(np.array(rows)) if rows else b""

    def reopen(self) -> bool:
        """Search once for the vehicle."""
        self.close()
        try:
            self.open()
        except (LinkError, UsageError):
            return False
        return True

    def close(self) -> None:
        """Close the link."""
        link, self._link = self._link, None
        if link is not None:
            link.close()

    def _text(self, rows: FloatArray) -> bytes:
        raw = self._undo(rows[:, 1:])
        lines = []
        for time_s, values in zip(rows[:, 0], raw, strict=True):
            if self._lines % HEADER_LINES == 0:
                lines.append(HEADER)
            self._lines += 1
            numbers = ",".join(f"{value:.7f}" for value in values)
            lines.append(f"{time_s:.6f},{numbers}\n".encode())
        return b"".join(lines)

    def _connected(self) -> Any:
        address = self._port.removeprefix(MAVLINK)
        try:
            from pymavlink import mavutil
        except ImportError as error:
            raise UsageError(
                "MAVLink needs pymavlink: install imucal-wizard with its extra mavlink"
            ) from error
        try:
            return mavutil.mavlink_connection(address, baud=self._baud, source_system=255)
        except (OSError, ValueError, TypeError, IndexError) as error:
            raise LinkError(
                f"{address} cannot be opened ({error}): give a device, or an address like "
                "udpin:0.0.0.0:14550"
            ) from error

    def _find_vehicle(self) -> None:
        end = time.monotonic() + MAX_HEARTBEAT_SECONDS
        while (left := end - time.monotonic()) > 0.0:
            message = self._receive(left, "HEARTBEAT")
            if message is not None and message.autopilot in _AUTOPILOTS:
                self.autopilot = _AUTOPILOTS[message.autopilot]
                self._link.target_system = message.get_srcSystem()
                self._link.target_component = message.get_srcComponent()
                self._check_disarmed(message)
                return
        raise LinkError(
            f"no ArduPilot or PX4 speaks MAVLink at {self._port.removeprefix(MAVLINK)}: check the "
            "port and its speed, and close the ground station"
        )

    def _check_disarmed(self, heartbeat: Any) -> None:
        armed = 128  # MAV_MODE_FLAG_SAFETY_ARMED
        if heartbeat.base_mode & armed:
            raise LinkError("the vehicle is armed: disarm it and take the propellers off first")

    def _receive(self, timeout: float, *kinds: str) -> Any:
        try:
            return self._link.recv_match(type=list(kinds), blocking=True, timeout=timeout)
        except (OSError, TypeError) as error:  # pymavlink passes on what pyserial raises
            raise LinkError(f"{self._port} is gone ({error}): connect it again") from error

    def _read_parameters(self) -> dict[str, float]:
        found: dict[str, float] = {}
        for name in PARAMETERS[self.autopilot]:
            value = self._parameter(name)
            if value is not None:
                found[name] = value
            elif not name.endswith(_OPTIONAL):
                raise LinkError(
                    f"the vehicle does not send its parameter {name}: without it the correction "
                    "cannot be undone. Try again, or update the firmware"
                )
        return found

    def _parameter(self, name: str) -> float | None:
        tries = 1 if name.endswith(_OPTIONAL) else MAX_PARAMETER_REQUESTS
        for _ in range(tries):
            target = self._link.target_system, self._link.target_component
            self._link.mav.param_request_read_send(*target, name.encode(), -1)
            end = time.monotonic() + MAX_ANSWER_SECONDS
            while (left := end - time.monotonic()) > 0.0:
                message = self._receive(left, "PARAM_VALUE")
                if message is not None and message.param_id.rstrip("\0") == name:
                    return self._number(message)
        return None

    def _number(self, message: Any) -> float:
        """PX4 sends the bytes of a whole number in place of a float."""
        whole = 6  # MAV_PARAM_TYPE_INT32
        if self.autopilot == "px4" and message.param_type == whole:
            return float(np.float32(message.param_value).view(np.int32))
        return float(message.param_value)

    def _ask_for_samples(self) -> None:
        number = {"ardupilot": RAW_IMU, "px4": HIGHRES_IMU}[self.autopilot]
        target = self._link.target_system, self._link.target_component
        set_interval = 511  # MAV_CMD_SET_MESSAGE_INTERVAL
        self._link.mav.command_long_send(
            *target, set_interval, 0, number, SAMPLE_INTERVAL_US, 0, 0, 0, 0, 0
        )


def _values(message: Any) -> list[float]:
    """Time in s, accelerations and rates in SI."""
    names = ("xacc", "yacc", "zacc", "xgyro", "ygyro", "zgyro")
    values = np.array([getattr(message, name) for name in names], float)
    if message.get_type() == "RAW_IMU":
        values = values * _FROM_MILLI
    return [1e-6 * message.time_usec, *values.tolist()]
