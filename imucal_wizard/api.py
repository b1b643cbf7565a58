"""The public Python interface; the commands are thin callers of it.

>>> import imucal_wizard as iw
>>> recording = iw.read("imu.csv")
>>> fit = iw.calibrate(recording)
>>> list(fit), "magnetometer" in fit
(['accelerometer', 'gyroscope'], False)
>>> fit["accelerometer"].parameters["bias_x"].unit
'm/s^2'
>>> fit["accelerometer"].rms_held_out < fit["accelerometer"].rms_before
True
>>> diagnosis = iw.diagnose(fit)
>>> print(diagnosis["accelerometer"].verdict)
complete
>>> path = fit.calibration.save("my.json")
>>> readings = recording.readings.accelerometer.values
>>> iw.load(path)["accelerometer"].apply(readings).shape == readings.shape
True
>>> iw.export(iw.load(path), "ros-imu-calib", "imu.yaml").rms_exported < 0.01
True
"""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

import imucal_wizard.diagnose as _diagnose_package
from imucal_wizard.acquire.files import RecordingOptions, is_session
from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.dates import iso_now
from imucal_wizard.core.errors import DataError, UsageError
from imucal_wizard.core.input import is_file
from imucal_wizard.core.readings import Readings, Series
from imucal_wizard.core.units import (
    FIELD_ON_EARTH,
    FIELD_ON_EARTH_TEXT,
    GRAVITY_ON_EARTH,
    GRAVITY_ON_EARTH_TEXT,
    STANDARD_GRAVITY,
)
from imucal_wizard.estimate.recording import FitOptions, fit_readings
from imucal_wizard.estimate.result import FitReport

if TYPE_CHECKING:  # imported where they are needed: importing is a third of a cold fit
    from imucal_wizard.diagnose.benches import Benches
    from imucal_wizard.diagnose.diagnosis import Diagnosis
    from imucal_wizard.diagnose.grade import Limits
    from imucal_wizard.diagnose.recheck import Recheck
    from imucal_wizard.guide.steps.recheck import Planner
    from imucal_wizard.measurement.holds import Hold
    from imucal_wizard.model.effect import Effect
    from imucal_wizard.report.calibrated_device import CalibratedDevice
    from imucal_wizard.report.calibration_file import Calibration, Sensor
    from imucal_wizard.report.exports import Exported, ExportSettings
    from imucal_wizard.run.review import ReviewedSession

__all__ = ["Fit", "Recording", "calibrate", "diagnose", "export", "load", "read"]


