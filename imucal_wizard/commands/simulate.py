"""``imucal-wizard simulate``: a recording of the virtual IMU."""

from collections.abc import Sequence
from pathlib import Path

from imucal_wizard.commands.arguments import Parser


def parser() -> Parser:
    """The options of ``simulate``."""
    made = Parser(
        prog="imucal-wizard simulate",
        description="Write a recording of the virtual IMU, as a hand would have made it.",
    )
    made.add_argument("out", type=Path, metavar="OUT.csv")
    made.add_argument(
        "--hidden",
        action="append",
        default=[],
        metavar="TERM:SIZE:AXIS",
        help="an effect hidden in the sensor; may be given several times",
    )
    made.add_argument("--seed", type=int, default=0, metavar="N", help="which sensor and hand")
    made.add_argument("--rate", type=float, default=100.0, metavar="HZ")
    made.add_argument("--poses", default="18", metavar="NAME", help="6, 18, 26 or 26+repeats")
    return made


def run(argv: Sequence[str]) -> int:
    """Write the recording and say where."""
    arguments = parser().parse_args(argv)
    from imucal_wizard.devices.virtual.simulate import simulate_recording

    simulate_recording(
        arguments.out,
        hidden=arguments.hidden,
        seed=arguments.seed,
        rate=arguments.rate,
        poses=arguments.poses,
    )
    print(f"written: {arguments.out}")
    return 0
