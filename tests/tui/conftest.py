"""A small recording with a hidden effect, fitted once."""

from pathlib import Path

import pytest

from imucal_wizard.bench.benches import Benches
from imucal_wizard.bench.session import Bench
from imucal_wizard.devices.virtual.simulate import simulate_recording
from imucal_wizard.fitting import fit_readings
from imucal_wizard.readings import Readings
from imucal_wizard.recordings import read
from imucal_wizard.solver.result import FitReport
from tests.solver.whole_session import Session


def fitted(path: Path, hidden: str, rotations: int) -> FitReport:
    """The fit of 18 poses of a virtual IMU with this effect."""
    simulate_recording(path, hidden=[hidden], seed=3, rotations=rotations)
    return fit_readings(read([path]))


@pytest.fixture(scope="session")
def bent(tmp_path_factory: pytest.TempPathFactory) -> FitReport:
    """An accelerometer whose x axis bends by 5 mg/g²."""
    return fitted(tmp_path_factory.mktemp("bench") / "bent.csv", "second-order:5:x", 0)


@pytest.fixture(scope="session")
def sagging(tmp_path_factory: pytest.TempPathFactory) -> FitReport:
    """A gyroscope whose x axis feels gravity, beside an accelerometer without effects."""
    path = tmp_path_factory.mktemp("bench") / "sagging.csv"
    return fitted(path, "gyroscope/g-sensitivity:0.05:x", 2)


@pytest.fixture(scope="session")
def turned() -> Readings:
    """Three sensors in 40 rests and the turns between them; the truth is the session's."""
    return Session(rate=50.0).readings(1)


@pytest.fixture(scope="session")
def aligned(turned: Readings) -> FitReport:
    """Its fit, with a second stage."""
    return fit_readings(turned)


@pytest.fixture
def benches(bent: FitReport) -> Benches:
    """The accelerometer that bends, with the base model."""
    return Benches(bent)


@pytest.fixture
def bench(benches: Benches) -> Bench:
    """Its bench."""
    return benches.accelerometer


@pytest.fixture
def sagged(sagging: FitReport) -> Benches:
    """The gyroscope that feels gravity, beside its accelerometer."""
    return Benches(sagging)
