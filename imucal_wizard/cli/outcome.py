"""What several commands do: read, fit, save, and answer in text and JSON.

No command writes over a recording, nor over a file of another kind without ``--force``.
"""

import argparse
import sys
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from imucal_wizard.cli.arguments import (
    STANDARD_OUT,
    gravity_given,
    location_given,
    own_effects,
    recording_options,
    said_about,
    table_options,
)
from imucal_wizard.core.errors import DataError, PlaceError, UsageError
from imucal_wizard.core.output import (
    begins_otherwise,
    encode_json,
    note,
    readers_may_leave,
    say,
    write_atomically,
)

if TYPE_CHECKING:  # numpy is imported after the options are checked
    from imucal_wizard.api import Fit, Recording
    from imucal_wizard.diagnose.diagnosis import Diagnosis
    from imucal_wizard.estimate.result import FitReport
    from imucal_wizard.report.calibration_file import Calibration


def recording_of(arguments: argparse.Namespace) -> "Recording":
    """The recording or session that a command was given.

    Raises:
        InputError: a file cannot be read.
    """
    from imucal_wizard.api import Recording

    options = recording_options(arguments)
    on_table = any(table_options(arguments))
    return Recording(arguments.files, options, all_samples=arguments.all_samples, on_table=on_table)


def note_spans(diagnosis: "Collection[Diagnosis]") -> None:
    """Give the option that leaves out the holds of which a verdict says so."""
    if not diagnosis:
        return
    from imucal_wizard.diagnose.verdict_text import spans_to_leave_out

    spans = dict.fromkeys(span for one in diagnosis for span in spans_to_leave_out(one))
    if spans:
        options = " ".join(f"--without {start:.1f}:{end:.1f}" for start, end in spans)
        note(f"without what was disturbed: {options}")


def calibrated(
    arguments: argparse.Namespace, command: str, methods: Mapping[str, str] | None = None
) -> "Fit":
    """The fit of a command; if the data are insufficient, its JSON document gives the reason.

    Args:
        arguments: with the options of ``fitting_parser`` and ``add_field``.
        command: whose document it is.
        methods: by sensor.

    Raises:
        DataError: the data do not determine a calibration.
    """
    from imucal_wizard.api import calibrate

    recording = recording_of(arguments)
    rates, turns = table_options(arguments)
    try:
        return calibrate(
            recording,
            gravity=gravity_given(arguments),
            field=arguments.field,
            methods=methods,
            rates=rates,
            turns=turns,
        )
    except DataError as error:
        if arguments.json:
            from imucal_wizard.report.document import failure_document

            write_json(failure_document(command, str(error), recording.warnings), arguments.json)
        for warning in recording.warnings:
            note(f"warning: {warning}")
        raise


def save_usable(
    calibration: "Calibration", place: Path, arguments: argparse.Namespace
) -> list[str]:
    """Save the usable sensors, all of them with ``--force``, and keep them in a history.

    Args:
        calibration: the result.
        place: the file.
        arguments: with the options of ``add_saving``.

    Returns:
        What was saved and what was left out, in lines.

    Raises:
        DataError: no sensor is usable; nothing is written.
        PlaceError: the file cannot be written.
    """
    from imucal_wizard.report.calibration_record import described, located
    from imucal_wizard.report.device_history import save_in_history

    made = described(calibration, said_about(arguments), measured=getattr(arguments, "date", None))
    if where := location_given(arguments):
        made = located(made, where)
    effects = own_effects(getattr(arguments, "effects", ()))
    first, *says = save_in_history(
        made, place, arguments.sessions, force=arguments.force, effects=effects
    )
    hint = " (--force saves all)" if made.unusable and not arguments.force else ""
    return [first + hint, *says]


def save_or_print(
    calibration: "Calibration", arguments: argparse.Namespace, report: "FitReport"
) -> bool:
    """Save the usable sensors to the file of ``--save``; print what cannot be written.

    Args:
        calibration: the result.
        arguments: with the options of ``add_saving``.
        report: the fit; where a rate table turned the device, only the gyroscope is wanted.

    Returns:
        Whether a sensor was left out.

    Raises:
        PlaceError: the file cannot be written.
    """
    tell = note if getattr(arguments, "json", None) == STANDARD_OUT else say
    wanted = ["gyroscope"] if report.on_table else report.rates
    without = [name for name in wanted if name not in calibration.sensors]
    try:
        for text in save_usable(calibration, arguments.save, arguments):
            tell(text)
        if without:
            tell(f"not saved, because not calibrated: the {' and the '.join(without)}")
    except DataError:
        tell("not saved: no sensor has a usable calibration (--force saves it all the same)")
    except PlaceError:
        from imucal_wizard.report.text import correction_text

        tell(correction_text(calibration))
        raise
    return bool(without or (calibration.unusable and not arguments.force))


def answer(place: str | None, document: object, text: str) -> None:
    """Print the text and write the document of ``--json``; only the latter on standard output.

    Args:
        place: that of ``--json``: a file, ``-`` for standard output, or None.
        document: for scripts.
        text: for readers.

    Raises:
        UsageError: the file cannot be written.
    """
    if place != STANDARD_OUT:
        say(text)
    if place:
        write_json(document, place)


def write_json(document: object, place: str) -> None:
    """Write one JSON document to a file, or to standard output for ``-``.

    Raises:
        UsageError: the file cannot be written.
    """
    data = encode_json(document)
    if place == STANDARD_OUT:
        with readers_may_leave(sys.stdout):
            sys.stdout.buffer.write(data)
            sys.stdout.buffer.flush()
        return
    write_atomically(Path(place), data)


def spare(files: Sequence[Path], *places: str | Path | None) -> None:
    """Refuse to write over an input file: a measurement cannot be repeated.

    Raises:
        UsageError: a place is one of the files.
    """
    for place in places:
        if place is not None and any(_same(Path(place), file) for file in files):
            raise UsageError(f"{place} is an input file: give another name to write to")


def spare_others(arguments: argparse.Namespace) -> None:
    """Refuse to write over a file of another kind, unless ``--force`` is given.

    Raises:
        UsageError: the place of ``--json`` is no JSON, or that of ``--save`` no calibration.
    """
    document, place = getattr(arguments, "json", None), getattr(arguments, "save", None)
    if getattr(arguments, "force", False):
        return
    if document not in (None, STANDARD_OUT) and begins_otherwise(Path(document), b"{"):
        raise UsageError(f"{document} exists and is not JSON: give another name")
    if place is not None and begins_otherwise(place, b'"imucal-wizard/calibration/'):
        raise UsageError(f"{place} exists and is not a calibration: give another name, or --force")


def _same(place: Path, file: Path) -> bool:
    try:
        return place.samefile(file)
    except OSError:  # one of them does not exist
        return False
