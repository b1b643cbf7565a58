"""The magnetometer's step: circles with each face on the table, or free tumbling."""

import math
from dataclasses import replace

from imucal_wizard.core.limits.data_quality import MIN_FIELD_SAMPLES
from imucal_wizard.core.limits.procedure import (
    FIELD_PATIENCE,
    FIELD_UPDATE_SECONDS,
    FULL_CIRCLE_DEG,
    LASTING_SECONDS,
    MAX_ACCEPTED_DOUBT,
    PROGRESS_DEG,
    SILENT_SECONDS,
    SLIGHT_DEG,
    SLIGHT_SECONDS,
)
from imucal_wizard.core.limits.stillness import TIME_TOLERANCE
from imucal_wizard.core.notices import reworded
from imucal_wizard.core.poses import DIRECTIONS, FACES, angle_between
from imucal_wizard.core.quantities import as_sentence
from imucal_wizard.core.units import COUNT
from imucal_wizard.guide.context import Context
from imucal_wizard.guide.field import checks, coverage
from imucal_wizard.guide.field.checks import Disturbance
from imucal_wizard.guide.field.gathering import Gathering
from imucal_wizard.guide.kinds import Act, EventKind
from imucal_wizard.guide.measurements import KeptCircle, KeptHold
from imucal_wizard.guide.state import GOOD, FieldStatus, Offer, Status
from imucal_wizard.guide.wording import (
    ALL_TAKEN,
    DISTURBED,
    NO_FIELD,
    TUMBLE,
    TURN_ROUND,
    label,
    lay_down,
)
from imucal_wizard.measurement.stillness import Block


class Patience:
    """Waits for progress, in sample time.

    Attributes:
        waiting: seconds since the last progress.
    """

    def __init__(self) -> None:
        self.waiting = 0.0
        self._most = 0.0

    @property
    def over(self) -> bool:
        """Whether the waiting has lasted long enough."""
        return self.waiting >= FIELD_PATIENCE - TIME_TOLERANCE

    def wait(self, seconds: float, progress: float) -> bool:
        """Count time; returns whether the patience has just run out.

        Args:
            seconds: time since the last call.
            progress: present progress, in any unit.
        """
        was_over = self.over
        if progress > self._most:
            self._most, self.waiting = progress, 0.0
        else:
            self.waiting += seconds
        return self.over and not was_over


