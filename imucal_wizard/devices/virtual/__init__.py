"""An IMU that does not exist, on a real pseudo-terminal: a hand, a sensor, a serial line."""

from imucal_wizard.devices.virtual.hand import VirtualHand
from imucal_wizard.devices.virtual.hidden import Hidden, parse_hidden
from imucal_wizard.devices.virtual.imu import VirtualImu
from imucal_wizard.devices.virtual.sensor import SensorModel
from imucal_wizard.devices.virtual.simulate import simulate_recording

__all__ = [
    "Hidden",
    "SensorModel",
    "VirtualHand",
    "VirtualImu",
    "parse_hidden",
    "simulate_recording",
]
