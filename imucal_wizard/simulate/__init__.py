"""The virtual IMU: a hand, a sensor, and the lines that the device prints."""

from imucal_wizard.simulate.hand import VirtualHand
from imucal_wizard.simulate.hidden import Hidden, parse_hidden
from imucal_wizard.simulate.imu import VirtualImu
from imucal_wizard.simulate.recording import simulate_recording
from imucal_wizard.simulate.sensor import SensorModel

__all__ = [
    "Hidden",
    "SensorModel",
    "VirtualHand",
    "VirtualImu",
    "parse_hidden",
    "simulate_recording",
]