class FieldStage:
    """Takes circles until coverage and fit error are good.

    Args:
        context: shared by all steps.

    Attributes:
        gathered: the samples and their evaluation.
        wanted: the face to lay on the table, or None.
        advice: the motion that fills the largest gap.
        trouble: why these samples give no calibration, or "".
        turned: angle turned in the present circle, degrees.
    """

    seconds = 0.0

    def __init__(self, context: Context) -> None:
        self._context = context
        self.gathered = Gathering(context)
        self._accepted = self._reopened = False
        self._begin()

    def _begin(self) -> None:
        self.wanted: str | None = None
        self.advice = self.trouble = self._mute = self._fault = ""
        self.turned = self._unseen = 0.0
        self._patience = Patience()
        self._disturbance = Disturbance(self._context)

    @property
    def done(self) -> tuple[str, ...]:
        """Faces with a complete circle."""
        whole = {circle.face for circle in self._context.measurements.circles if circle.complete}
        return tuple(face for face in FACES if face in whole)

    @property
    def missing(self) -> tuple[str, ...]:
        """Faces without a complete circle."""
        done = self.done
        return tuple(face for face in FACES if face not in done)

    @property
    def good(self) -> bool:
        """Whether coverage and fit error are good."""
        survey = self.gathered.survey
        if self.trouble or survey.quality is None or survey.worst > MAX_ACCEPTED_DOUBT:
            return False
        fits = survey.quality.fit_error < GOOD["fit_error"]
        return fits and (not self.missing or survey.quality.gaps < GOOD["gaps"])

    @property
    def finished(self) -> bool:
        """Whether coverage and fit error are good, or the operator has accepted them."""
        return self._accepted or self.good

    @property
    def tally(self) -> tuple[float, float]:
        """Complete circles, and six."""
        return float(len(self.done)), float(len(FACES))

    def hardly_begun(self, circle: KeptCircle) -> bool:
        """Whether a circle is too short to be what undo means."""
        survey = self.gathered.survey
        if circle.complete:
            return False
        if circle.face:
            return survey.turned(circle.number) < SLIGHT_DEG
        return survey.seconds(circle.number) < SLIGHT_SECONDS

    @property
    def holds_here(self) -> bool:
        """Never: the step needs no hold."""
        return False

    def enter(self) -> None:
        """Continue with the circles that were not taken back; reopen an accepted step."""
        if not self._context.measurements.circles:
            self.gathered.clear()
        self._reopened = (self._reopened or self._accepted) and bool(
            self._context.measurements.circles
        )
        self._accepted = False
        self._begin()
        self._look()

    def completed(self, kept: KeptHold) -> None:
        """This step needs no hold."""

    def accept(self) -> None:
        """Accept the present coverage."""
        self._look()
        self._accepted = True

    def end(self) -> None:
        """The data have ended: accept the samples if a fit can be tried with them."""
        self._look()
        self._accepted |= self.gathered.survey.kept >= MIN_FIELD_SAMPLES

    def follow(self, block: Block) -> None:
        """Take the next block; evaluate all samples five times a second."""
        self.gathered.follow(block)
        self._unseen += block.seconds
        if self._unseen >= FIELD_UPDATE_SECONDS - TIME_TOLERANCE:
            seconds, self._unseen = self._unseen, 0.0
            self._look()
            self._complete()
            if self.gathered.silent >= SILENT_SECONDS:
                self._disturbance.forget()
            else:
                self._disturbance.follow(self.gathered.survey, self.gathered.unit, seconds)
            self._be_patient(seconds)

    def _look(self) -> None:
        gathered = self.gathered
        gathered.look()
        self.turned = gathered.turned
        circles = len(self.done)
        flat = circles > 1 or (circles > 0 and self._patience.waiting >= LASTING_SECONDS)
        self._fault = checks.fault(gathered.survey, gathered.unit, flat=flat)
        self._mute = checks.silence(gathered.silent) or checks.constant(gathered.constant)
        self.trouble = (
            self._mute
            or checks.lasting(self._disturbance.lasting)
            or self._fault
            or ("" if self._elsewhere else checks.resting(gathered.still))
        )
        self._choose()

    @property
    def _elsewhere(self) -> bool:
        """Whether another face than the wanted one is down; the device need not turn there."""
        return self.wanted is not None and self.wanted != self.gathered.faces.face

    def _choose(self) -> None:
        """Choose the next face, or a motion if all faces are done; a chosen face stays."""
        survey, missing, faces = self.gathered.survey, self.missing, self.gathered.faces
        if faces.steady in missing:
            self.wanted = faces.steady
        elif self.wanted not in missing:
            self.wanted = coverage.next_face(survey, missing, self._context.up)
        motion = self.wanted if missing else coverage.next_motion(survey)
        self.advice = coverage.sentence(motion) if motion else ""

    def _complete(self) -> None:
        """Report a circle that has just become complete."""
        circle = self.gathered.circle
        if circle is None or not circle.face:
            return
        if not circle.complete and self.turned >= FULL_CIRCLE_DEG:
            again = circle.face in self.done
            circle.complete = True
            self._choose()
            self._say_complete(circle, again=again)

    def _say_complete(self, circle: KeptCircle, *, again: bool) -> None:
        if again:
            kind, text = EventKind.ALREADY_DONE, "was done already; kept as a repeat."
        else:
            kind, text = EventKind.ROTATION_TAKEN, f"down: once round, {len(self.done)} of 6."
        self._context.emit(kind, f"{label(circle.face)} {text}")

    def _be_patient(self, seconds: float) -> None:
        """Offer to go on when there has been no progress for a while."""
        progress = (
            self.gathered.survey.covered + (self.turned + 360.0 * len(self.done)) // PROGRESS_DEG
        )
        if self._patience.wait(seconds, progress):
            why = self.trouble or self._disturbance.now
            text = f"No progress for {FIELD_PATIENCE:.0f} s. {as_sentence(why)}".rstrip()
            self._context.emit(EventKind.STUCK, reworded(text, why))

    def offers(self) -> tuple[Offer, ...]:
        """The ways to go on, if there is no progress."""
        if self.finished or not (self._patience.over or self._reopened):
            return ()
        survey = self.gathered.survey
        if survey.kept < MIN_FIELD_SAMPLES:
            return (Offer("skip", "skip: the magnetometer is not calibrated"),)
        if self._fault or survey.quality is None:
            return (Offer("enough", "go on: the calibration will probably fail"),)
        return (Offer("enough", "go on with these samples: the result is less certain"),)

    def view(self) -> Status:
        """The instruction and the progress."""
        up, face, down = self._context.up, self.wanted, self.gathered.faces.face
        status = Status(progress=self.tally, field=self._field_status())
        if self.finished:
            return replace(status, act=Act.DONE, instruction=ALL_TAKEN)
        if self._mute:
            return replace(status, act=Act.CONNECT, instruction=NO_FIELD)
        if self._disturbance.now or self._disturbance.lasting >= LASTING_SECONDS:
            return replace(status, act=Act.WAIT, instruction=DISTURBED)
        if face is None:
            way = "" if self.trouble else self.advice
            detail = "into the gaps of the sphere, away from iron and magnets"
            return replace(status, act=Act.CIRCLE, instruction=TUMBLE, detail=detail, guidance=way)
        away = "away from iron, magnets and loudspeakers"
        if face == down:
            return replace(status, act=Act.CIRCLE, instruction=TURN_ROUND, detail=away)
        pose = coverage.opposite(face)
        x, y, z = DIRECTIONS[pose].tolist()
        return replace(
            status,
            act=Act.POSE,
            instruction=lay_down(face),
            detail=f"{away}; any face or free tumbling counts",
            wanted=pose,
            aim=(x, y, z),
            off_by=None if up is None else math.degrees(angle_between(up, DIRECTIONS[pose])),
        )

    def _field_status(self) -> FieldStatus:
        gathered, survey = self.gathered, self.gathered.survey
        found, fit = survey.quality, survey.fit
        known = fit is not None and found is not None and gathered.unit != COUNT
        here = gathered.circle is not None and gathered.circle.face == gathered.faces.face
        return FieldStatus(
            face=self.wanted,
            face_down=gathered.faces.face,
            turned=self.turned if here else 0.0,
            done=self.done,
            missing=self.missing,
            counts=survey.counts,
            here=survey.here,
            gaps=None if found is None else found.gaps,
            variance=None if found is None else found.variance,
            wobble=None if found is None else found.wobble,
            fit_error=None if found is None else found.fit_error,
            magnitude=fit.magnitude if known and fit is not None else None,
            advice=self.advice,
            disturbed=self._disturbance.now,
            trouble=self.trouble,
            samples=survey.kept,
            left_out=survey.left_out,
            good=self.good,
        )
