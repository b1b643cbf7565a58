"""What a command costs (CPU, wall time, peak memory), and what a study does not reach."""

import argparse
import os
import platform
import resource
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

PYTHON = sys.executable
SHARED = Path(
    os.environ.get("IMUCAL_SHARED_DATA", Path(__file__).resolve().parents[2] / "shared" / "data")
)
"""Where the optional real recordings lie."""
HERE = Path(__file__).resolve().parents[1]
"""This checkout."""


@dataclass(frozen=True)
class Cost:
    """One run of a process: seconds of CPU and of wall time, peak memory in MiB."""

    cpu: float
    wall: float
    memory: float


def run_once(command: Sequence[str], environment: Mapping[str, str]) -> Cost:
    """Run a command to its end.

    Args:
        command: program and arguments.
        environment: its variables.

    Raises:
        SystemExit: the command failed; what it said is shown.
    """
    start = time.perf_counter()
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=environment
    ) as process:
        said = process.stdout.read() if process.stdout else b""
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    wall = time.perf_counter() - start
    if process.returncode != 0:
        raise SystemExit(f"{' '.join(command)} failed:\n{said.decode(errors='replace')}")
    return Cost(usage.ru_utime + usage.ru_stime, wall, usage.ru_maxrss / 1024.0)


def program_environment(checkout: Path, bytecode: str) -> dict[str, str]:
    """Environment in which ``-m`` runs the modules of a checkout, on one core.

    Args:
        checkout: top of the tree.
        bytecode: folder for the compiled modules, so that no run but the first compiles any and the
            checkout stays as it is.
    """
    return {
        **os.environ,
        "PYTHONPATH": str(checkout),
        "PYTHONPYCACHEPREFIX": bytecode,
        "PYTHONDONTWRITEBYTECODE": "",
        "PYTHONSAFEPATH": "1",
        "OMP_NUM_THREADS": "1",
        "OPENBLAS_NUM_THREADS": "1",
    }


def other_checkout() -> Path | None:
    """The checkout given with ``--against``, which is measured in turn with this one."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--against", type=Path, metavar="CHECKOUT", help="of another commit")
    found: Path | None = parser.parse_args().against
    return found and found.resolve()


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


def interval(good: int, of: int) -> tuple[float, float]:
    """95 % interval of a share by Clopper and Pearson, per cent."""
    from scipy.stats import beta  # its memory would count as that of every process measured

    low = 0.0 if good == 0 else float(beta.ppf(0.025, good, of - good + 1))
    high = 1.0 if good == of else float(beta.ppf(0.975, good + 1, of - good))
    return 100.0 * low, 100.0 * high


class Wanted:
    """What a study wants of its figures; as text, what of it is not reached."""

    def __init__(self) -> None:
        self.missed: list[str] = []

    def figure(
        self, what: str, value: float, least: float, most: float, doubt: float = 0.0
    ) -> None:
        """A figure that is to lie between two limits.

        Args:
            what: its name.
            value: the figure.
            least: smallest value wanted.
            most: largest one.
            doubt: standard error of the figure.
        """
        if not least <= value <= most:
            near = least - 2.0 * doubt <= value <= most + 2.0 * doubt
            chance = " (by less than two standard errors)" if near else ""
            self.missed.append(f"{what} {value:.4g}{chance}")

    def share(self, what: str, good: int, of: int, least: float, most: float = 100.0) -> None:
        """A share, per cent, that is to lie between two limits."""
        if of and not least <= 100.0 * good / of <= most:
            low, high = interval(good, of)
            chance = ", within its interval" if low <= most and high >= least else ""
            self.missed.append(f"{what} ({good} of {of}{chance})")

    def __str__(self) -> str:
        return f"not reached: {'; '.join(self.missed) or 'nothing'}"
