"""One state, one instruction: every kind of moment of the wizard."""

import re
from dataclasses import replace

from imucal_wizard.guide.instruction import Flow, present
from imucal_wizard.guide.kinds import Act, StepKind
from imucal_wizard.guide.state import Status
from tests.guide.moments import moments

HEADLINES = {
    Act.LAY_DOWN: r"PUT IT DOWN",
    Act.POSE: r"(TURN|TILT|LAY) .+",
    Act.HOLD: r"HOLD STILL|HANDS OFF",
    Act.LIFT: r"LIFT IT",
    Act.ROTATE: r"ROTATE ABOUT [XYZ]",
    Act.CIRCLE: r"TURN IT ROUND|TUMBLE IT",
    Act.DONE: r"ALL TAKEN",
    Act.WAIT: r"ONE MOMENT|DISTURBED|MEASURED|SAVE THE RESULT",
    Act.CONNECT: r"NOT CONNECTED|NO SAMPLES|NO FIELD",
    Act.ENDED: r"DATA ENDED",
}
WAYS = {
    Act.POSE: r"(\d+° away: |lift it, then )tip it (to|towards|away) .+",
    Act.HOLD: r"|there: hold it still",
    Act.LIFT: r"lift it and put it back the same way",
    Act.ROTATE: r"tip it (to|towards|away) .+, \d+°, (slow|medium|fast)",
}
"""What guidance may say; nothing for all other acts."""
COMMANDS = re.compile(
    r"\b(turn it|turn about|tip it|tilt it|rotate|lift it|hold it|put it|lay it|keep it|Next:)"
)
"""Words of an instruction; events and details tell what happened or is the case."""
INTERRUPTED = {
    Flow(connected=False): Act.CONNECT,
    Flow(stalled=True): Act.CONNECT,
    Flow(ended=True): Act.ENDED,
    Flow(connected=False, ended=True): Act.ENDED,
}


def agrees(name: str, status: Status) -> None:
    """All that is said is the one act."""
    assert re.fullmatch(HEADLINES[status.act], status.instruction), (name, status.instruction)
    assert re.fullmatch(WAYS.get(status.act, ""), status.guidance), (name, status.guidance)
    turning = status.act in (Act.POSE, Act.ROTATE)
    assert (status.turn is not None) == turning, name
    if turning and status.turn is not None:
        assert status.turn.words in status.guidance, name
    if status.last_event is not None and status.act is not Act.LAY_DOWN:
        assert COMMANDS.search(status.last_event.text) is None, (name, status.last_event.text)
    assert COMMANDS.search(status.reason) is None, (name, status.reason)
    if "take" in [offer.command for offer in status.offers]:
        assert status.act in (Act.HOLD, Act.LAY_DOWN), name


def test_a_moment_has_the_one_instruction_that_is_right_in_it() -> None:
    for name, (act, status) in moments().items():
        assert status.act is act, name
        agrees(name, status)


def test_where_no_samples_arrive_nothing_is_asked_of_the_device() -> None:
    """Nor is it called still or turning, nor does an older event say what to do."""
    for name, (_, moment) in moments().items():
        if moment.step in (StepKind.RESULT, StepKind.SAVE):
            continue
        for flow, act in INTERRUPTED.items():
            status = present(moment, None, flow)
            assert status.act is act, (name, flow)
            agrees(name, status)
            assert not status.still.still, (name, flow)
            if status.rotation is not None:
                turning = status.rotation.angle, status.rotation.rate, status.rotation.fastest
                assert turning == (0.0, 0.0, 0.0), (name, flow)
            if moment.step is StepKind.SETTLE:  # a rest across a gap does not count
                assert status.progress == (0.0, moment.progress[1]), (name, flow)
            assert status.last_event is None, (name, flow)
            assert {offer.command for offer in status.offers} <= {"skip"}, (name, flow)


def test_the_same_state_gives_the_same_instruction() -> None:
    """Presenting twice changes nothing."""
    for name, (_, status) in moments().items():
        again = present(status)
        assert replace(again, field=None) == replace(status, field=None), name
