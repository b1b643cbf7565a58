"""What the files of a command give to be fitted: a recording's samples, or what a session kept."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from imucal_wizard.commands.arguments import write_json
from imucal_wizard.errors import DataError
from imucal_wizard.fitting import FitOptions, fit_readings
from imucal_wizard.fitting.magnetometer import samples_during
from imucal_wizard.output import note
from imucal_wizard.readings import Readings, Series
from imucal_wizard.recordings import read
from imucal_wizard.recordings.options import RecordingOptions
from imucal_wizard.recordings.session import is_session, taken_back
from imucal_wizard.sessions.readings_again import belongs
from imucal_wizard.solver.result import FitReport
from imucal_wizard.units import STANDARD_GRAVITY

if TYPE_CHECKING:  # all that reads a live stream, which a recording does not need
    from imucal_wizard.live.review import Reviewed


class Material:
    """The files that a command was given.

    A session goes by the commands in it: what the operator took back or repeated counts no more,
    and what was held to validate is not fitted. Of a session that did not come so far as to carry a
    calibration, or where the user wants it so, all samples count as those of any recording.

    Args:
        paths: recordings, or one session.
        options: what the files do not say.
        all_samples: a session is nothing but a recording.

    Raises:
        InputError: a file cannot be read.
    """

    def __init__(
        self,
        paths: Sequence[Path],
        options: RecordingOptions,
        *,
        all_samples: bool = False,
    ) -> None:
        self._paths = tuple(paths)
        self._options = options
        alone = len(self._paths) == 1 and not options.as_format and is_session(self._paths[0])
        self._session: Reviewed | None = None
        self._notes: tuple[str, ...] = ()
        if alone and not all_samples:
            from imucal_wizard.live.review import review

            self._session = review(self._paths[0], options)
        else:
            self._notes = tuple(text for path in self._paths for text in taken_back(path))

    @cached_property
    def readings(self) -> Readings:
        """All samples.

        Raises:
            RecordingError: the files cannot be read.
        """
        readings = read(self._paths, self._options, field_alone=True)
        return replace(readings, warnings=(*self._notes, *readings.warnings))

    @property
    def warnings(self) -> tuple[str, ...]:
        """What was noticed before anything is fitted."""
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
        """The magnetometer's samples that its fit is made of; None without any."""
        if self._session is None:
            return self.readings.magnetometer
        kept = self._session.collected
        if kept.magnetometer is None or not kept.field_spans:
            return None
        return samples_during(kept.field_spans, kept.magnetometer)

    def gravity(self, given: float | None) -> float:
        """What the user says, or what the session was carried out with."""
        if given is not None:
            return given
        return STANDARD_GRAVITY if self._session is None else self._session.gravity

    def fit(self, options: FitOptions, *, inertial: bool = False) -> FitReport:
        """The fit.

        Args:
            options: gravity and methods.
            inertial: as if there were no magnetometer.

        Raises:
            DataError: the data do not carry a calibration.
        """
        session = self._session
        if session is None:
            readings = self.readings
            return fit_readings(
                replace(readings, magnetometer=None) if inertial else readings, options
            )
        from imucal_wizard.live.review import fit_stream

        kept = session.collected
        try:
            report = fit_stream(
                replace(kept, magnetometer=None) if inertial else kept, session.stream, options
            )
        except DataError as error:
            self._session = None
            self._notes = (*_fallen_back(error), *taken_back(self._paths[0]))
            return self.fit(options, inertial=inertial)
        return replace(report, warnings=(*_unfinished(session), *report.warnings))

    def behind(self, report: FitReport) -> Readings | None:
        """The samples that a fit was made of; None where a session gives others when read again."""
        if self._session is None or belongs(self.readings, report.holds):
            return self.readings
        return None


def fitted(
    material: Material,
    options: FitOptions,
    place: str | None,
    failure: Callable[[str, Sequence[str]], object],
) -> FitReport:
    """The fit of a command; where the data do not carry it, the reason is written first.

    Args:
        material: what is fitted.
        options: gravity and methods.
        place: where JSON was asked for, or None.
        failure: makes the document of a reason and of what was noticed before.

    Raises:
        DataError: the data do not carry a calibration.
    """
    try:
        return material.fit(options)
    except DataError as error:
        if place:
            write_json(failure(str(error), material.warnings), place)
        for warning in material.warnings:
            note(f"warning: {warning}")
        raise


def _fallen_back(error: DataError) -> tuple[str, ...]:
    says = (
        f"what the wizard kept does not carry a calibration ({error}): all samples of the session "
        "count instead, as those of a recording"
    )
    return (says,)


def _unfinished(session: "Reviewed") -> tuple[str, ...]:
    if session.finished:
        return ()
    says = (
        f"the session was left in the step {session.step}: what it had kept until then counts; "
        "--all-samples takes everything that was received"
    )
    return (says,)
