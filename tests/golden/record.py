"""Record what the commands give now: ``python -m tests.golden.record [CASE…]``.

With ``--checkout DIR`` the program of another checkout is run. A case is recorded anew only where
a figure changes for a reason; ``changes.md`` beside this file states the reason.
"""

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

from tests.golden.cases import CASES, EXPECTED, Case
from tests.golden.figures import figures


def recorded(case: Case, checkout: Path) -> dict[str, object]:
    """Exit status and figures of each of a case's commands."""
    results: dict[str, object] = {}
    environment = {**os.environ, "PYTHONPATH": str(checkout)}
    for command in (*case.commands, *case.study):
        ended = subprocess.run(
            [sys.executable, "-m", "imucal_wizard", *case.arguments(command)],
            capture_output=True,
            text=True,
            cwd=checkout,
            env=environment,
            check=False,
        )
        if not ended.stdout:
            raise SystemExit(f"{command}: {ended.stderr}")
        results[command] = {
            "exit": ended.returncode,
            **figures(json.loads(ended.stdout)),
        }
    return results


def main() -> None:
    """Record the named cases, or all."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("cases", nargs="*", metavar="CASE")
    parser.add_argument("--checkout", type=Path, default=Path(__file__).resolve().parents[2])
    arguments = parser.parse_args()
    EXPECTED.mkdir(exist_ok=True)
    for name in arguments.cases or CASES:
        results = recorded(CASES[name], arguments.checkout)
        text = json.dumps(results, indent=None, separators=(",", ":"), ensure_ascii=False)
        (EXPECTED / f"{name}.json").write_text(text.replace('},"', '},\n"') + "\n")
        print(f"recorded: {name}")


if __name__ == "__main__":
    main()
