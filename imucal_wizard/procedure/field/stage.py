"""The magnetometer's step at work: circles with each face on the table, or free tumbling."""

from imucal_wizard.procedure.blocks import ALMOST
from imucal_wizard.procedure.field import advice, trouble, words
from imucal_wizard.procedure.field.disturbance import Disturbance
from imucal_wizard.procedure.field.gathering import Gathering
from imucal_wizard.procedure.field.patience import SECONDS, Patience
from imucal_wizard.procedure.field.view import view
from imucal_wizard.procedure.field_status import GOOD
from imucal_wizard.procedure.ledger import KeptCircle, KeptHold
from imucal_wizard.procedure.moments import Moment
from imucal_wizard.procedure.poses import FACES
from imucal_wizard.procedure.scene import Scene
from imucal_wizard.procedure.state import EventKind, Offer, Status
from imucal_wizard.procedure.wording import label

UPDATE = 0.2
"""Seconds between two looks at everything."""
FULL_DEG = 350.0
"""From here on a circle is a whole one."""
CARRIED = 0.02
"""Doubt anywhere on the sphere, as a share of the field, with which a calibration is carried."""
SLIGHT_DEG = 30.0
"""Nobody means so little of a circle when taking something back ..."""
SLIGHT_SECONDS = 2.0
"""... or so little of a tumble."""
PIECE_DEG = 30.0
"""So much of a circle is something new."""
FEWEST = 60
"""Samples with which a fit is tried at all."""