class Recording:
    """A recording: the samples of files, or of a session as the operator left it.

    Withdrawn and repeated measurements of a session, and the holds of its validation, are left out.
    If the remaining data do not determine a calibration, or with ``all_samples``, all samples
    count.

    Args:
        paths: recordings of one session, or one session file.
        options: what the files do not say.
        all_samples: treat a session as a plain recording.
        on_table: a rate table turned the device; see ``read``.
        planner: has chosen the poses of a session that is a recheck.

    Raises:
        InputError: a file cannot be read.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        options: RecordingOptions | None = None,
        *,
        all_samples: bool = False,
        on_table: bool = False,
        planner: "Planner | None" = None,
    ) -> None:
        self.paths = tuple(paths)
        self._options = options or RecordingOptions()
        self._on_table = on_table
        all_samples |= on_table or bool(self._options.without)  # the wizard has kept whole holds
        alone = len(self.paths) == 1 and not self._options.as_format and is_session(self.paths[0])
        self._session: ReviewedSession | None = None
        self._notes: tuple[str, ...] = ()
        if alone and not all_samples:
            from imucal_wizard.run.review import review_session

            self._session = review_session(self.paths[0], self._options, planner)
        else:
            self._notes = self._corrections()

    def _corrections(self) -> tuple[str, ...]:
        """Warnings about what the operator withdrew in the sessions among the files."""
        sessions = [path for path in self.paths if is_session(path)]
        if not sessions:
            return ()
        from imucal_wizard.acquire.files.session_salvage import corrections_note  # SQLite

        return tuple(text for path in sessions for text in corrections_note(path))

    @cached_property
    def readings(self) -> Readings:
        """All samples, SI or counts.

        Raises:
            RecordingError: the files cannot be read.
        """
        return replace(self._samples, warnings=(*self._notes, *self._samples.warnings))

    @cached_property
    def _samples(self) -> Readings:
        return read_files(self.paths, self._options, field_alone=True, on_table=self._on_table)

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was noticed while reading."""
        if self._session is None:
            return self.readings.warnings
        return (*self._notes, *self._session.stream.warnings)

    @property
    def gyroscope_unit(self) -> str | None:
        """Unit of the gyroscope's readings; None without one."""
        if self._session is None:
            gyroscope = self.readings.gyroscope
            return None if gyroscope is None else gyroscope.unit
        stream = self._session.stream
        return None if stream.gyroscope is None else stream.gyroscope_unit

    @property
    def field(self) -> Series | None:
        """The magnetometer's samples that its fit uses; None without any."""
        if self._session is None:
            return self.readings.magnetometer
        kept = self._session.collected
        if kept.magnetometer is None or not kept.field_spans:
            return None
        from imucal_wizard.estimate.magnetometer.report import samples_during

        return samples_during(kept.field_spans, kept.magnetometer)

    @property
    def known(self) -> dict[str, Any]:
        """What a session tells of its device and measurement; see ``described``."""
        from imucal_wizard.core.description import Description

        if self._session is None:
            return {"about": Description()}
        from imucal_wizard.core.dates import iso_date
        from imucal_wizard.sessions.session_list import session_info

        info = session_info(self.paths[0])
        return {
            "about": info.description,
            "stream_format": self._session.stream.format,
            "session": info.path.name,
            "measured": iso_date(info.created),
        }

    @cached_property
    def fingerprint(self) -> str | None:
        """Of what was recorded; None where it can be read only once, as from a pipe."""
        if not all(is_file(path) for path in self.paths):
            return None
        from imucal_wizard.acquire.files.session_salvage import fingerprint  # SQLite

        return fingerprint(self.paths)

    @property
    def gravity(self) -> float:
        """Local gravity that a session was carried out with, else standard gravity, m/s²."""
        return STANDARD_GRAVITY if self._session is None else self._session.gravity

    def fit(self, options: FitOptions) -> FitReport:
        """The fit without effects.

        Args:
            options: gravity and methods.

        Raises:
            DataError: the data do not determine a calibration.
        """
        session = self._session
        if session is None:
            return fit_readings(self.readings, options)
        from imucal_wizard.run.review import fit_stream

        try:
            kept = session.collected
            report = fit_stream(kept, session.stream, options, self.behind(kept.holds))
        except DataError as error:
            self._session = None
            note = (
                f"the holds that the wizard kept do not determine a calibration ({error}): all "
                "samples of the session are used instead, as those of a recording"
            )
            self._notes = (note, *self._corrections())
            return self.fit(options)
        if session.finished:
            return report
        note = (
            f"the session was left in the step {session.step}: what it had kept until then is "
            "used; read it with all samples to use everything that was received"
        )
        return replace(report, warnings=(note, *report.warnings))

    def rechecked(self, known: "CalibratedDevice") -> "Recheck":
        """Whether the device still agrees with its calibration.

        Args:
            known: the calibration.

        Raises:
            DataError: the recording is too short, or the device was never at rest.
            UsageError: its readings have another unit than those of the calibration.
        """
        from imucal_wizard.report.calibrated_device import recheck_collected, recheck_readings

        session = self._session
        if session is not None and session.collected.holds:
            kept, seconds = session.collected, session.seconds
            readings = self.behind(kept.holds)
            return recheck_collected(known, kept, session.stream, seconds, readings)
        if session is not None:
            self._session = None
            self._notes = ("the wizard kept no hold: all samples are used", *self._corrections())
        return recheck_readings(known, self.readings)

    def behind(self, holds: "Sequence[Hold]") -> Readings | None:
        """The samples of these holds; None where a session gives others when it is read again."""
        if self._session is None:
            return self.readings
        from imucal_wizard.sessions.stored_readings import made_of

        return self._samples if made_of(self._samples, holds) else None


