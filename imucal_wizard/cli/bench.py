"""``imucal-wizard bench``: compare, rank what is missing, add it."""

import sys
from argparse import Namespace
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from imucal_wizard.cli.arguments import (
    STANDARD_OUT,
    Parser,
    add_effects,
    add_field,
    add_limits,
    add_rate_table,
    add_saving,
    fitting_parser,
    gravity_given,
    limits_of_use,
    own_effects,
    table_options,
)
from imucal_wizard.cli.outcome import (
    answer,
    note_spans,
    recording_of,
    save_or_print,
    save_usable,
    spare,
    spare_others,
    write_json,
)
from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.core.notices import not_in_verdicts
from imucal_wizard.core.output import note, numbered_names, say

if TYPE_CHECKING:  # numpy is imported after the options are checked
    from imucal_wizard.api import Fit, Recording
    from imucal_wizard.diagnose.diagnosis import Diagnosis
    from imucal_wizard.tui.services import Saved


USAGE = (("bench FILE...", "find what the model lacks: compare, rank, add"),)
BASES = {
    "accelerometer": ("bias", "scale", "non-orthogonality"),
    "gyroscope": ("bias", "scale", "non-orthogonality"),
    "magnetometer": ("bias", "soft-iron"),
}


def parser() -> Parser:
    """The options of ``bench``."""
    made = fitting_parser(
        "bench",
        "Compare model and measurement, rank the effects that may be missing, add them, and see "
        "whether the held-out error falls.",
        "the data cannot show a term that was to be added, or --save left a sensor out",
    )
    made.add_argument(
        "--auto", action="store_true", help="add terms that held-out data confirm, then stop"
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
    made.add_argument(
        "--view",
        metavar="NAME",
        help="print a plot of the residuals against force, time, temperature, rate …; another "
        "sensor's as SENSOR/NAME; list for the names",
    )
    made.add_argument(
        "--guess",
        metavar="TERM[:AXIS[:SIGN]]",
        help="compare a guess with the evidence, like second-order:y:+",
    )
    add_rate_table(made)
    add_saving(
        made,
        "save the calibration with the terms that were added; on the screen the key s saves it",
    )
    add_limits(made)
    add_effects(made)
    add_field(made)
    return made


def run(argv: Sequence[str]) -> int:
    """Diagnose, add what is asked for, and report.

    The exit status is 0 for every verdict; 1 if ``--save`` has left a sensor out.

    Raises:
        DataError: there is nothing to save, or the data cannot show a term that was asked for.
    """
    arguments = parser().parse_args(argv)
    spare(arguments.files, arguments.json, arguments.save)
    spare_others(arguments)
    added = wanted_terms(arguments.add)
    if arguments.view and arguments.guess:
        raise UsageError("--view prints a plot, and --guess compares a guess: give one of them")
    if arguments.guess:
        from imucal_wizard.teach.prediction import parse_prediction

        parse_prediction(arguments.guess)
    fit = _fit(arguments)
    recording = fit.recording
    try:
        benches = fit.benches
    except DataError as error:
        from imucal_wizard.api import undetermined

        write_diagnosis(list(undetermined(recording, error).values()), recording, arguments)
        if arguments.save or arguments.add:
            raise
        return 0
    whole = arguments.add and arguments.save  # says what to do without a bench
    printed = arguments.auto, arguments.json, arguments.view, arguments.guess, whole
    if sys.stdin.isatty() and sys.stdout.isatty() and not any(printed):
        from imucal_wizard.tui.run import run_bench

        fit.add(added)
        usual = _place(arguments)
        save = lambda place: _save(fit, arguments, place or usual)  # noqa: E731
        return run_bench(benches, save, recording.paths, wanted=arguments.save is not None)
    from imucal_wizard.diagnose.survey import diagnose_benches

    try:
        statements = diagnose_benches(benches, added, arguments.auto)
        if arguments.view:
            _picture(statements, arguments.view, arguments.json)
        elif arguments.guess:
            _judge_guess(statements, arguments.guess, arguments.json)
    except DataError as error:
        if arguments.json:
            from imucal_wizard.report.document import failure_document

            write_json(failure_document("bench", str(error), recording.warnings), arguments.json)
        raise
    if not (arguments.view or arguments.guess):
        write_diagnosis(statements, recording, arguments, benches.report.warnings)
    if not arguments.save:
        return 0
    calibration = fit.judged({one.sensor: one for one in statements}, limits_of_use(arguments))
    return int(save_or_print(calibration, arguments, benches.report))


def _place(arguments: Namespace) -> Path:
    """The file that was named, else a name for it that is free."""
    from imucal_wizard.tui.services import name_of_calibration

    if arguments.save is not None:
        return Path(arguments.save)
    names = numbered_names(name_of_calibration(arguments.files))
    return next(path for path in names if not path.exists())


def _save(fit: "Fit", arguments: Namespace, place: Path) -> "Saved":
    """Write the calibration with the models of the bench.

    Raises:
        DataError: no sensor's calibration is usable.
        UsageError: the place cannot be written.
    """
    from imucal_wizard.diagnose.grade import graded
    from imucal_wizard.diagnose.survey import diagnose_benches
    from imucal_wizard.report.device_history import not_in_file
    from imucal_wizard.tui.services import Saved, last_line

    limits = limits_of_use(arguments)
    diagnoses = {one.sensor: one for one in diagnose_benches(fit.benches, {}, automatic=False)}
    calibration = fit.judged(diagnoses, limits)
    said = save_usable(calibration, place, arguments)
    report = fit.benches.fitted()
    grades = graded(report, diagnoses, limits)
    last = last_line(grades, report, place, None)
    without = not_in_file(calibration, report.rates, force=arguments.force)
    return Saved(place, (*said, last), report, without=without)


def _judge_guess(statements: "Sequence[Diagnosis]", text: str, place: str | None) -> None:
    """Print a guess beside the evidence.

    Raises:
        UsageError: there is no such sensor or suspect.
    """
    from imucal_wizard.teach.prediction import judge_prediction, parse_prediction

    sensor, prediction = parse_prediction(text)
    diagnosis = next((one for one in statements if one.sensor == sensor), None)
    if diagnosis is None:
        raise UsageError(f"there is no {sensor} in this recording to judge {text!r} by")
    judged = judge_prediction(diagnosis, prediction)
    answers = [
        {"agreement": one.agreement.name.lower(), "guess": one.predicted, "found": one.found}
        for one in judged
    ]
    document = {"schema": "imucal-wizard/guess/1", "answers": answers}
    answer(place, document, "\n".join(one.text for one in judged))


def _picture(statements: "Sequence[Diagnosis]", name: str, place: str | None) -> None:
    """Print the views of a name, or all names; as data if JSON is asked for.

    Raises:
        UsageError: there is no such picture.
    """
    from imucal_wizard.diagnose.views import pictures
    from imucal_wizard.report.bench_views import no_such_view, view_document, view_names, view_text

    known = {one.sensor: pictures(one) for one in statements}
    if name == "list":
        say(view_names(known))
        return
    chosen = [
        (sensor, view)
        for sensor, views in known.items()
        for view in views
        if name in (view.name, f"{sensor}/{view.name}")
    ]
    if not chosen:
        raise UsageError(f"{no_such_view(name, known)}: --view list names them all")
    text = "\n\n".join(view_text(sensor, view) for sensor, view in chosen)
    answer(place, view_document(chosen), text)


def _fit(arguments: Namespace) -> "Fit":
    """The fit that the bench begins with.

    Raises:
        InputError: a file cannot be read.
        UsageError: a term that the base does not have.
    """
    from imucal_wizard.api import Fit
    from imucal_wizard.estimate.recording import FitOptions

    own = own_effects(arguments.effects)
    recording = recording_of(arguments)
    given = gravity_given(arguments)
    gravity = recording.gravity if given is None else given
    rates, turns = table_options(arguments)
    options = FitOptions(gravity, field=arguments.field, rates=rates, turns=turns)
    return Fit(recording, options, base=base_terms(arguments.base), own=own)


def write_diagnosis(
    statements: "Sequence[Diagnosis]",
    recording: "Recording",
    arguments: Namespace,
    warnings: Sequence[str] = (),
) -> None:
    """Write the diagnosis, and the warnings to standard error."""
    from imucal_wizard.estimate.fit_warnings import said_better

    read = [one for one in recording.warnings if not said_better(one, warnings)]
    notes = list(dict.fromkeys([*read, *warnings]))
    if arguments.json:
        from imucal_wizard.report.bench_document import bench_document

        write_json(bench_document(statements, notes), arguments.json)
    if arguments.json != STANDARD_OUT:
        from imucal_wizard.report.bench_text import bench_text

        say(bench_text(statements))
        notes = not_in_verdicts(notes, {one.sensor: one.says for one in statements})
    for warning in notes:
        note(f"warning: {warning}")
    note_spans(statements)


def base_terms(text: str) -> dict[str, tuple[str, ...]]:
    """The terms of ``--base`` by sensor; ``none`` leaves all of them out.

    A word with a sensor in front is that sensor's alone; a sensor without any has the others. Scale
    and non-orthogonality of a magnetometer are its soft iron.

    Raises:
        UsageError: a word that is no term of a base.
    """
    words = [word.strip() for word in text.split(",") if word.strip()]
    _check_base(words)
    plain = [word for word in words if "/" not in word]
    found = {}
    for sensor, whole in BASES.items():
        own = [word.partition("/")[2] for word in words if word.startswith(f"{sensor}/")]
        asked = set(own or plain)
        if sensor == "magnetometer" and "non-orthogonality" in asked:
            asked.add("soft-iron")
        found[sensor] = tuple(term for term in whole if term in asked) if asked else whole
    return found


def _check_base(words: Sequence[str]) -> None:
    inertial = {"none", *BASES["accelerometer"]}
    known = {*inertial, "soft-iron"}
    for word in words:
        sensor, slash, term = word.rpartition("/")
        own_terms = known if sensor in ("", "magnetometer") else inertial
        if term not in own_terms or (slash and sensor not in BASES):
            raise UsageError(
                f"--base: {word!r} is not in the base; it has {', '.join(sorted(own_terms))}"
            )


def wanted_terms(texts: Sequence[str]) -> dict[str, list[str]]:
    """The terms of ``--add`` by sensor.

    Raises:
        UsageError: not ``TERM`` or ``SENSOR/TERM``, or a term of another sensor.
    """
    from imucal_wizard.model.catalogue import builtin_effects, sensor_and_term
    from imucal_wizard.model.unknown_shape import FREE_CURVES

    first, *_ = BASES
    wanted: dict[str, list[str]] = {name: [] for name in BASES}
    every = (*builtin_effects(), *FREE_CURVES)
    only = {one.name: one.sensors[0] for one in every if len(one.sensors) == 1}
    only["soft-iron"] = "magnetometer"
    for text in texts:
        sensor, term = sensor_and_term(text)
        if sensor not in ("", *BASES):
            raise UsageError(f"--add {text!r}: {sensor!r} is no sensor here; write gyroscope/TERM")
        if not sensor and only.get(term, first) != first:
            raise UsageError(f"{term} is an effect of the {only[term]}; write {only[term]}/{term}")
        wanted[sensor or first].append(term)
    return wanted