class FieldStage:
    """Takes circles until coverage and fit suffice.

    Args:
        scene: the present moment.

    Attributes:
        gathered: the samples and what they say.
        wanted: the face to be laid on the table, or None.
        advice: which motion fills the largest gap.
        trouble: why no calibration can come of it so far, or "".
        turned: how much of the circle under way has been turned, degrees.
    """

    seconds = 0.0

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self.gathered = Gathering(scene)
        self._accepted = self._reopened = False
        self._begin()

    def _begin(self) -> None:
        self.wanted: str | None = None
        self.advice = self.trouble = self._fault = ""
        self.turned = self._unseen = 0.0
        self._patience = Patience()
        self._disturbance = Disturbance(self._scene)

    @property
    def disturbed(self) -> str:
        """What disturbs the field at this moment, or ""."""
        return self._disturbance.now

    @property
    def done(self) -> tuple[str, ...]:
        """Faces with a whole circle."""
        whole = {circle.face for circle in self._scene.ledger.circles if circle.complete}
        return tuple(face for face in FACES if face in whole)

    @property
    def missing(self) -> tuple[str, ...]:
        """Faces without."""
        done = self.done
        return tuple(face for face in FACES if face not in done)

    @property
    def good(self) -> bool:
        """Coverage and fit suffice."""
        survey = self.gathered.survey
        if self.trouble or survey.quality is None or survey.worst > CARRIED:
            return False
        fits = survey.quality.fit_error < GOOD["fit_error"]
        return fits and (not self.missing or survey.quality.gaps < GOOD["gaps"])

    @property
    def finished(self) -> bool:
        """The same, or the operator has said so."""
        return self._accepted or self.good

    @property
    def tally(self) -> tuple[float, float]:
        """Whole circles, and six."""
        return float(len(self.done)), float(len(FACES))

    def hardly_begun(self, circle: KeptCircle) -> bool:
        """Whether there is too little in a circle for undo to be about it."""
        survey = self.gathered.survey
        if circle.complete:
            return False
        if circle.face:
            return survey.turned(circle.number) < SLIGHT_DEG
        return survey.seconds(circle.number) < SLIGHT_SECONDS

    def enter(self) -> None:
        """Go on with what has not been taken back; who comes back may want more than that."""
        if not self._scene.ledger.circles:
            self.gathered.clear()
        self._reopened = (self._reopened or self._accepted) and bool(self._scene.ledger.circles)
        self._accepted = False
        self._begin()
        self._look()

    def completed(self, kept: KeptHold) -> None:
        """No hold is asked for."""

    def accept(self) -> None:
        """What there is has to do."""
        self._look()
        self._accepted = True

    def end(self) -> None:
        """No more samples: those there are have to do, if they are enough to try."""
        self._look()
        self._accepted |= self.gathered.survey.kept >= FEWEST

    def follow(self, moment: Moment) -> None:
        """Take the next moment; look at everything five times a second."""
        self.gathered.follow(moment)
        self._unseen += moment.seconds
        if self._unseen >= UPDATE - ALMOST:
            seconds, self._unseen = self._unseen, 0.0
            self._look()
            self._complete()
            if self.gathered.silent >= trouble.SILENT:
                self._disturbance.forget()
            else:
                self._disturbance.follow(self.gathered.survey, self.gathered.unit, seconds)
            self._be_patient(seconds)

    def _look(self) -> None:
        gathered = self.gathered
        gathered.look()
        self.turned = gathered.turned
        circles = len(self.done)
        flat = circles > 1 or (circles > 0 and self._patience.waiting >= trouble.LASTING)
        self._fault = trouble.fault(gathered.survey, gathered.unit, flat=flat)
        self.trouble = (
            trouble.silence(gathered.silent)
            or trouble.constant(gathered.constant)
            or trouble.lasting(self._disturbance.lasting)
            or self._fault
            or ("" if self._elsewhere else trouble.rest(gathered.still))
        )
        self._choose()

    @property
    def _elsewhere(self) -> bool:
        """Another face than the one asked for is down: it need not turn there."""
        return self.wanted is not None and self.wanted != self.gathered.faces.face

    def _choose(self) -> None:
        """The face to go to, or any motion once there is none; the asked-for stays until taken."""
        survey, missing, faces = self.gathered.survey, self.missing, self.gathered.faces
        if faces.steady in missing:
            self.wanted = faces.steady
        elif self.wanted not in missing:
            self.wanted = advice.next_face(survey, missing, self._scene.up)
        motion = self.wanted if missing else advice.next_motion(survey)
        self.advice = advice.sentence(motion) if motion else ""

    def _complete(self) -> None:
        """A circle that has become a whole one, or one that was done before."""
        circle = self.gathered.circle
        if circle is None or not circle.face:
            return
        if not circle.complete and self.turned >= FULL_DEG:
            again = circle.face in self.done
            circle.complete = True
            self._choose()
            self._say_complete(circle, again=again)

    def _say_complete(self, circle: KeptCircle, *, again: bool) -> None:
        following = f" Next: {label(self.wanted)} down." if self.wanted else ""
        if again:
            kind, text = EventKind.ALREADY_DONE, "was done already; kept as a repeat."
        else:
            kind, text = EventKind.ROTATION_TAKEN, f"down: once round, {len(self.done)} of 6."
        self._scene.emit(kind, f"{label(circle.face)} {text}{following}")

    def _be_patient(self, seconds: float) -> None:
        """Offer the way on when nothing new has come for a while."""
        progress = (
            self.gathered.survey.covered + (self.turned + 360.0 * len(self.done)) // PIECE_DEG
        )
        if self._patience.wait(seconds, progress):
            why = words.sentence(self.trouble or self.disturbed or self.advice)
            self._scene.emit(EventKind.STUCK, f"Nothing new for {SECONDS:.0f} s. {why}".rstrip())

    def offers(self) -> tuple[Offer, ...]:
        """The way on, once nothing more comes."""
        if self.finished or not (self._patience.over or self._reopened):
            return ()
        survey = self.gathered.survey
        if survey.kept < FEWEST:
            return (Offer("skip", "g", "leave it out: the magnetometer is not calibrated"),)
        if self._fault or survey.quality is None:
            return (Offer("enough", "g", "go on: the magnetometer will hardly be calibrated"),)
        return (Offer("enough", "g", "go on with what there is: it may carry less"),)

    def view(self) -> Status:
        """What to do, what is covered, and how good it is."""
        return view(self, self._scene.up)