class Fit:
    """The calibration of every sensor; ``fit["accelerometer"]`` is one sensor's.

    Args:
        recording: what was fitted.
        options: gravity, field and methods.
        base: terms of the base model by sensor; all of them where none are given.
        own: effects of the user's own.
    """

    def __init__(
        self,
        recording: Recording,
        options: FitOptions,
        *,
        base: Mapping[str, Sequence[str]] | None = None,
        own: "Sequence[Effect]" = (),
    ) -> None:
        self.recording = recording
        self.options = options
        self._base = base
        self._own = own

    @cached_property
    def report(self) -> FitReport:
        """Holds, rotations, residuals and the fit without effects.

        Raises:
            DataError: the data do not determine a calibration.
        """
        return self.recording.fit(self.options)

    @cached_property
    def benches(self) -> "Benches":
        """The bench of each sensor, where terms are added to its model and judged.

        Raises:
            DataError: the data determine no model of accelerometer or magnetometer.
        """
        from imucal_wizard.diagnose.benches import Benches

        readings = self.recording.behind(self.report.holds)
        return Benches(self.report, readings, self._base, self._own)

    def add(self, terms: Mapping[str, Sequence[str]]) -> None:
        """Add effects to the models.

        Args:
            terms: names by sensor.

        Raises:
            DataError: the data cannot show a term.
            UsageError: a sensor or term is not known.
        """
        for sensor, names in ((one, terms[one]) for one in terms if terms[one]):
            bench = self.benches.bench(sensor) if sensor in self.benches.report.rates else None
            if bench is None:
                raise UsageError(f"there is no {sensor} in this recording to add a term to")
            for name in names:
                bench.add(name)

    @property
    def calibration(self) -> "Calibration":
        """The result as it is saved, with the terms that were added."""
        from imucal_wizard.report.calibration_record import described, from_report

        source = ", ".join(path.name for path in self.recording.paths)
        made = from_report(self._fitted, source, iso_now())
        return described(made, **self.recording.known, fingerprint=self.recording.fingerprint)

    @property
    def _fitted(self) -> FitReport:
        """The fit with the terms that were added."""
        return self.benches.fitted() if "benches" in self.__dict__ else self.report

    def judged(
        self, diagnosis: "Mapping[str, Diagnosis]", limits: "Limits | None" = None
    ) -> "Calibration":
        """The result with the verdict on each sensor and its grade.

        Args:
            diagnosis: of the sensors, as ``diagnose`` gives it.
            limits: of use, by sensor, in m/s², rad and µT; the usual ones when left out.
        """
        from imucal_wizard.report.calibration_record import judged

        return judged(self.calibration, self._fitted, diagnosis, limits)

    def records(
        self, diagnosis: "Mapping[str, Diagnosis]", limits: "Limits | None" = None
    ) -> "dict[str, Sensor]":
        """Each sensor as it stands in JSON, with its verdict and its grade.

        Args:
            diagnosis: of the sensors, as ``diagnose`` gives it; empty for no verdicts.
            limits: of use, see ``judged``.
        """
        from imucal_wizard.report.calibration_record import sensor_records

        return sensor_records(self._fitted, diagnosis, limits)

    def __getitem__(self, sensor: str) -> "Sensor":
        """The calibration of a sensor.

        Raises:
            KeyError: it is not calibrated.
        """
        return self.records({})[sensor]

    def __iter__(self) -> "Iterator[str]":
        """Names of the calibrated sensors."""
        return iter(self._fitted.sensors)


def read(
    *files: str | os.PathLike[str],
    columns: Sequence[str] = (),
    rate: float | None = None,
    units: Mapping[str, str] | None = None,
    format: str | None = None,  # noqa: A002 - the word that the command line uses, too
    all_samples: bool = False,
    on_table: bool = False,
) -> Recording:
    """Read a recording: one file, several files of one session, or a session of the wizard.

    Args:
        files: CSV or another format that is recognised by its content.
        columns: names of the columns where the file has no header, like ``ax``; ``-`` skips one.
        rate: samples per second where no column is a time, Hz.
        units: unit of the readings by sensor where the file does not say it, like ``{"gyroscope":
            "deg/s"}``.
        format: name of the file format if the content does not show it, like ``imu_tk``.
        all_samples: of a session: use everything received, also what was taken back.
        on_table: a rate table turned the device: a gyroscope alone is sufficient, and files that
            hold the same sensor follow one another in time.

    Raises:
        InputError: a file cannot be read.
        UsageError: a unit is given for a sensor that does not exist.
    """
    given = _by_sensor(units)
    options = RecordingOptions(
        columns=tuple(columns),
        rate=rate,
        accelerometer_unit=given.get("accelerometer"),
        gyroscope_unit=given.get("gyroscope"),
        magnetometer_unit=given.get("magnetometer"),
        as_format=format,
    )
    paths = [Path(file) for file in files]
    return Recording(paths, options, all_samples=all_samples, on_table=on_table)


