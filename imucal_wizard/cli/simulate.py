"""``imucal-wizard simulate``: a recording of the virtual IMU, or an exercise for a class."""

from argparse import Namespace
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from imucal_wizard.cli.arguments import (
    Parser,
    add_exercise,
    add_sensor,
    check_exercise,
    file_to_write,
)
from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.output import say

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
    class_room = made.add_argument_group("an exercise for a class")
    add_exercise(
        class_room,
        "hide a random effect in a recording with 26+repeats poses, and seal the answer in "
        "OUT.mystery (against a glance, not against an attacker)",
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
    from imucal_wizard.simulate.recording import simulate_recording

    simulate_recording(
        arguments.out,
        hidden=arguments.hidden,
        seed=arguments.seed or 0,
        rate=arguments.rate,
        poses=arguments.poses or "18",
        magnetometer=arguments.magnetometer,
    )
    say(f"written: {arguments.out}")
    return 0


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


def _spare_measured(out: Path) -> None:
    """Refuse to write over a file that is no simulated recording.

    Raises:
        UsageError: there is another file of this name.
    """
    from imucal_wizard.simulate.recording import COMMENT

    start = b"?"  # an unreadable file is not overwritten
    if out.is_file():
        with suppress(OSError), out.open("rb") as file:
            start = file.read(len(COMMENT))
        if start not in (b"", COMMENT.encode()):
            raise UsageError(f"{out} is there already and not simulated: give another name")


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
    say(f"written: {made.recording} (for the class)")
    say(f"sealed:  {made.answer}")
    if arguments.key is None:
        say(f"key:     {made.key}")
    return 0


def _reveal(arguments: Namespace) -> int:
    from imucal_wizard.teach import reveal
    from imucal_wizard.teach.exercise import in_words
    from imucal_wizard.teach.guess import judged, parse_guess

    guess = parse_guess(arguments.guess) if arguments.guess else None
    truth = reveal(arguments.reveal, arguments.key)
    if guess is not None:
        outcome, why = judged(guess, truth)
        say(f"guess:  {arguments.guess}: {outcome} ({why})")
    say(f"answer: {in_words(truth)}")
    return 0
