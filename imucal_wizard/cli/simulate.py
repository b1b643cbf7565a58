"""``imucal-wizard simulate``: a recording of the virtual IMU, or an exercise for a class."""

from argparse import Namespace
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

from imucal_wizard.cli.arguments import (
    Parser,
    add_exercise,
    add_json,
    add_sensor,
    check_exercise,
    file_to_write,
)
from imucal_wizard.cli.outcome import answer, spare_others
from imucal_wizard.core.errors import UsageError

if TYPE_CHECKING:
    from imucal_wizard.simulate.hidden import Hidden

USAGE = (("simulate OUT.csv", "write a recording of the virtual IMU"),)


def parser() -> Parser:
    """The options of ``simulate``."""
    made = Parser(
        prog="imucal-wizard simulate",
        description="Write a recording of the virtual IMU, moved by a virtual hand.",
    )
    made.add_argument(
        "out", type=file_to_write, nargs="?", metavar="OUT.csv", help="the recording to write"
    )
    add_sensor(made)
    made.add_argument(
        "--rate", type=float, default=100.0, metavar="HZ", help="samples per second (default 100)"
    )
    made.add_argument(
        "--poses",
        metavar="NAME",
        help="poses held: 6, 8 (tilted), 18 (default), 26, or 26+repeats (default of --mystery)",
    )
    made.add_argument(
        "--magnetometer",
        action="store_true",
        help="with a magnetometer, and a circle on each of the six faces at the end",
    )
    add_json(made)
    class_room = made.add_argument_group("an exercise for a class")
    add_exercise(
        class_room,
        "hide a random effect in a recording with 26+repeats poses, and seal the answer in "
        "OUT.mystery with the key",
    )
    class_room.add_argument("--reveal", type=Path, metavar="OUT.mystery", help="open an answer")
    class_room.add_argument("--guess", metavar="TERM:AXIS", help="compare this with the answer")
    return made


def run(argv: Sequence[str]) -> int:
    """Write a recording, or open a sealed answer."""
    arguments = parser().parse_args(argv)
    _check(arguments)
    if arguments.reveal:
        return _reveal(arguments)
    if arguments.mystery:
        return _mystery(arguments)
    from imucal_wizard.simulate.hidden import parse_hidden
    from imucal_wizard.simulate.recording import simulate_recording

    hidden = [parse_hidden(text) for text in arguments.hidden]
    simulate_recording(
        arguments.out,
        hidden=hidden,
        seed=arguments.seed or 0,
        rate=arguments.rate,
        poses=arguments.poses or "18",
        magnetometer=arguments.magnetometer,
    )
    found = {
        "recording": str(arguments.out),
        "seed": arguments.seed or 0,
        "hidden": [_effect(one) for one in hidden],
    }
    return _answer(arguments, found, [f"written: {arguments.out}"])


def _check(arguments: Namespace) -> None:
    if arguments.reveal:
        if arguments.out or arguments.mystery or arguments.hidden:
            raise UsageError("--reveal opens an answer and writes nothing: give only --key")
        if arguments.key is None:
            raise UsageError("--reveal needs the class's key: --key WORD")
        return
    if arguments.out is None:
        raise UsageError("give the file to write: OUT.csv")
    if arguments.guess:
        raise UsageError("--guess is compared with an answer: give --reveal OUT.mystery too")
    check_exercise(arguments, also="--reveal")
    _spare_measured(arguments.out)
    spare_others(arguments)


def _spare_measured(out: Path) -> None:
    """Refuse to write over a file that is no simulated recording.

    Raises:
        UsageError: there is another file of this name.
    """
    from imucal_wizard.simulate.recording import FIRST_COMMENT

    start = b"?"  # an unreadable file is not overwritten
    if out.is_file():
        with suppress(OSError), out.open("rb") as file:
            start = file.read(len(FIRST_COMMENT))
        if start not in (b"", FIRST_COMMENT.encode()):
            raise UsageError(f"{out} exists and is not a simulated recording: give another name")


def _mystery(arguments: Namespace) -> int:
    from imucal_wizard.teach import make_exercise

    made = make_exercise(
        arguments.out,
        grade=arguments.grade,
        key=arguments.key,
        seed=arguments.seed,
        rate=arguments.rate,
        poses=arguments.poses or "26+repeats",
        magnetometer=arguments.magnetometer,
    )
    lines = [f"written: {made.recording} (for the class)", f"sealed:  {made.answer}"]
    if arguments.key is None:
        lines.append(f"key:     {made.key}")
    found = {"recording": str(made.recording), "answer": str(made.answer), "key": made.key}
    return _answer(arguments, found, lines)


def _reveal(arguments: Namespace) -> int:
    from imucal_wizard.teach import reveal
    from imucal_wizard.teach.exercise import truth_in_words
    from imucal_wizard.teach.guess import judge_guess, parse_guess

    guess = parse_guess(arguments.guess) if arguments.guess else None
    truth = reveal(arguments.reveal, arguments.key)
    lines = [f"answer: {truth_in_words(truth)}"]
    found: dict[str, object] = {"truth": _effect(truth), "guess": None}
    if guess is not None:
        outcome, why = judge_guess(guess, truth)
        lines.insert(0, f"guess:  {arguments.guess}: {outcome} ({why})")
        found["guess"] = {"text": arguments.guess, "outcome": str(outcome), "reason": why}
    return _answer(arguments, found, lines)


def _effect(hidden: "Hidden") -> dict[str, object]:
    """A hidden effect as a value of JSON."""
    return {
        "sensor": hidden.sensor,
        "term": hidden.term,
        "axes": hidden.letters,
        "size": hidden.size,
        "unit": hidden.unit,
    }


def _answer(arguments: Namespace, found: Mapping[str, object], lines: Sequence[str]) -> int:
    """Report what was done: as JSON where that was asked for, and in lines."""
    document = {"schema": "imucal-wizard/simulate/1", **found}
    answer(arguments.json, document, "\n".join(lines))
    return 0
