"""Another benchmark in this and another checkout, in turn: ``python -m benchmarks.against``.

``python -m benchmarks.against CHECKOUT NAME [ROUNDS]`` runs ``benchmarks.NAME`` of both, one after
the other, so that what else the machine does disturbs both alike. Each prints its own table.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.measure import HERE, PYTHON, program_environment


def main() -> int:
    """Run the benchmark of each checkout; 0 when all runs could be carried out."""
    checkout, name, *rest = sys.argv[1:]
    rounds, failed = int(rest[0]) if rest else 2, 0
    with tempfile.TemporaryDirectory() as bytecode:
        for _ in range(rounds):
            for top in (Path(checkout).resolve(), HERE):
                print(f"\n== {top}", flush=True)
                done = subprocess.run(
                    [PYTHON, "-m", f"benchmarks.{name}"],
                    cwd=top,
                    env=program_environment(top, bytecode),
                    check=False,
                )
                failed |= done.returncode
    return failed


if __name__ == "__main__":
    sys.exit(main())
