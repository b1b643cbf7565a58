"""A small recording with a hidden effect, fitted once."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from textual._compositor import Compositor
from textual.css.model import RuleSet
from textual.css.stylesheet import Stylesheet

from imucal_wizard.acquire.files.recording_files import read_files
from imucal_wizard.core.readings import Readings
from imucal_wizard.diagnose import significance
from imucal_wizard.diagnose.bench import Bench
from imucal_wizard.diagnose.benches import Benches
from imucal_wizard.estimate.recording import fit_readings
from imucal_wizard.estimate.result import FitReport
from imucal_wizard.simulate.recording import simulate_recording
from imucal_wizard.tui.bench.snapshot import bench_snapshot
from tests.conftest import no_search
from tests.estimate.whole_session import Session


@pytest.fixture(autouse=True, scope="session")
def calm_screens() -> Iterator[None]:
    """Scroll at once, draw what a test looks at, and parse each style sheet once for all apps.

    Without a terminal an app draws for nobody. Each kind of screen is drawn when it is first shown,
    and every screen whenever a test reads it (``waiting.seen``).
    """
    parse, known = Stylesheet._parse_rules, dict[object, list[RuleSet]]()
    draw, drawn = Compositor.render_update, set[type]()

    def once(self: Stylesheet, css: str, *args: object, **options: object) -> list[RuleSet]:
        key = css, args, tuple(options.items()), tuple(self._variables.items())
        if key not in known:
            known[key] = parse(self, css, *args, **options)  # type: ignore[arg-type]
        return known[key]

    def first(self: Compositor, *args: object, **options: object) -> object:
        kind = type(self.root)
        if kind not in drawn:
            drawn.add(kind)
            return draw(self, *args, **options)  # type: ignore[arg-type]
        self._dirty_regions.clear()
        return None

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("textual.constants.TEXTUAL_ANIMATIONS", "none")
        patch.setattr("textual.screen.UPDATE_PERIOD", 1.0 / 15.0)
        patch.setattr(Stylesheet, "_parse_rules", once)
        patch.setattr(Compositor, "render_update", first)
        yield


@pytest.fixture(autouse=True, scope="module")
def sizes_found_roughly(no_sizes_throughout: None) -> None:
    """What a screen shows does not depend on how exactly the sizes of a bench are computed."""
    del no_sizes_throughout


SIMULATIONS = significance.SIMULATIONS
"""As the program makes them: imported before any test makes fewer."""


def fitted(path: Path, hidden: str, rotations: int) -> FitReport:
    """The fit of 18 poses of a virtual IMU with this effect."""
    simulate_recording(path, hidden=[hidden], seed=3, rotations=rotations)
    return fit_readings(read_files([path]))


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


def looked_at(benches: Benches, *each: Bench) -> Benches:
    """Benches whose snapshots are made with all simulations, whichever test asks first."""
    with no_search(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(significance, "SIMULATIONS", SIMULATIONS)
        for bench in each:
            bench_snapshot(benches, bench)
    return benches


def fresh(benches: Benches) -> Benches:
    """Benches whose models a test may change; what was found of the present ones is shared."""
    other = benches.copied()
    for bench in other.opened.values():
        bench._refused = dict(bench._refused)
    return other


@pytest.fixture(scope="session")
def bent_benches(bent: FitReport) -> Benches:
    """The benches of the accelerometer that bends, as it is shown."""
    benches = Benches(bent)
    return looked_at(benches, benches.accelerometer)


@pytest.fixture(scope="session")
def sagging_benches(sagging: FitReport) -> Benches:
    """The benches of the gyroscope that feels gravity, as it is shown."""
    benches = Benches(sagging)
    bench = benches.bench("gyroscope")
    assert bench is not None
    return looked_at(benches, benches.accelerometer, bench)


@pytest.fixture
def benches(bent_benches: Benches) -> Benches:
    """The accelerometer that bends, with the base model."""
    return fresh(bent_benches)


@pytest.fixture
def bench(benches: Benches) -> Bench:
    """Its bench."""
    return benches.accelerometer


@pytest.fixture
def sagged(sagging_benches: Benches) -> Benches:
    """The gyroscope that feels gravity, beside its accelerometer."""
    return fresh(sagging_benches)
