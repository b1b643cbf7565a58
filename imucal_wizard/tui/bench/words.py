"""What is to be said of a model, and how the poses and effects in it are called."""

from imucal_wizard.bench.verdict import Verdict
from imucal_wizard.procedure.poses import DIRECTIONS, POSE_TOLERANCE_DEG, nearest
from imucal_wizard.solver.extended.turn_data import TurnData
from imucal_wizard.tui.bench.sight import Sight
from imucal_wizard.tui.text import signed


def says(sight: Sight) -> tuple[str, str]:
    """A style (``good``, ``warn``, ``accent``) and the sentences.

    While a part of the base is left out, that is all there is to say: the suspects then compete for
    what the base should explain.
    """
    gone = sight.missing_base
    if gone:
        names = " and ".join([", ".join(gone[:-1]), gone[-1]] if gone[1:] else gone)
        verb = "is" if len(gone) == 1 else "are"
        return "warn", (
            f"{names[0].upper()}{names[1:]} of the base model {verb} left out, and every sensor "
            "needs it: what is left comes from that first. Put it back (enter) before you believe "
            "another name."
        )
    verdict = sight.said.verdict
    settled = verdict is Verdict.COMPLETE and not sight.said.waiting
    style = "good" if settled else "warn"
    return "accent" if verdict is Verdict.MISSING else style, sight.told


def pose_at(sight: Sight, hold: int) -> str:
    """The pose of a hold by its direction, or that it is none."""
    measured = sight.measured
    row = int(measured.still_rows.searchsorted(hold)) if isinstance(measured, TurnData) else hold
    name = nearest(measured.circumstances.force[row], DIRECTIONS, POSE_TOLERANCE_DEG)
    return signed(name) + " up" if name else "between poses"