def calibrate(
    recording: Recording,
    terms: Mapping[str, Sequence[str]] | None = None,
    *,
    gravity: float | None = None,
    field: float | None = None,
    methods: Mapping[str, str] | None = None,
    rates: Sequence[float] = (),
    turns: Sequence[float] = (),
) -> Fit:
    """Find the holds and rotations of a recording and fit every sensor.

    Args:
        recording: what was recorded.
        terms: effects to add to the base model, by sensor, like ``{"gyroscope":
            ["g-sensitivity"]}``.
        gravity: local gravity, m/s²; that of the session, or standard gravity, when left out.
        field: magnitude of the local magnetic field, µT; without it the magnetometer's matrix has
            determinant 1.
        methods: the method by sensor, where it is not the default.
        rates: constant rates of the rate table that turned the gyroscope in a recording read with
            ``on_table``, rad/s; signs do not matter.
        turns: angles by which a turntable turned it between rests, rad; likewise.

    Raises:
        DataError: the data do not determine a calibration, or cannot show a term.
        UsageError: a term or sensor is not known, or gravity or field is not one of the Earth.
    """
    chosen = _by_sensor(methods)
    if gravity is not None and not GRAVITY_ON_EARTH[0] <= gravity <= GRAVITY_ON_EARTH[1]:
        raise UsageError(f"{gravity:g} is not {GRAVITY_ON_EARTH_TEXT}", settings=("gravity",))
    if field is not None and not FIELD_ON_EARTH[0] <= field <= FIELD_ON_EARTH[1]:
        raise UsageError(f"{field:g} is not {FIELD_ON_EARTH_TEXT}", settings=("field",))
    options = FitOptions(
        recording.gravity if gravity is None else gravity,
        chosen.get("accelerometer", FitOptions.method),
        chosen.get("gyroscope", FitOptions.gyroscope_method),
        chosen.get("magnetometer", FitOptions.magnetometer_method),
        field,
        tuple(abs(rate) for rate in rates),
        tuple(abs(angle) for angle in turns),
    )
    fit = Fit(recording, options)
    _ = fit.report  # what the data cannot determine is refused here
    fit.add(terms or {})
    return fit


def diagnose(fit: Fit, *, automatic: bool = False) -> "dict[str, Diagnosis]":
    """Whether each sensor's model is complete, what may be missing, and what to measure next.

    Args:
        fit: of a recording.
        automatic: add the terms that data held out confirm; ``fit`` has them afterwards.

    Returns:
        The diagnosis of each sensor; ``insufficient`` where the data determine no model.
    """
    from imucal_wizard.diagnose.survey import diagnose_benches

    try:
        return {one.sensor: one for one in diagnose_benches(fit.benches, {}, automatic)}
    except DataError as error:
        return undetermined(fit.recording, error)


def undetermined(recording: Recording, error: DataError) -> "dict[str, Diagnosis]":
    """The diagnosis of each sensor of a recording that determines no model.

    Args:
        recording: what was recorded.
        error: why there is no model.
    """
    from imucal_wizard.diagnose.survey import insufficient
    from imucal_wizard.model.effect import SENSORS

    there = [name for name in SENSORS if getattr(recording.readings, name) is not None]
    return {name: insufficient(name, str(error)) for name in there}


def _by_sensor(given: Mapping[str, str] | None) -> Mapping[str, str]:
    """What is given for each sensor.

    Raises:
        UsageError: something is given for a sensor that does not exist.
    """
    from imucal_wizard.model.effect import SENSORS

    for name in given or {}:
        if name not in SENSORS:
            raise UsageError(f"there is no sensor {name!r}; choose one of {', '.join(SENSORS)}")
    return given or {}


def load(path: str | os.PathLike[str]) -> "Calibration":
    """Read a saved calibration.

    Args:
        path: written by ``save``, by this version or an older one.

    Raises:
        RecordingError: the file is missing, damaged, or no calibration.
    """
    from imucal_wizard.report.calibration_file import read_calibration

    return read_calibration(Path(path))


def export(
    calibration: "Calibration",
    target: str,
    path: str | os.PathLike[str],
    settings: "ExportSettings | None" = None,
) -> "Exported":
    """Write a calibration for another program, and check the file by reading it back.

    Args:
        calibration: to be written.
        target: name of the consumer, as ``imucal-wizard export --list`` prints it.
        path: file to write.
        settings: what the target needs beyond the calibration, like the present parameters of a
            flight controller.

    Raises:
        DataError: the data do not determine the smaller model that the target holds.
        UsageError: there is no such target, it cannot hold this calibration, or the file is there
            already and is none of this target.
    """
    from imucal_wizard.report.exports import write_export

    return write_export(calibration, target, Path(path), settings)


class _CallablePackage(ModuleType):
    """The package ``imucal_wizard.diagnose``, which can be called as the function of that name.

    Importing a package binds its name in its parent, so that ``imucal_wizard.diagnose`` is the
    package from then on.
    """

    __call__: Callable[..., Any] = staticmethod(diagnose)


_diagnose_package.__class__ = _CallablePackage
