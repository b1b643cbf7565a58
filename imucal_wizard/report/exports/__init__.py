"""Exports for other programs, one file per target, found by discovery.

A file of this folder defines ``TARGET``, an ``ExportTarget``. Its ``read`` follows the other
program's own formula and rounding, not ``write``: every export is read back and applied to what
the calibration file has measured, so that an error in ``write`` shows at once. What the program
does not know is not cut out of the matrix: the smaller model is fitted again (``reduced``).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules
from typing import Any

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.output import write_atomically
from imucal_wizard.core.quantities import quantity
from imucal_wizard.core.records import dataclass, fields_of
from imucal_wizard.core.units import SI_UNIT
from imucal_wizard.model.effect import Effect
from imucal_wizard.report.axes import Axes, named_values
from imucal_wizard.report.calibration_file import Calibration
from imucal_wizard.report.proof import Correction, Proof, nominal, own
from imucal_wizard.report.reduced import Kept, reduced

OWN_FRAME = "a rate table does not show its orientation to the accelerometer or in its housing"
FORWARD = "from the reading to the corrected value"
BACKWARD = "from the true value to the reading: matrices are inverse to those of this program"
Files = Mapping[str, bytes]
"""Contents by what follows the stem of the path; "" is the path itself."""


@dataclass(frozen=True)
class ExportSettings:
    """What a target may need beyond the calibration.

    Attributes:
        present: a parameter file that the flight controller applied while it was recorded, or None
            where the readings are those of the bare sensor.
        noise: figures of an Allan deviation by sensor: ``white`` and ``random_walk``, SI.
        slot: number of the sensor in the flight controller, from 0.
        counts_per_g: of a flight controller that counts; None for the usual number.
        effects: the user's own that the calibration may have.
    """

    present: bytes | None = None
    noise: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    slot: int = 0
    counts_per_g: float | None = None
    effects: tuple[Effect, ...] = ()


@dataclass(frozen=True)
class ExportTarget:
    """A program that a calibration can be written for.

    Attributes:
        name: for the command line.
        title: what the program is.
        formula: of the program.
        suffix: of its files.
        cannot_hold: what its file cannot hold.
        keeps: what it knows of each sensor; one that is not there is left out.
        write: makes the files from the calibration reduced to ``keeps``. It raises ``UsageError``
            if the target cannot hold the calibration at all.
        read: makes the program's correction of each sensor from the files. It raises ``ValueError``
            for files of another kind.
        direction: in which the formula acts.
        counts: whether it takes readings in counts.
        loses: what else of a calibration it loses, in words.
        notes: what the user must know or do.
        composes: how the names of the parameters begin that ``present`` must have; nothing where
            the program corrects no readings before they are recorded.
        uses: names of the settings, beside ``present``, that it takes.
        sent: the bytes that are sent to the board that uses the files; None where nothing is.
        echoed: whether lines of that board confirm the files; see ``acquire.write_back``.
        frame: whether the accelerometer and the gyroscope share a body frame of its own.
        corrects: how a controller with the parameters ``present`` corrects a sensor before its
            readings are recorded; None where the program does not.
    """

    name: str
    title: str
    formula: str
    suffix: str
    cannot_hold: tuple[str, ...]
    keeps: Mapping[str, Kept]
    write: Callable[[Calibration, ExportSettings], Files]
    read: Callable[[Files, ExportSettings], Mapping[str, Correction]]
    direction: str = FORWARD
    counts: bool = True
    loses: Callable[[Calibration], tuple[str, ...]] = lambda _calibration: ()
    notes: Callable[[Calibration, ExportSettings], tuple[str, ...]] = lambda _one, _settings: ()
    composes: tuple[str, ...] = ()
    uses: tuple[str, ...] = ()
    sent: Callable[[Files], bytes] | None = None
    echoed: Callable[[Files, Sequence[str]], str | None] = lambda _files, _lines: ""
    frame: bool = False
    corrects: Callable[[ExportSettings, str], Axes] | None = None


@dataclass(frozen=True)
class ExportErrors:
    """Errors of one sensor on what the calibration file has measured.

    Attributes:
        rms_before: of the readings as they are, or None for counts.
        rms_calibration: by the calibration.
        rms_exported: by the written file in the program's formula.
        unit: of the errors.
    """

    rms_before: float | None
    rms_calibration: float
    rms_exported: float
    unit: str

    @property
    def worse_than_none(self) -> bool:
        """Whether the readings as they are err less than those that the file corrects."""
        return self.rms_before is not None and self.rms_exported > self.rms_before

    def __str__(self) -> str:
        full, exported = (quantity(e, self.unit) for e in (self.rms_calibration, self.rms_exported))
        before = (
            "" if self.rms_before is None else f"before {quantity(self.rms_before, self.unit)}, "
        )
        return f"{before}calibration {full}, exported {exported}"


@dataclass(frozen=True)
class Exported:
    """A written export and its errors.

    Attributes:
        target: name of the target.
        path: the file.
        formula: of the program.
        cannot_hold: what of this calibration the file does not have.
        rms_before: of the first sensor of ``sensors``; None for counts or where nothing is proven.
        rms_calibration: the same by the calibration.
        rms_exported: the same by the written file in the program's formula.
        unit: of the errors.
        direction: in which the formula acts.
        notes: which models were fitted again, and what the user must know or do.
        files: all files written, ``path`` first.
        sensors: errors of each sensor that the file corrects; empty where the calibration file has
            no measurements.
    """

    target: str
    path: Path
    formula: str
    cannot_hold: tuple[str, ...]
    rms_before: float | None
    rms_calibration: float | None
    rms_exported: float | None
    unit: str = "m/s^2"
    direction: str = FORWARD
    notes: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    sensors: Mapping[str, ExportErrors] = field(default_factory=dict)

    @property
    def worse(self) -> list[str]:
        """The sensors that the file corrects worse than not at all."""
        return [name for name, one in self.sensors.items() if one.worse_than_none]

    def lines(self) -> list[tuple[str, str]]:
        """What was written and how it was proven; each line after its kind.

        The kinds are ``about``, ``lost``, ``note``, ``error``, ``file`` and ``worse``.
        """
        unproven = "not proven: this calibration file has no measurements to apply the export to"
        worse = "▲ what this file holds of the {} is worse than no calibration: do not use it"
        return [
            ("about", self.formula),
            ("about", self.direction),
            *(("lost", f"cannot hold: {text}") for text in self.cannot_hold),
            *(("note", f"note: {text}") for text in self.notes),
            *(("error", f"error of the {name}: {one}") for name, one in self.sensors.items()),
            *([] if self.sensors else [("error", unproven)]),
            *(("file", f"written: {path}") for path in self.files or (self.path,)),
            *(("worse", worse.format(name)) for name in self.worse),
        ]


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
        raise UsageError(f"there is no export target {name!r}; give one of {', '.join(known)}")
    return known[name]


def path_beside(source: Path, target: ExportTarget) -> Path:
    """The usual place of an export, beside the calibration file that it is made from."""
    word = "export" if target.suffix == f".{target.name}" else target.name
    return source.with_name(f"{source.stem}.{word}{target.suffix}")


def targets_document() -> dict[str, Any]:
    """The targets for scripts, with what each cannot hold."""
    listed = [
        {"name": one.name, "title": one.title, "cannot_hold": one.cannot_hold}
        for one in targets().values()
    ]
    return {"schema": "imucal-wizard/export-list/1", "targets": listed}


def export_document(done: Exported) -> dict[str, Any]:
    """What was written, for scripts (export/1)."""
    places = {"path": str(done.path), "files": [str(one) for one in done.files]}
    sensors = {name: fields_of(one) for name, one in done.sensors.items()}
    return {"schema": "imucal-wizard/export/1", **fields_of(done), **places, "sensors": sensors}


def write_export(
    calibration: Calibration, name: str, path: Path, settings: ExportSettings | None = None
) -> Exported:
    """Write a calibration for a target, and check the files by reading them back.

    Raises:
        DataError: the data do not determine the smaller model that the target holds.
        UsageError: there is no such target; it cannot hold this calibration; the place cannot be
            written, or holds a file of another kind.
    """
    target, settings = target_named(name), settings or ExportSettings()
    if not target.counts:
        _refuse_counts(target, calibration)
    _check_used(target, settings)
    _check_present(target, settings.present)
    smaller, lost, again = reduced(calibration, target.keeps, settings.effects)
    files = target.write(smaller, settings)
    places = {tail: path.with_name(path.stem + tail) if tail else path for tail in files}
    _spare_others(target, places, settings)
    proof = Proof(calibration, settings.effects)
    before = proof.errors(nominal(calibration), frame=False)
    full = proof.errors(own(calibration, settings.effects), frame=False)
    for tail, data in files.items():
        write_atomically(places[tail], data)
    corrections = target.read({tail: at.read_bytes() for tail, at in places.items()}, settings)
    exported = proof.errors(corrections, frame=target.frame)
    sensors = {
        sensor: ExportErrors(before.get(sensor), full[sensor], error, calibration[sensor].unit)
        for sensor, error in exported.items()
    }
    general = tuple(text.removeprefix("the ") for text in target.cannot_hold)
    new = [one for one in lost if not any(t.startswith(one.removeprefix("the ")) for t in general)]
    first = next(iter(sensors.values()), ExportErrors(None, 0.0, 0.0, "m/s^2"))
    return Exported(
        target=name,
        path=path,
        formula=target.formula,
        cannot_hold=(*target.cannot_hold, *new, *target.loses(smaller)),
        rms_before=first.rms_before if sensors else None,
        rms_calibration=first.rms_calibration if sensors else None,
        rms_exported=first.rms_exported if sensors else None,
        unit=first.unit,
        direction=target.direction,
        notes=(*again, *_own_frame(smaller), *target.notes(smaller, settings)),
        files=tuple(places.values()),
        sensors=sensors,
    )


def _own_frame(calibration: Calibration) -> tuple[str, ...]:
    """That the mounting of a gyroscope calibrated by a rate table alone is not known."""
    gyroscope = calibration.sensors.get("gyroscope")
    if gyroscope is None or gyroscope.frame != "own":
        return ()
    return (f"the gyroscope is in its own frame: {OWN_FRAME}",)


def _refuse_counts(target: ExportTarget, calibration: Calibration) -> None:
    for name in target.keeps.keys() & calibration.sensors.keys():
        sensor = calibration[name]
        if sensor.bias_unit != SI_UNIT[name]:
            raise UsageError(
                f"{target.name} corrects readings in {SI_UNIT[name]}, and this calibration of the "
                f"{name} is of readings in {sensor.bias_unit}: calibrate what the driver publishes"
            )


_SETTINGS = {"noise": "noise", "slot": "number of a sensor", "counts_per_g": "counts per g"}


def _check_used(target: ExportTarget, settings: ExportSettings) -> None:
    """Refuse a setting that would change nothing.

    Raises:
        UsageError: the target does not take it.
    """
    usual = ExportSettings()
    for name, words in _SETTINGS.items():
        if name not in target.uses and getattr(settings, name) != getattr(usual, name):
            raise UsageError(f"{target.name} takes no {words}: leave it out")


def _check_present(target: ExportTarget, present: bytes | None) -> None:
    """Refuse present parameters that are none of the target.

    Raises:
        UsageError: they are those of another program.
    """
    if present is None:
        return
    if not target.composes:
        raise UsageError(f"{target.name} takes no present parameters: it corrects bare readings")
    try:
        names = list(named_values(present))
    except ValueError:
        names = []
    if not any(name.startswith(target.composes) for name in names):
        wanted = " or ".join(target.composes)
        raise UsageError(
            f"the present parameters are none of {target.name}: no name begins with {wanted}"
        )


def _spare_others(
    target: ExportTarget, places: Mapping[str, Path], settings: ExportSettings
) -> None:
    """Refuse to overwrite anything but an earlier export to the same target.

    Raises:
        UsageError: there is another file of this name.
    """
    there = {tail: place for tail, place in places.items() if place.exists()}
    for place in there.values():
        if place.is_dir():
            raise UsageError(f"{place} is a folder; give a file in it")
    try:
        if there:
            target.read({tail: place.read_bytes() for tail, place in there.items()}, settings)
    except (OSError, ValueError, LookupError, TypeError) as error:
        names = " or ".join(map(str, there.values()))
        raise UsageError(
            f"{names} exists and is not a file for {target.name}: give another name"
        ) from error
