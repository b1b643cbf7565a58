"""A saved calibration becomes part of the history of its device.

Each sensor then has its error as found: that of the new readings with the previous calibration.
The error as left is the one that the new calibration leaves.
"""

import math
from collections.abc import Iterable, Sequence
from contextlib import suppress
from pathlib import Path

import msgspec

from imucal_wizard.core.dates import seconds_of
from imucal_wizard.core.errors import ImucalError, UsageError
from imucal_wizard.model.effect import Effect
from imucal_wizard.report.calibration_file import AsFound, Calibration, read_calibration
from imucal_wizard.report.proof import Proof, own
from imucal_wizard.sessions import default_directory
from imucal_wizard.sessions.catalogue import Catalogue
from imucal_wizard.sessions.catalogue_rows import measurement_key
from imucal_wizard.sessions.history import DeviceHistory


def save_in_history(
    calibration: Calibration,
    path: Path,
    folder: Path | None,
    *,
    force: bool = False,
    effects: Sequence[Effect] = (),
) -> list[str]:
    """Save a calibration; where it names its device, keep it in the device's history.

    Args:
        calibration: the result.
        path: the file to write.
        folder: of sessions and histories; None for the user's.
        force: write the sensors that are not usable, too.
        effects: the user's own that this calibration or the one before may have.

    Returns:
        What was saved and left out, and what to know of the history, in lines.

    Raises:
        DataError: no sensor is usable; nothing is written.
        UsageError: the file cannot be written.
    """
    named = calibration.device_name
    says = [saved_text(path, not_in_file(calibration, force=force))]
    if not named:
        calibration.save(path, force=force)
        return says
    with Catalogue(folder or default_directory()) as catalogue:
        try:
            calibration = _with_as_found(calibration, catalogue, effects)
        except ImucalError as error:  # the calibration before is damaged or of another kind
            says.append(f"as found is not known: {error}")
        calibration.save(path, force=force)
        try:
            catalogue.add_calibration(path)
            says.append(f"kept in the history of {named}")
        except ImucalError as error:
            says.append(f"not kept in the history of {named}: {error}")
        return [*says, *catalogue.notes]


def not_in_file(
    calibration: Calibration, measured: Iterable[str] = (), *, force: bool = False
) -> tuple[str, ...]:
    """The sensors that the file does not have because they have no usable calibration.

    Args:
        calibration: the result.
        measured: sensors that were measured; those without a calibration are left out, too.
        force: the sensors that are not usable are written, too.
    """
    unusable = () if force else calibration.unusable
    every = dict.fromkeys((*measured, *calibration.sensors))
    return tuple(name for name in every if name in unusable or name not in calibration.sensors)


def saved_text(path: Path, without: Sequence[str]) -> str:
    """What is saved in a file, and the sensors that it does not have."""
    return f"saved: {path}" + (f" without the {' and the '.join(without)}" if without else "")


def _with_as_found(
    calibration: Calibration, catalogue: Catalogue, effects: Sequence[Effect]
) -> Calibration:
    """The calibration with its error by the one before, of each sensor that has both.

    Raises:
        ImucalError: the calibration before cannot be read or applied.
    """
    path = _calibration_before(calibration, catalogue)
    if path is None:
        return calibration
    before = read_calibration(path)
    same = {
        name: correction
        for name, correction in own(before, effects).items()
        if name in calibration.sensors
        and before[name].bias_unit == calibration[name].bias_unit
        and before[name].unit == calibration[name].unit
    }
    errors = Proof(calibration, effects).errors(same, frame=True)
    sensors = {
        name: msgspec.structs.replace(one, as_found=AsFound(errors[name], path.name, before.date))
        if name in errors
        else one
        for name, one in calibration.sensors.items()
    }
    return msgspec.structs.replace(calibration, sensors=sensors)


def history_of(calibration: Calibration, catalogue: Catalogue) -> DeviceHistory | None:
    """The history of the device of a calibration; None where it has none."""
    serial = calibration.serial
    for named in filter(None, (serial, calibration.device_name)):
        with suppress(UsageError):  # not known by this
            found = catalogue.history(named)
            if not serial or found.device.serial in ("", serial):
                return found
    return None


def own_key(calibration: Calibration) -> str:
    """What calibrations of the same measurement have in common, see ``measurement_key``."""
    means = calibration.hold_means, calibration.field_means, calibration.table_means
    return measurement_key(calibration.session, *means)


def _calibration_before(calibration: Calibration, catalogue: Catalogue) -> Path | None:
    """The device's newest calibration of an earlier measurement; None for its first one."""
    history = history_of(calibration, catalogue)
    if history is None:
        return None
    key = own_key(calibration)
    when = seconds_of(calibration.date) or math.inf
    earlier = [
        one.path for one in history.calibrations if one.measurement != key and one.measured <= when
    ]
    return earlier[-1] if earlier else None
