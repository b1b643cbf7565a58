"""The bench without a screen: add what is asked for, or what the evidence carries; say the rest."""

from collections.abc import Mapping, Sequence

from imucal_wizard.bench.automatic import add_by_itself
from imucal_wizard.bench.benches import Benches
from imucal_wizard.bench.session import Bench
from imucal_wizard.bench.statement import Statement, nothing_carried, statement
from imucal_wizard.effects.effect import ACCELEROMETER, GYROSCOPE, MAGNETOMETER
from imucal_wizard.errors import DataError, UsageError

NOTHING_USED = {
    ACCELEROMETER: "the accelerometer is not calibrated",
    GYROSCOPE: "no rotation between two holds could be used",
    MAGNETOMETER: "its readings are not at hand",
}


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
    found = []
    for sensor in (ACCELEROMETER, GYROSCOPE, MAGNETOMETER):
        if sensor == ACCELEROMETER or sensor in benches.report.rates:
            found.append(_of(benches, sensor, added.get(sensor, ()), automatic))
        elif added.get(sensor):
            raise UsageError(f"there is no {sensor} in this recording to add a term to")
    return tuple(found)


def _of(benches: Benches, sensor: str, added: Sequence[str], automatic: bool) -> Statement:
    """What is said of one sensor; where it has no bench, why."""
    try:
        bench = benches.bench(sensor)
    except DataError as error:
        return nothing_carried(sensor, str(error))
    if bench is None:
        return nothing_carried(sensor, _why(benches, sensor))
    wanted = automatic and (sensor != GYROSCOPE or benches.passed)
    return _surveyed(benches, bench, added, wanted)


def _surveyed(benches: Benches, bench: Bench, added: Sequence[str], automatic: bool) -> Statement:
    for name in added:
        bench.add(name)
    findings = add_by_itself(bench) if automatic else bench.look()
    return statement(benches, bench, findings)


def _why(benches: Benches, sensor: str) -> str:
    """Why there is no fit of a sensor, as the fit itself says."""
    notes = [note for note in benches.report.warnings if f"{sensor} is not calibrated" in note]
    return notes[0] if notes else NOTHING_USED[sensor]
