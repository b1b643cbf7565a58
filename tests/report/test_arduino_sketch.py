"""The Arduino sketch, compiled for this machine: what it prints is what the device measured."""

import subprocess
from pathlib import Path

import numpy as np

from imucal_wizard.report.exports import write_export
from tests.firmware.sketches import COMPILER, HERE, needs_compiler
from tests.report.devices import DRIFT, FIELD, USUAL, G, calibration

MAIN = """
#include "Arduino.h"
uint64_t clockMicros = 0, endMicros = 5000000;
int hostBytes = 0;
SerialPort Serial;
#include SKETCH
int main() { setup(); loop(); }
"""


@needs_compiler
def test_the_sketch_corrects_on_the_board_what_the_device_read(tmp_path: Path) -> None:
    """Gravity and the field have their sizes, and each line says what it should be."""
    sketch, main, binary = (tmp_path / name for name in ("imu.ino", "main.cpp", "imu"))
    write_export(calibration(felt=False), "arduino", sketch)
    main.write_text(MAIN)
    subprocess.run(
        [
            *(COMPILER or "", "-std=c++11", "-Wall", "-Wextra", "-Werror"),
            *(f'-DSKETCH="{sketch}"', f"-I{HERE / 'arduino'}", str(main), "-o", str(binary)),
        ],
        check=True,
    )
    done = subprocess.run([str(binary)], capture_output=True, check=True, timeout=30)
    lines = [line.split() for line in done.stdout.decode().splitlines() if line[0] != "#"]
    found = {line[0]: np.array([line[1:4], line[5:8]], float) for line in lines}
    for values, expected in found.values():
        np.testing.assert_allclose(values, expected, atol=2e-5)
    lengths = [np.linalg.norm(found[name][0]) for name in ("accelerometer", "magnetometer")]
    np.testing.assert_allclose(lengths, [G, FIELD], rtol=2e-6)
    turning = calibration(felt=False).rotation_increments[0].readings()[0]
    rate = np.linalg.solve(USUAL, turning - DRIFT)
    np.testing.assert_allclose(found["gyroscope"][0], rate, atol=2e-6)
