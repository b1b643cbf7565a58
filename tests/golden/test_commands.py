"""The commands give the recorded figures for the recorded data."""

import json

import pytest

from imucal_wizard.cli import main as cli
from tests.golden.cases import CASES, EXPECTED
from tests.golden.figures import differences, figures

RUNS = [
    pytest.param(name, command, marks=marks, id=f"{name}: {command}")
    for name, case in CASES.items()
    for commands, marks in ((case.commands, ()), (case.study, pytest.mark.study))
    for command in commands
]


@pytest.mark.parametrize(("name", "command"), RUNS)
def test_the_figures_are_the_recorded_ones(
    name: str, command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    expected = json.loads((EXPECTED / f"{name}.json").read_text())[command]
    status = cli.main(CASES[name].arguments(command))
    found = figures(json.loads(capsys.readouterr().out))
    assert status == expected["exit"]
    assert not differences(expected, found), "\n" + "\n".join(differences(expected, found))
