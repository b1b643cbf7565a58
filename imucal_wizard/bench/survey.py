"""The bench without a screen: add what is asked for, or what the evidence carries; say the rest."""

from collections.abc import Mapping, Sequence

from imucal_wizard.bench.automatic import add_by_itself
from imucal_wizard.bench.benches import Benches
from imucal_wizard.bench.session import Bench
from imucal_wizard.bench.statement import Statement, nothing_carried, statement
from imucal_wizard.effects.effect import ACCELEROMETER, GYROSCOPE
from imucal_wizard.errors import DataError, UsageError

NO_GYROSCOPE = "no rotation between two holds could be used"


def survey(
    benches: Benches, added: Mapping[str, Sequence[str]], automatic: bool
) -> tuple[Statement, ...]:
    """What is said of every sensor, the accelerometer first.

    Args:
        benches: the session's.
        added: terms to add first, by sensor.
        automatic: then add what the evidence carries and data held out confirm. The gyroscope is
            given nothing while the accelerometer has not passed.

    Raises:
        UsageError: a term that the sensor does not have.
        DataError: the data cannot show a term that was asked for.
    """
    first = _surveyed(benches, benches.accelerometer, added.get(ACCELEROMETER, ()), automatic)
    if GYROSCOPE not in benches.report.rates:
        if added.get(GYROSCOPE):
            raise UsageError("there is no gyroscope in this recording to add a term to")
        return (first,)
    try:
        bench = benches.gyroscope
    except DataError as error:
        return (first, nothing_carried(GYROSCOPE, str(error)))
    if bench is None:
        return (first, nothing_carried(GYROSCOPE, _why(benches)))
    wanted = automatic and benches.passed
    return (first, _surveyed(benches, bench, added.get(GYROSCOPE, ()), wanted))


def _surveyed(benches: Benches, bench: Bench, added: Sequence[str], automatic: bool) -> Statement:
    for name in added:
        bench.add(name)
    findings = add_by_itself(bench) if automatic else bench.look()
    return statement(benches, bench, findings)


def _why(benches: Benches) -> str:
    """Why there is no fit of the gyroscope, as the fit itself says."""
    notes = [note for note in benches.report.warnings if "gyroscope is not calibrated" in note]
    return notes[0] if notes else NO_GYROSCOPE
