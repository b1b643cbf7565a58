"""What a session was read from, opened anew to go on with it."""

from collections.abc import Mapping
from typing import Any

from imucal_wizard.devices.link import Transport
from imucal_wizard.devices.virtual import VirtualImu
from imucal_wizard.errors import SessionError, UsageError
from imucal_wizard.live.reader import Reader
from imucal_wizard.live.resume import Resumed
from imucal_wizard.mystery.sitting import Sitting, sitting
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.source import Source
from imucal_wizard.tui.virtual_reader import VirtualReader


def opened_again(taken_up: Resumed, options: WizardOptions) -> Source:
    """The source of a session; it has the session read again before it goes on.

    Args:
        taken_up: the session.
        options: the device may have another name now.

    Raises:
        SessionError: the session does not say what it was read from.
        UsageError: a port was given, and it was none.
    """
    about, path = taken_up.about, taken_up.session.path
    engine, prepare = taken_up.engine, taken_up.prepare
    virtual = about.get("kind") == "virtual"
    if virtual and options.port:
        raise UsageError(f"{path} is a session of the virtual IMU; leave --port out")
    try:
        imu = _same_imu(about, options.speed) if virtual else None
        baud = int(about.get("baud", options.baud))
    except (TypeError, ValueError, UsageError) as error:
        raise SessionError(f"{path} is damaged ({error}); begin a new session") from error
    if imu is not None:
        return VirtualReader(imu, engine, following=options.auto, prepare=prepare)
    port = options.port or str(about.get("port", ""))
    if not port:
        raise SessionError(f"{path} does not say which port it was; add --port PORT")
    return Reader(Transport(port, baud), engine, prepare=prepare)


def _same_imu(about: Mapping[str, Any], speed: float) -> VirtualImu:
    """The virtual IMU of a session, by what was written down of it."""
    field = bool(about.get("magnetometer", False))
    if "mystery" in about:
        made = sitting(int(about["mystery"]), str(about.get("grade")), magnetometer=field)
        return virtual_imu(made, speed)
    seed, hidden = int(about.get("seed", 0)), tuple(map(str, about.get("hidden", ())))
    return VirtualImu(seed=seed, speed=speed, hidden=hidden, magnetometer=field)


def virtual_imu(made: Sitting, speed: float) -> VirtualImu:
    """The virtual IMU of an exercise."""
    return VirtualImu(
        seed=made.hand,
        speed=speed,
        sensor=made.sensor,
        hidden=[made.truth],
        magnetometer=made.magnetometer,
        ammeter=made.magnetometer,
    )
