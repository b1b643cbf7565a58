"""The firmware speaks as the virtual IMU does."""

from pathlib import Path

import pytest

from imucal_wizard.simulate.imu import LinePrinter
from tests.simulate.sensors import ideal

FIRMWARE = Path(__file__).parents[2] / "assets" / "firmware"


@pytest.mark.parametrize("sketch", ["bno055_csv", "lsm6ds3_csv"])
def test_sketches_print_the_header_of_the_virtual_imu_and_enough_decimals(sketch: str) -> None:
    """The same columns and units; acceleration with five decimals, rate with six."""
    source = (FIRMWARE / sketch / f"{sketch}.ino").read_text(encoding="utf-8")
    header = LinePrinter(ideal(), "").header.decode()
    assert f'"{header}"' in source
    assert "* ACCELERATION, 5)" in source
    assert "* RATE, 6)" in source
