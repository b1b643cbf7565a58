"""What a bench's data lack for the base model that was asked for."""

from imucal_wizard.bench.session import Bench
from imucal_wizard.effects.effect import GYROSCOPE
from imucal_wizard.solver.extended.field_data import FieldData
from imucal_wizard.solver.extended.hold_data import HoldData
from imucal_wizard.solver.magnitude import SCALE


def lacking_base(bench: Bench) -> str:
    """Why the data do not carry the base model that was asked for; "" when they do."""
    measured, base = bench.measured, bench.fit.base
    if isinstance(measured, FieldData):
        if "soft-iron" in base and "soft-iron" not in measured.carried:
            return "too few directions of the field for the soft iron: turn it on all six faces"
    elif isinstance(measured, HoldData):
        carried = measured.task.carried
        common = "scale" in base and not set(SCALE) <= set(carried.places)
        if common or ("non-orthogonality" in base and carried.dropped):
            return carried.reason
    else:
        dropped = [p.name for p in bench.fit.fit.parameters if not p.carried]
        if base == bench.whole and dropped:
            return f"the rotations do not carry {', '.join(dropped)}: turn it about every axis"
    if bench.fit.rms_held_out is None:
        what = "rotation" if bench.sensor == GYROSCOPE else "direction"
        return f"some {what} decides a parameter alone, so that it cannot be left out as a check"
    return ""
