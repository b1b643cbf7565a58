"""What tests of several packages need."""

import gc
import hashlib
import os
import pickle
import tempfile
from collections.abc import Generator, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from hypothesis import settings

# as the program does, before numpy is imported: with a thread per core in each of the parallel test
# processes, the linear algebra of small matrices takes up to twice the time
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# a busy machine may take any time for an example; pytest's own time limit finds what hangs
# the same examples in each run: what lands does not depend on chance; "thorough" draws new ones
settings.register_profile("usual", deadline=None, max_examples=30, derandomize=True)
settings.register_profile("thorough", deadline=None, max_examples=1000)
settings.load_profile("usual")


def pytest_configure(config: pytest.Config) -> None:
    """Give the tests, and the programs that they run, a folder of their own for the user's data."""
    if not hasattr(config, "workerinput"):
        folder = tempfile.TemporaryDirectory()
        os.environ["XDG_DATA_HOME"] = os.environ["XDG_STATE_HOME"] = folder.name
        config.add_cleanup(folder.cleanup)


def pytest_xdist_auto_num_workers() -> int:
    """One process more than there are cores: some tests wait at the pace of a device."""
    return (os.cpu_count() or 1) + 1


def _only_studies(config: pytest.Config) -> bool:
    return bool(config.getoption("markexpr") == "study")


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """Import no file without a study where only studies run: imports take seconds per process."""
    if not _only_studies(config) or not collection_path.match("test_*.py"):
        return None
    return True if "mark.study" not in collection_path.read_text("utf-8") else None


@pytest.hookimpl(wrapper=True)
def pytest_collection(session: pytest.Session) -> Generator[None, object, object]:
    """Exempt what is loaded by then, a million objects, from every garbage collection."""
    gc.disable()
    worker = getattr(session.config, "workerinput", None)
    whole = session.config.args_source is pytest.Config.ArgsSource.TESTPATHS
    if worker and whole and not _only_studies(session.config):
        _import_from_own_place(int(worker["workerid"][2:]) / worker["workercount"])
    result = yield
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000)  # screens are made of thousands of objects
    gc.enable()
    return result


def _import_from_own_place(share: float) -> None:
    """Import all test files, each worker from another one on.

    In a fresh clone nothing is compiled. Workers that import in one order all compile every file,
    for ten seconds each; from places of their own they find what the others have compiled.
    """
    here = Path(__file__).parent
    names = [
        ".".join(path.relative_to(here.parent).with_suffix("").parts)
        for path in sorted(here.rglob("test_*.py"))
    ]
    first = int(share * len(names))
    for name in names[first:] + names[:first]:
        with suppress(Exception, pytest.skip.Exception):  # collection reports it
            import_module(name)


@pytest.fixture(autouse=True, scope="session")
def simulations_made_once() -> Iterator[None]:
    """Simulate what noise alone makes of one design once in a process.

    Simulations are seeded and take longer than most of what is tested with them; the same design is
    looked at by many tests, and by each command in its turn.
    """
    from imucal_wizard.diagnose import significance
    from imucal_wizard.diagnose.significance import Chances, SimulatedOdds

    simulated, known = Chances._simulated, {}

    def once(self: Chances, sigma: float, wander: float) -> SimulatedOdds:
        suspects = self._suspects[0]
        frame, spectra = suspects.frame, suspects.spectra
        numbers = [suspects.log_prior, frame._log_volume, *frame.each_weights]
        numbers += [part for one in spectra for part in (one.gain, one.log_det, *one.patterns)]
        design = hashlib.sha256(pickle.dumps([(part.shape, part.tobytes()) for part in numbers]))
        key = design.digest(), significance.SIMULATIONS, self._seed, sigma, wander
        if key not in known:
            known[key] = simulated(self, sigma, wander)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Chances, "_simulated", once)
        yield


@contextmanager
def few_draws() -> Iterator[None]:
    """Find the sizes that show from few draws."""
    from imucal_wizard.diagnose import noise_draws, significance

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(noise_draws, "DRAWS", 2)
        patch.setattr(noise_draws, "MAX_TRIALS", 1)
        patch.setattr(noise_draws, "SEARCHES", noise_draws.SEARCHES[-1:])
        patch.setattr(noise_draws, "MIN_SIGMA_SHARE", 0.5)  # hardly more than the likeliest
        # of so few draws all explanations are weighed as soon as those that matter are found
        every = lambda effect, *_: effect._draws.every  # noqa: E731 (a method in one line)
        patch.setattr(noise_draws.EffectInDraws, "_likely", every)
        patch.setattr(significance, "SIMULATIONS", 100)
        yield


@contextmanager
def no_search() -> Iterator[None]:
    """Tell, as sizes that show, the estimates at which the search for them begins."""
    from imucal_wizard.core.statistics import median
    from imucal_wizard.diagnose.noise_draws import EffectInDraws

    def first_estimate(self: EffectInDraws, rule: object, wanted: float, first: float) -> float:
        del rule, wanted
        return first * median(((1.0 / self._draws.variance) @ self._pattern**2) ** -0.5)

    with few_draws(), pytest.MonkeyPatch.context() as patch:
        patch.setattr(EffectInDraws, "size_meeting", first_estimate)
        yield


@pytest.fixture
def rough_sizes() -> Iterator[None]:
    """Find the sizes that show from few draws, for tests of what else a bench tells."""
    with few_draws():
        yield


@pytest.fixture(scope="module")
def rough_sizes_throughout() -> Iterator[None]:
    """Find them so in all tests of a file."""
    with few_draws():
        yield


@pytest.fixture(scope="module")
def no_sizes_throughout() -> Iterator[None]:
    """Do not search for sizes in any test of a file, none of which looks at them."""
    with no_search():
        yield


if TYPE_CHECKING:  # there are systems without pseudo-terminals, on which other tests run
    from tests.acquire.ports import Pty


@pytest.fixture
def pty() -> "Iterator[Pty]":
    """A device on a pseudo-terminal."""
    from tests.acquire.ports import Pty

    device = Pty()
    yield device
    device.unplug()
