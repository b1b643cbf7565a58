"""The sketches, compiled for this machine against chips that say what is expected."""

import shutil
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parent
SKETCHES = HERE.parents[1] / "assets" / "firmware"
COMPILER = shutil.which("g++") or shutil.which("clang++")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C++ compiler on this machine")


def printed_by(name: str, chip: str, folder: Path) -> str:
    """What a sketch prints in twelve seconds.

    Args:
        name: of the sketch.
        chip: the macro that chooses what the bus answers, such as ``CHIP_BNO055``.
        folder: where the program is built.
    """
    binary, sketch = folder / name, SKETCHES / name / f"{name}.ino"
    subprocess.run(
        [
            *(COMPILER or "", "-std=c++11", "-Wall", "-Wextra", "-Werror"),
            *(f"-D{chip}", f'-DSKETCH="{sketch}"', f"-I{HERE / 'arduino'}"),
            *(str(HERE / "arduino" / "bench.cpp"), "-o", str(binary)),
        ],
        check=True,
    )
    done = subprocess.run([str(binary)], capture_output=True, check=True, timeout=30)
    return done.stdout.decode()
