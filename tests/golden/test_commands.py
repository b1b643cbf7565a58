"""The commands give the recorded figures for the recorded data.

Those that must tell the same figures are held against the records in ``tests/test_one_figure.py``.
"""

import json

import pytest

from imucal_wizard.cli import main as cli
from tests.golden.cases import ALIKE_COMMANDS, CASES, EXPECTED, TOLD_ALIKE
from tests.golden.figures import differences, figures

pytestmark = pytest.mark.usefixtures("no_sizes_throughout")  # no recorded figure is a size

RUNS = [
    pytest.param(name, command, marks=marks, id=f"{name}: {command}")
    for name, case in CASES.items()
    for commands, marks in ((case.commands, ()), (case.study, pytest.mark.study))
    for command in commands
    if name not in TOLD_ALIKE or command not in ALIKE_COMMANDS
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
