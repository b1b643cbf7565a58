"""``imucal-wizard bench``: compare, rank what is missing, add it, without a screen."""

import sys
from argparse import Namespace
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING

from imucal_wizard.commands.arguments import (
    Parser,
    add_effects,
    add_field,
    fitting_parser,
    recording_options,
    write_json,
)
from imucal_wizard.commands.bench_terms import SENSORS, base_terms, wanted_terms
from imucal_wizard.commands.places import STANDARD_OUT, spare
from imucal_wizard.errors import DataError, UsageError
from imucal_wizard.output import note, say

if TYPE_CHECKING:  # numpy waits until the options are known to be right
    from imucal_wizard.bench.benches import Benches
    from imucal_wizard.bench.statement import Statement
    from imucal_wizard.commands.material import Material
    from imucal_wizard.effects.effect import Effect


def parser() -> Parser:
    """The options of ``bench``."""
    made = fitting_parser(
        "bench",
        "Compare model and measurement, rank what may be missing, add it, and see whether the "
        "error on data held out falls.",
    )
    made.add_argument(
        "--auto", action="store_true", help="add what the evidence carries, and stop by itself"
    )
    made.add_argument(
        "--add",
        action="append",
        default=[],
        metavar="TERM",
        help="add this term first; another sensor's as SENSOR/TERM; may be given several times",
    )
    made.add_argument(
        "--base",
        default="bias,scale,non-orthogonality",
        metavar="TERMS",
        help="the base model, of bias,scale,non-orthogonality (magnetometer: bias,soft-iron); "
        "none for none of them; SENSOR/TERM for one sensor alone",
    )
    add_effects(made)
    add_field(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Look, add what is asked for, and report; 1 when the data are insufficient."""
    arguments = parser().parse_args(argv)
    spare(arguments.files, arguments.json)
    added = wanted_terms(arguments.add)
    material, own = opened(arguments)
    try:
        benches = benches_of(arguments, material, own)
    except DataError as error:
        from imucal_wizard.bench.statement import nothing_carried

        sensors = [name for name in SENSORS if getattr(material.readings, name) is not None]
        return told([nothing_carried(name, str(error)) for name in sensors], material, arguments)
    asked = sys.stdin.isatty() and sys.stdout.isatty()
    if asked and not (arguments.auto or arguments.json):
        return _on_screen(benches, added)
    from imucal_wizard.bench.survey import survey

    try:
        statements = survey(benches, added, arguments.auto)
    except DataError as error:
        if arguments.json:
            from imucal_wizard.bench.document import failure_document

            write_json(failure_document(str(error), material.warnings), arguments.json)
        raise
    return told(statements, material, arguments, benches.report.warnings)


def _on_screen(benches: "Benches", added: Mapping[str, Sequence[str]]) -> int:
    """The bench's screen, with the terms asked for in the models already."""
    from imucal_wizard.tui.bench_run import run_bench

    for sensor, names in added.items():
        bench = benches.bench(sensor) if names else None
        if bench is not None:
            for name in names:
                bench.add(name)
        elif names:
            raise UsageError(f"there is no {sensor} in this recording to add a term to")
    return run_bench(benches)


def opened(arguments: Namespace) -> "tuple[Material, list[Effect]]":
    """The recording or session, and the user's own effects.

    Raises:
        InputError: a file cannot be read.
    """
    from imucal_wizard.commands.material import Material
    from imucal_wizard.effects.own import load_effect

    own = [load_effect(path) for path in arguments.effects]
    options = recording_options(arguments)
    return Material(arguments.files, options, all_samples=arguments.all_samples), own


def benches_of(arguments: Namespace, material: "Material", own: "Sequence[Effect]") -> "Benches":
    """A bench for each sensor of the recording; a screen starts here just as the text does.

    Raises:
        DataError: the recording carries no model of accelerometer or magnetometer.
        UsageError: a term that the base does not have.
    """
    from imucal_wizard.bench.benches import Benches
    from imucal_wizard.fitting import FitOptions, with_field
    from imucal_wizard.solver.result import FitReport

    base = base_terms(arguments.base)
    options = FitOptions(material.gravity(arguments.gravity), field=arguments.field)
    # without the second stage: what it makes of the gyroscope rests on two sensors
    try:
        report = material.fit(options, inertial=True)
    except DataError as error:
        if material.field is None:
            raise
        # a device that only tumbles carries no accelerometer
        notes = (*material.warnings, f"the accelerometer is not calibrated: {error}")
        report = FitReport(options.gravity, {}, (), (), {}, warnings=notes)
    if material.field is not None:
        report = with_field(report, material.field, options)
        # how the clocks and axes of the sensors lie to one another is all that it needs to know
        with suppress(DataError):
            report = replace(report, second_stage=material.fit(options).second_stage)
    return Benches(report, material.behind(report), base, own)


def told(
    statements: "Sequence[Statement]",
    material: "Material",
    arguments: Namespace,
    warnings: Sequence[str] = (),
) -> int:
    """Write what was found; the exit status is 1 when a sensor's data are insufficient."""
    from imucal_wizard.bench.verdict import Verdict

    notes = list(dict.fromkeys([*material.warnings, *warnings]))
    short = [one for one in statements if one.verdict is Verdict.INSUFFICIENT]
    if arguments.json:
        from imucal_wizard.bench.document import bench_document

        write_json(bench_document(statements, notes), arguments.json)
    if arguments.json != STANDARD_OUT:
        from imucal_wizard.bench.text import bench_text

        say(bench_text(statements))
    for warning in notes:
        note(f"warning: {warning}")
    for one in short:
        note(f"imucal-wizard: {one.sensor}: {one.lacking}")
    return 1 if short else 0
