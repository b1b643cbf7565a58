"""Which virtual sensor, and what is hidden in it: the same for a recording and for the wizard."""

import argparse

from imucal_wizard.errors import UsageError

GRADES = ("consumer", "industrial", "tactical")


def add_sensor(group: "argparse._ActionsContainer") -> None:
    """Which sensor, and the effects of the user's choice that it has."""
    group.add_argument(
        "--hidden",
        action="append",
        default=[],
        metavar="TERM:SIZE:AXIS",
        help="hide an effect in the sensor, like second-order:5:y; may be given several times",
    )
    group.add_argument("--seed", type=int, metavar="N", help="which sensor and hand (default 0)")


def add_exercise(group: "argparse._ArgumentGroup", mystery: str) -> None:
    """What is hidden by chance, and how.

    Args:
        group: where the options are listed.
        mystery: what ``--mystery`` does here, in words.
    """
    group.add_argument("--mystery", action="store_true", help=mystery)
    group.add_argument(
        "--grade",
        choices=GRADES,
        default=GRADES[0],
        help=f"how good the sensor is, and how small the effect (default {GRADES[0]})",
    )
    group.add_argument("--key", metavar="WORD", help="the class's key to the answer")


def check_exercise(arguments: argparse.Namespace, also: str = "") -> None:
    """Refuse what contradicts itself.

    Args:
        arguments: as they were given.
        also: another option that a key belongs to, or "".

    Raises:
        UsageError: an effect of the user's own beside one by chance, or a key for nothing.
    """
    if arguments.mystery and arguments.hidden:
        raise UsageError("--mystery hides an effect by chance, --hidden one of your own: give one")
    if arguments.key is None:
        return
    if not arguments.mystery:
        raise UsageError(f"--key belongs to --mystery{f' or {also}' if also else ''}")
    if not arguments.key.strip():
        raise UsageError("the key is empty; give a word with --key")
