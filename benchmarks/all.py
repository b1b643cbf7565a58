"""Every measurement, one after the other: ``python -m benchmarks.all`` (about twenty minutes)."""

import subprocess
import sys

from benchmarks.measure import PYTHON

NAMES = (
    "first_paint",
    "fit_cold",
    "segmentation",
    "stream",
    "app",
    "fit_with_effects",
    "bench_speed",
    "q_experiments",
    "rate_table",
    "coverage",
    "magnetometer",
)


def main() -> int:
    """Run each in a process of its own; 0 when all of them could be carried out."""
    failed = []
    for name in NAMES:
        print(f"\n== python -m benchmarks.{name}", flush=True)
        if subprocess.run([PYTHON, "-m", f"benchmarks.{name}"], check=False).returncode != 0:
            failed.append(name)
    if failed:
        print(f"\ncould not be measured: {', '.join(failed)}", file=sys.stderr)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
