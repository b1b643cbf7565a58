"""An exercise in one sitting: chance hides an effect in the wizard's virtual IMU; it is sealed."""

from dataclasses import replace
from pathlib import Path

import pytest

from imucal_wizard.cli import wizard
from imucal_wizard.core.errors import DataError, SessionError, UsageError
from imucal_wizard.guide.kinds import StepKind
from imucal_wizard.guide.state import Status
from imucal_wizard.sessions import KeptSession
from imucal_wizard.teach import reveal
from imucal_wizard.teach.exercise_session import draw_exercise_session, uncovered_number
from imucal_wizard.tui.app import WizardApp
from imucal_wizard.tui.options import WizardOptions
from imucal_wizard.tui.run import first_choice
from imucal_wizard.tui.services import WizardServices
from imucal_wizard.tui.sources import SourceChoice, SourceKind, virtual_imu
from tests.tui import fakes
from tests.tui.terminals import USUAL, VIRTUAL
from tests.tui.waiting import shows


def begun(folder: Path, number: int = 3) -> WizardServices:
    """A workshop in which the exercise of this number has been opened and left again."""
    workshop = WizardServices(
        WizardOptions(sessions=folder, mystery=number, key="newton", speed=50.0)
    )
    source = workshop.open_source(VIRTUAL)
    source.start()
    source.stop()
    return workshop


def test_the_answer_lies_sealed_beside_the_session(tmp_path: Path) -> None:
    workshop = begun(tmp_path)
    assert workshop.sources.sealed is not None
    assert workshop.sources.session is not None
    assert workshop.sources.sealed == workshop.sources.session.with_suffix(".mystery")
    truth = draw_exercise_session(3).truth
    assert reveal(workshop.sources.sealed, "newton") == truth
    with pytest.raises(DataError, match="does not open it"):
        reveal(workshop.sources.sealed, "leibniz")
    assert truth.term.encode() not in workshop.sources.sealed.read_bytes()


def test_the_session_does_not_name_what_is_hidden_and_goes_on_with_it(tmp_path: Path) -> None:
    workshop = begun(tmp_path)
    assert workshop.sources.session is not None
    with KeptSession.look(workshop.sources.session) as kept:
        about = kept.meta()
    assert draw_exercise_session(3).truth.term not in str(about)
    assert about["mystery"] != 3
    assert uncovered_number(about["mystery"]) == uncovered_number(3) == 3
    again = WizardServices(WizardOptions(sessions=tmp_path, speed=50.0))
    source = again.open_source(SourceChoice(SourceKind.SESSION, str(workshop.sources.session)))
    source.start()
    source.stop()


def test_an_exercise_that_is_continued_or_replayed_hides_its_answer_again(tmp_path: Path) -> None:
    """Without the option that began it; the answer beside it is still named."""
    workshop = begun(tmp_path)
    assert workshop.exercise
    session = workshop.sources.session
    assert session is not None
    options = WizardOptions(sessions=tmp_path, replay=(session,), speed=50.0)
    again = WizardServices(options)
    assert not again.exercise
    for choice in (SourceChoice(SourceKind.SESSION, str(session)), SourceChoice(SourceKind.FILE)):
        source = again.open_source(choice)
        assert again.exercise
        assert again.sources.sealed == workshop.sources.sealed
        source.start()
        source.stop()
        other = again.open_source(VIRTUAL)
        assert not again.exercise
        assert again.sources.sealed is None
        other.start()
        other.stop()


async def test_the_result_of_an_exercise_gives_no_verdict() -> None:
    """It would name the hidden effect."""
    source = fakes.FakeSource(Status(step=StepKind.RESULT))
    services = replace(fakes.services(source), exercise=True)
    async with WizardApp(services, None, VIRTUAL).run_test(size=USUAL) as pilot:
        text = await shows(pilot, "An exercise: find out what the model lacks.")
        assert "something is missing" not in text


def test_a_damaged_exercise_is_said_to_be_one(tmp_path: Path) -> None:
    workshop = begun(tmp_path)
    assert workshop.sources.session is not None
    from imucal_wizard.sessions import Session

    with Session.open(workshop.sources.session) as session:
        session.set_meta("grade", "none such")
    with pytest.raises(SessionError, match="damaged"):
        WizardServices(WizardOptions(sessions=tmp_path)).open_source(
            SourceChoice(SourceKind.SESSION, str(workshop.sources.session))
        )


def test_the_same_number_hides_the_same_and_others_hide_others() -> None:
    assert draw_exercise_session(3).truth == draw_exercise_session(3).truth
    assert len({draw_exercise_session(number).truth for number in range(12)}) > 6


def test_with_a_magnetometer_the_effect_may_be_its_and_goes_on_with_the_session(
    tmp_path: Path,
) -> None:
    """Some of them are currents: an ammeter is there always, so that it gives nothing away."""
    made = [draw_exercise_session(number, magnetometer=True) for number in range(200)]
    hidden = {one.truth.term for one in made if one.truth.sensor == "magnetometer"}
    assert {"current", "bias-temperature"} <= hidden
    assert not any(
        draw_exercise_session(number).truth.sensor == "magnetometer" for number in range(40)
    )
    number = next(one.number for one in made if one.truth.term == "current")
    options = WizardOptions(
        sessions=tmp_path, mystery=number, key="newton", speed=50.0, magnetometer=True
    )
    workshop = WizardServices(options)
    source = workshop.open_source(VIRTUAL)
    source.start()
    source.stop()
    assert workshop.sources.sealed is not None
    assert reveal(workshop.sources.sealed, "newton") == made[number].truth
    again = WizardServices(WizardOptions(sessions=tmp_path, speed=50.0))
    source = again.open_source(SourceChoice(SourceKind.SESSION, str(workshop.sources.session)))
    source.start()
    source.stop()


def test_every_sitting_with_a_magnetometer_prints_the_current() -> None:
    about = {"kind": "virtual", "mystery": 0, "grade": "consumer", "magnetometer": True}
    imu = virtual_imu(about, WizardOptions(speed=float("inf")))
    assert b"current[A]" in imu.read().splitlines()[0]


def test_it_opens_on_the_virtual_imu() -> None:
    choice = first_choice(WizardOptions(mystery=1))
    assert choice is not None
    assert choice.kind is SourceKind.VIRTUAL


@pytest.mark.parametrize(
    "arguments",
    [
        ["--mystery", "--hidden", "second-order:3:x"],
        ["--mystery", "--port", "/dev/null"],
        ["--key", "newton"],
        ["--mystery", "--key", " "],
    ],
)
def test_contradicting_options_are_refused(arguments: list[str]) -> None:
    with pytest.raises(UsageError):
        wizard.run(arguments)
