"""Exports for other programs, one file per target, found by discovery.

A file of this folder defines ``TARGET``, an ``ExportTarget``. Its ``read`` follows the other
program's own formula, not ``write``: every export is read back and applied to the holds in the
calibration, so that an error in ``write`` shows at once.
"""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.output import write_atomically
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass
from imucal_wizard.report.calibration_file import Calibration

Correction = Callable[[FloatArray], FloatArray]
"""Accelerometer readings, shape (n, 3), to corrected ones, m/s²."""


@dataclass(frozen=True)
class ExportTarget:
    """A program that a calibration can be written for.

    Attributes:
        name: for the command line.
        title: what the program is.
        formula: of the program.
        suffix: of its files.
        cannot_hold: what its file cannot hold.
        holds_effects: whether it also corrects effects.
        write: makes the file's content. It raises ``UsageError`` if the target cannot hold the
            calibration at all.
        read: makes the program's correction from the file's content. It raises ``ValueError`` for
            a file of another kind.
    """

    name: str
    title: str
    formula: str
    suffix: str
    cannot_hold: tuple[str, ...]
    holds_effects: bool
    write: Callable[[Calibration], bytes]
    read: Callable[[bytes], Correction]


@dataclass(frozen=True)
class Exported:
    """A written export and its errors.

    Attributes:
        target: name of the target.
        path: the file.
        formula: of the program.
        cannot_hold: what of this calibration the file does not have.
        rms_before: of ``|reading| − g`` over the holds, or None for counts.
        rms_calibration: of ``|corrected| − g`` over the holds, by the calibration; None where the
            calibration file has no holds.
        rms_exported: the same by the written file in the program's formula.
        unit: of the errors.
    """

    target: str
    path: Path
    formula: str
    cannot_hold: tuple[str, ...]
    rms_before: float | None
    rms_calibration: float | None
    rms_exported: float | None
    unit: str = "m/s^2"


def targets() -> dict[str, ExportTarget]:
    """All targets by name."""
    found = [
        import_module(f"{__name__}.{module.name}").TARGET
        for module in sorted(iter_modules(__path__), key=lambda one: one.name)
    ]
    return {target.name: target for target in found}


def target_named(name: str) -> ExportTarget:
    """One target.

    Raises:
        UsageError: there is no such target.
    """
    known = targets()
    if name not in known:
        raise UsageError(f"there is no export target {name!r}; there are {', '.join(known)}")
    return known[name]


def path_beside(source: Path, target: ExportTarget) -> Path:
    """The usual place of an export, beside the calibration file that it is made from."""
    word = "export" if target.suffix == f".{target.name}" else target.name
    return source.with_name(f"{source.stem}.{word}{target.suffix}")


def not_held(target: ExportTarget, calibration: Calibration) -> tuple[str, ...]:
    """What of a calibration an export does not have, in words."""
    effects = [] if target.holds_effects else calibration["accelerometer"].effects
    return (*target.cannot_hold, *(f"{one.term} of the {one.sensor}" for one in effects))


def write_export(calibration: Calibration, name: str, path: Path) -> Exported:
    """Write a calibration for a target, and check the file by reading it back.

    Raises:
        UsageError: there is no such target; it cannot hold this calibration; the place cannot be
            written, or holds a file of another kind.
    """
    target = target_named(name)
    if "accelerometer" not in calibration.sensors:
        raise UsageError(f"{name} needs an accelerometer's calibration, and this file has none")
    data = target.write(calibration)
    _spare_others(target, path)
    write_atomically(path, data)
    correction, sensor = target.read(path.read_bytes()), calibration["accelerometer"]
    gravity, readings = calibration.gravity.value, calibration.means()

    def rms(corrected: FloatArray) -> float | None:
        error = np.linalg.norm(corrected, axis=1) - gravity
        return float(np.sqrt(np.mean(error**2))) if len(error) else None

    return Exported(
        target=name,
        path=path,
        formula=target.formula,
        cannot_hold=not_held(target, calibration),
        rms_before=rms(readings) if sensor.bias_unit == "m/s^2" else None,
        rms_calibration=rms(sensor.apply(readings, calibration.circumstances())),
        rms_exported=rms(correction(readings)),
    )


def _spare_others(target: ExportTarget, path: Path) -> None:
    """Refuse to overwrite anything but an earlier export to the same target.

    Raises:
        UsageError: there is another file of this name.
    """
    if path.is_dir():
        raise UsageError(f"{path} is a folder; give a file in it")
    if not path.exists():
        return
    try:
        target.read(path.read_bytes())
    except (OSError, ValueError) as error:
        raise UsageError(
            f"{path} is there already and is no file for {target.name}: give another name"
        ) from error
