"""What a command costs: CPU and wall time of whole processes, and peak memory."""

import os
import platform
import resource
import statistics
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

PYTHON = sys.executable
SHARED = Path(
    os.environ.get("IMUCAL_SHARED_DATA", Path(__file__).resolve().parents[2] / "shared" / "data")
)
"""Where the optional real recordings lie."""


@dataclass(frozen=True)
class Cost:
    """One run of a process: seconds of CPU and of wall time, peak memory in MiB."""

    cpu: float
    wall: float
    memory: float


def run_once(command: Sequence[str]) -> Cost:
    """Run a command to its end.

    Raises:
        SystemExit: the command failed; what it said is shown.
    """
    start = time.perf_counter()
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as process:
        said = process.stdout.read() if process.stdout else b""
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    wall = time.perf_counter() - start
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(command)} failed:\n{said.decode(errors='replace')}")
    return Cost(usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024.0)


def median_cost(command: Sequence[str], runs: int = 7) -> Cost:
    """Medians over several runs, after one that is not counted."""
    run_once(command)
    costs = [run_once(command) for _ in range(runs)]
    return Cost(
        statistics.median(cost.cpu for cost in costs),
        statistics.median(cost.wall for cost in costs),
        statistics.median(cost.memory for cost in costs),
    )


def machine() -> str:
    """The machine in one line, and what else it does, to be printed above every table."""
    busy = f", load {os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else ""
    return (
        f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}{busy}"
    )


def own_cpu() -> float:
    """CPU seconds of this process so far."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime
