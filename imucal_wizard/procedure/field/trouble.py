"""Why no calibration can come of what the magnetometer says so far, in words; or nothing."""

from imucal_wizard.ellipsoid.checks import check_field, check_readings, check_scatter, no_shell
from imucal_wizard.ellipsoid.saturation import check_saturation, stuck_samples
from imucal_wizard.errors import DataError
from imucal_wizard.procedure.field.survey import TOLD, Survey

KNOWN = 0.05
"""Doubt, as a share of the field, below which its size and shape are judged."""
SILENT = 2.0
"""Seconds without a sample, after which the sensor is missed."""
RESTING = 8.0
"""Seconds of rest after which the hand is reminded to turn."""
LASTING = 10.0
"""Seconds of disturbance after which it will not pass by itself."""


def silence(seconds: float) -> str:
    """About a sensor that has said nothing for so long."""
    if seconds < SILENT:
        return ""
    return f"the magnetometer has sent nothing for {seconds:.0f} s: look at its wiring"


def constant(seconds: float) -> str:
    """About a sensor that has sent one value for so long while it was turned."""
    if seconds < SILENT:
        return ""
    return (
        "the magnetometer sends one and the same value: it is not there, or asleep. Look at its "
        "wiring, address and sketch"
    )


def rest(seconds: float) -> str:
    """About a device that lies still."""
    return "it does not turn: turn it once round" if seconds >= RESTING else ""


def lasting(seconds: float) -> str:
    """About a disturbance that stays."""
    if seconds < LASTING:
        return ""
    return (
        "the field has changed and stays so: take away what came near, or begin the step again "
        "in another place"
    )


def fault(survey: Survey, unit: str, *, flat: bool) -> str:
    """What a calibration would be refused for.

    Args:
        survey: the samples.
        unit: theirs.
        flat: whether more than one circle has been turned, so that a plane is too little.
    """
    try:
        _check(survey, unit, flat=flat)
    except DataError as error:
        return str(error)
    return ""


def _check(survey: Survey, unit: str, *, flat: bool) -> None:
    """The same as an error.

    Raises:
        DataError: something is wrong.
    """
    readings, fit = survey.samples, survey.fit
    if flat:
        check_readings(readings)
        if fit is None:
            raise no_shell(readings) or DataError("the magnetometer's readings are of no field")
    if fit is None or survey.worst > TOLD:
        return
    distance = fit.look(readings)[0]
    stuck = stuck_samples(readings)
    if stuck:
        check_saturation(stuck, distance)
    if survey.worst <= KNOWN:
        check_scatter(float(distance[survey.clean].std()), 1.0, readings)
        check_field(fit.magnitude, unit, None)
