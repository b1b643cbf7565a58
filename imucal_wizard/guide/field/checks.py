"""Checks of the magnetometer's step: disturbances, faults, silence."""

from imucal_wizard.core.errors import DataError
from imucal_wizard.core.limits.procedure import (
    DISTURBANCE_QUIET_SECONDS,
    LASTING_SECONDS,
    MAX_JUDGED_DOUBT,
    MAX_SHOWN_DOUBT,
    RESTING_SECONDS,
    SILENT_SECONDS,
)
from imucal_wizard.core.limits.stillness import TIME_TOLERANCE
from imucal_wizard.core.notices import Notice, NoticeKind
from imucal_wizard.core.units import COUNT
from imucal_wizard.guide.context import Context
from imucal_wizard.guide.field.survey import Survey
from imucal_wizard.guide.kinds import EventKind
from imucal_wizard.measurement.field_quality import (
    CONSTANT_FIELD,
    check_field,
    check_readings,
    check_saturation,
    check_scatter,
    missing_shell,
    stuck_samples,
)
from imucal_wizard.measurement.rounding import resolution_of


def _notice(text: str, kind: NoticeKind) -> Notice:
    return Notice(text, kind, "magnetometer")


def how_far(off: float, magnitude: float | None, unit: str) -> str:
    """The deviation of the field: "12 µT too much", "8 % too little"."""
    sense = "much" if off > 0.0 else "little"
    if magnitude is None or unit == COUNT:
        return f"{100.0 * abs(off):.0f} % too {sense}"
    return f"{abs(off) * magnitude:.0f} µT too {sense}"


def disturbance_text(off: float, magnitude: float | None, unit: str) -> str:
    """Message while the field is disturbed."""
    far = how_far(off, magnitude, unit)
    return _notice(
        f"the field is disturbed: {far}; these samples are left out", NoticeKind.DISTURBED
    )


def left_out_spans(survey: Survey, unit: str) -> tuple[tuple[float, float, str], ...]:
    """The disturbed spans: start and end, s, and the deviation of the field."""
    magnitude = None if survey.fit is None else survey.fit.magnitude
    return tuple(
        (start, end, f"the field was {how_far(off, magnitude, unit)}")
        for start, end, off in survey.left()
    )


def silence(seconds: float) -> str:
    """Message about a sensor that has sent nothing for some seconds, or ""."""
    if seconds < SILENT_SECONDS:
        return ""
    text = f"the magnetometer has sent nothing for {seconds:.0f} s: check its wiring"
    return _notice(text, NoticeKind.SILENT)


def constant(seconds: float) -> str:
    """Message about a sensor whose value stayed the same during rotation, or ""."""
    return _notice(CONSTANT_FIELD, NoticeKind.DEAD) if seconds >= SILENT_SECONDS else ""


def resting(seconds: float) -> str:
    """Message about a device that lies still, or ""."""
    if seconds < RESTING_SECONDS:
        return ""
    return _notice("the device does not turn: turn it once round", NoticeKind.NOT_TURNED)


def lasting(seconds: float) -> str:
    """Message about a disturbance that does not end, or ""."""
    if seconds < LASTING_SECONDS:
        return ""
    return _notice(
        "the field has changed permanently: remove the iron or magnet that came near, or repeat "
        "the step in another place",
        NoticeKind.CHANGED,
    )


def fault(survey: Survey, unit: str, *, flat: bool) -> str:
    """The reason for which the fit would reject these samples, or "".

    Args:
        survey: the samples.
        unit: of the samples.
        flat: whether samples in one plane are a fault, because there is more than one circle.
    """
    try:
        _check(survey, unit, flat=flat)
    except DataError as error:
        return _notice(str(error), NoticeKind.NOT_CALIBRATED)
    return ""


def _check(survey: Survey, unit: str, *, flat: bool) -> None:
    """The same check as an error.

    Raises:
        DataError: the reason.
    """
    readings, fit = survey.samples, survey.fit
    if flat:
        check_readings(readings)
        if fit is None:
            raise missing_shell(readings) or DataError(
                "the magnetometer's readings are not those of a constant field"
            )
    if fit is None or survey.worst > MAX_SHOWN_DOUBT:
        return
    stuck = stuck_samples(readings)
    if stuck:
        check_saturation(stuck, survey.distance, resolution_of(readings) / fit.magnitude)
    if survey.worst <= MAX_JUDGED_DOUBT:
        check_scatter(float(survey.distance[survey.clean].std()), 1.0, readings)
        check_field(fit.magnitude, unit, None)


class Disturbance:
    """Follows a disturbance from its start to its end.

    Args:
        context: takes the events.

    Attributes:
        now: message about the present disturbance, or "".
        lasting: duration of the present disturbance, s.
    """

    def __init__(self, context: Context) -> None:
        self._context = context
        self.forget()

    def forget(self) -> None:
        """Forget the disturbance."""
        self.now = ""
        self.lasting = self._quiet = 0.0

    def follow(self, survey: Survey, unit: str, seconds: float) -> None:
        """Take the evaluation of the newest block.

        Args:
            survey: the samples.
            unit: of the samples.
            seconds: since the last call.
        """
        if not len(survey.disturbed) or not survey.disturbed[-1]:
            self._calm_down(seconds)
            return
        if not self.now:
            text = "The field is disturbed: new samples are left out."
            self._context.emit(EventKind.WARNING, _notice(text, NoticeKind.DISTURBED))
        magnitude = None if survey.fit is None else survey.fit.magnitude
        self.now = disturbance_text(float(survey.off[-1]), magnitude, unit)
        self.lasting += seconds
        self._quiet = 0.0

    def _calm_down(self, seconds: float) -> None:
        self._quiet += seconds
        if self.now and self._quiet >= DISTURBANCE_QUIET_SECONDS - TIME_TOLERANCE:
            self.forget()
            self._context.emit(
                EventKind.FIELD_BACK, "The disturbance is over: new samples count again."
            )
