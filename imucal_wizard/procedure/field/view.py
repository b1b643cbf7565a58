"""What the magnetometer's step shows."""

from typing import Protocol

from imucal_wizard.procedure.field import advice, words
from imucal_wizard.procedure.field.gathering import Gathering
from imucal_wizard.procedure.field_status import FieldStatus
from imucal_wizard.procedure.poses import DIRECTIONS, turn_towards
from imucal_wizard.procedure.state import Status
from imucal_wizard.procedure.wording import how_to_turn
from imucal_wizard.readings import FloatArray
from imucal_wizard.units import COUNT


class FieldStageLike(Protocol):
    """What is shown of the stage."""

    gathered: Gathering
    wanted: str | None
    advice: str
    trouble: str
    turned: float

    @property
    def disturbed(self) -> str:
        """What disturbs the field at this moment, or ""."""

    @property
    def done(self) -> tuple[str, ...]:
        """Faces with a whole circle."""

    @property
    def missing(self) -> tuple[str, ...]:
        """Faces without."""

    @property
    def good(self) -> bool:
        """Coverage and fit suffice."""

    @property
    def tally(self) -> tuple[float, float]:
        """Whole circles, and six."""


def view(stage: FieldStageLike, up: FloatArray | None) -> Status:
    """What to do now, and how near it is."""
    face, down = stage.wanted, stage.gathered.faces.face
    wanted = None if face is None or face == down else advice.opposite(face)
    off_by = None
    if up is not None and wanted is not None:
        off_by = turn_towards(up, DIRECTIONS[wanted])[2]
    return Status(
        instruction=_instruction(face, down),
        detail=_detail(face),
        guidance=how_to_turn(up, wanted) if up is not None and wanted is not None else "",
        wanted=wanted,
        off_by=off_by,
        progress=stage.tally,
        field=field_status(stage),
    )


def _instruction(face: str | None, down: str | None) -> str:
    if face is None:
        return words.TURN_ABOUT
    return words.TURN_ROUND if face == down else words.lay_down(face)


def _detail(face: str | None) -> str:
    if face is None:
        return "through directions that it has not seen, away from iron and magnets"
    return "away from iron, magnets and loudspeakers; any face, or tumble it freely"


def field_status(stage: FieldStageLike) -> FieldStatus:
    """The frozen picture of the step."""
    gathered, survey = stage.gathered, stage.gathered.survey
    found, fit = survey.quality, survey.fit
    known = fit is not None and found is not None and gathered.unit != COUNT
    here = gathered.circle is not None and gathered.circle.face == gathered.faces.face
    return FieldStatus(
        face=stage.wanted,
        face_down=gathered.faces.face,
        turned=stage.turned if here else 0.0,
        done=stage.done,
        missing=stage.missing,
        counts=survey.counts,
        here=survey.here,
        gaps=None if found is None else found.gaps,
        variance=None if found is None else found.variance,
        wobble=None if found is None else found.wobble,
        fit_error=None if found is None else found.fit_error,
        magnitude=fit.magnitude if known and fit is not None else None,
        advice=stage.advice,
        disturbed=stage.disturbed,
        trouble=stage.trouble,
        samples=survey.kept,
        left_out=survey.left_out,
        good=stage.good,
    )
