"""The table of attacks: ``python -m benchmarks.attacks [--full] [--minutes M] [NUMBER …]``.

Without ``--full`` each attack makes few attempts. With it the attempts are those that the table in
``results/attacks.txt`` promises, and the lines of the attacks that ran are replaced there; after
``--minutes`` an attack makes no further attempts, and its line says how many it has made.
"""

import argparse
import re
import sys
import time
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from types import ModuleType

from benchmarks.attacks import CLOCK, Outcome
from benchmarks.measure import machine

KEPT = Path(__file__).resolve().parents[1] / "results" / "attacks.txt"
SHOWN_LOSSES = 5
"""Losses of an attack that are printed; all of them count."""
HEAD = f"{'':>2}  {'attack':<62}{'tries':>9}{'survived':>10}{'lost':>6}{'required':>10}"


def attacks() -> dict[int, ModuleType]:
    """The modules of this folder that hold an attack, by their numbers."""
    found: dict[int, ModuleType] = {}
    for one in iter_modules([str(Path(__file__).parent)]):
        module = import_module(f"benchmarks.attacks.{one.name}") if one.name != "__main__" else None
        if module is not None and hasattr(module, "NUMBER"):
            if module.NUMBER in found:
                raise SystemExit(f"{one.name} and {found[module.NUMBER].__name__} have one number")
            found[module.NUMBER] = module
    return dict(sorted(found.items()))


def line(module: ModuleType, outcome: Outcome) -> str:
    """The line of the table, and the notes and first losses below it."""
    counts = f"{outcome.tries:>9,}{outcome.survived:>10,}{len(outcome.lost):>6,}{'lost 0':>10}"
    losses = [f"lost: {text}" for text in outcome.lost[:SHOWN_LOSSES]]
    below = "".join(f"\n      {text}" for text in (*outcome.notes, *losses))
    return f"{module.NUMBER:>2}  {module.ATTACK:<62}{counts}{below}"


def keep(lines: dict[int, str]) -> None:
    """Replace these lines in the kept table; the others stay."""
    old = KEPT.read_text() if KEPT.is_file() else ""
    blocks = re.split(r"^(?= ?\d+  )", old, flags=re.MULTILINE)[1:]
    kept = {int(block.split()[0]): block.rstrip("\n") for block in blocks} | lines
    title = f"python -m benchmarks.attacks --full; {machine()}\n\n{HEAD}\n"
    KEPT.write_text(title + "".join(f"{kept[number]}\n" for number in sorted(kept)))


def main() -> int:
    """Print the table; 1 if anything was lost or an attack could not be made."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--full", action="store_true", help="all attempts; keeps the lines")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="of each attack")
    parser.add_argument("numbers", nargs="*", type=int, metavar="NUMBER", help="default: all")
    arguments = parser.parse_args()
    known = attacks()
    if unknown := set(arguments.numbers) - set(known):
        parser.error(f"there is no attack {sorted(unknown)}; there are {list(known)}")
    print(f"{machine()}\n\n{HEAD}", flush=True)
    lines: dict[int, str] = {}
    failed = False
    for number in arguments.numbers or known:
        begin = time.perf_counter()
        CLOCK.allow(arguments.minutes)
        try:
            outcome: Outcome = known[number].run(arguments.full)
        except Exception as error:  # noqa: BLE001 - the other attacks are made all the same
            print(f"{number:>2}  could not be made: {type(error).__name__}: {error}", flush=True)
            failed = True
            continue
        if time.monotonic() > CLOCK.end:
            outcome.notes.append(f"stopped after {arguments.minutes:g} minutes")
        lines[number] = line(known[number], outcome)
        if arguments.full:
            keep(lines)
        failed = failed or bool(outcome.lost)
        print(f"{lines[number]}\n      {time.perf_counter() - begin:.0f} s", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
