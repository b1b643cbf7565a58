"""What the commands write for scripts."""

import json

import pytest

from imucal_wizard.cli import main as cli


def fit_json(capsys: pytest.CaptureFixture[str], *arguments: str) -> dict[str, object]:
    """What ``fit --no-verdict --json -`` writes: one document, and exit status 0."""
    assert cli.main(["fit", *arguments, "--no-verdict", "--json", "-"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert isinstance(document, dict)
    return document
