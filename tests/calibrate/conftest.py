"""The fit that many tests begin with."""

import pytest

from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.estimate.result import FitReport
from tests.calibrate.sessions import session


@pytest.fixture(scope="session")
def plain() -> FitReport:
    """The fit of the recording that is not spoilt, with six turns about each axis."""
    return fit_readings(session())
