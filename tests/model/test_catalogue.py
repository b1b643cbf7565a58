"""One file is one effect, wherever the file lies."""

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from imucal_wizard.core.errors import UsageError
from imucal_wizard.model import effects
from imucal_wizard.model.catalogue import (
    builtin_effects,
    effect,
    effects_for,
    effects_in,
    load_effect,
)
from imucal_wizard.model.lesson import lesson, session_poses

PLAIN = '''
import numpy as np
from imucal_wizard.model.effect import Effect, EffectParameter

class FourthOrder(Effect):
    """The fourth power of the force."""
    name = "fourth-order"
    sensors = ("accelerometer",)
    kind = "orientation"
    title = "fourth-order non-linearity"
    equation = "ε_i = K₄ᵢ x_i⁴"

    def parameters(self, sensor):
        return tuple(EffectParameter(axis, "m/s²", 0.01) for axis in "xyz")

    def columns(self, sensor, c, variant=None):
        return ((c.force / c.gravity) ** 4)[:, :, None] * np.eye(3)
'''


TERMS = {
    "accelerometer": "second-order asymmetry cross-product third-order odd-quadratic "
    "bias-temperature bias-drift warm-up bias-step scale-temperature hysteresis "
    "vibration-rectification",
    "gyroscope": "g-sensitivity g2-sensitivity second-order asymmetry cross-product third-order "
    "bias-temperature bias-drift warm-up bias-step scale-temperature earth-rate",
}
"""Those of the contract; other effects may stand among them."""


@pytest.mark.parametrize("sensor", TERMS)
def test_the_terms_of_the_contract_are_there_in_a_stable_order(sensor: str) -> None:
    """The plainest of a family first."""
    wanted = TERMS[sensor].split()
    assert [known.name for known in effects_for(sensor) if known.name in wanted] == wanted


def test_every_module_is_one_effect_with_a_name_of_its_own() -> None:
    """The module is named after its effect."""
    files = [path.stem for path in Path(effects.__path__[0]).glob("*.py") if path.stem[0] != "_"]
    names = [known.name.replace("-", "_") for known in builtin_effects()]
    assert sorted(files) == sorted(names)
    assert len(set(names)) == len(names)


def test_an_unknown_name_is_answered_with_the_known_ones() -> None:
    """So that a typing error is mended at once."""
    with pytest.raises(UsageError, match=r"no effect 'second-ordre'; choose one of .*second-order"):
        effect("second-ordre")


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty package on the import path."""
    folder = tmp_path / "more_terms"
    folder.mkdir()
    (folder / "__init__.py").write_text("")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield folder
    for name in [name for name in sys.modules if name.split(".")[0] == "more_terms"]:
        del sys.modules[name]


def test_a_new_file_in_the_package_is_a_new_effect_and_nothing_else_changes(package: Path) -> None:
    """It is listed, has its columns, and stands where a user's own effect would."""
    (package / "fourth_order.py").write_text(PLAIN)
    (found,) = effects_in(importlib.import_module("more_terms"))
    assert found.name == "fourth-order"
    assert effects_for("accelerometer", [found])[-1] is found
    assert effects_for("gyroscope", [found]) == effects_for("gyroscope")
    assert effect("fourth-order", [found]) is found


def test_the_same_file_given_by_the_user_moves_the_same(package: Path, tmp_path: Path) -> None:
    """``--effects FILE`` and a built-in module take one road."""
    (package / "fourth_order.py").write_text(PLAIN)
    (builtin,) = effects_in(importlib.import_module("more_terms"))
    own = load_effect(_file(tmp_path, PLAIN))
    assert (own.name, own.title, own.kind) == (builtin.name, builtin.title, builtin.kind)
    assert own.parameters("accelerometer") == builtin.parameters("accelerometer")
    expected = builtin.columns("accelerometer", session_poses())
    np.testing.assert_array_equal(own.columns("accelerometer", session_poses()), expected)
    assert own.variants(session_poses()) == (None,)


def test_all_that_an_own_effect_states_of_itself_counts(tmp_path: Path) -> None:
    """Settings between those tried, sizes that add up to nothing, a prior of each setting."""
    text = PLAIN.replace(
        '    kind = "orientation"\n',
        '    kind, graded, bounded = "orientation", True, True\n    gauge = ((1.0, 1.0, 1.0),)\n\n'
        "    def variants(self, c):\n        return (1.0, 2.0)\n\n"
        "    def typical(self, sensor, variant=None):\n        return np.full(3, variant)\n\n",
    )
    own = load_effect(_file(tmp_path, text))
    assert (own.graded, own.bounded, own.gauge) == (True, True, ((1.0, 1.0, 1.0),))
    assert own.typical("accelerometer", 2.0).tolist() == [2.0] * 3
    assert own.suited(session_poses()) is own


def _file(folder: Path, text: str) -> Path:
    path = folder / "mine.py"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        (PLAIN, "x = 1", "no effect in it; define one class"),
        (PLAIN, PLAIN + PLAIN.replace("FourthOrder", "Other"), "2 effects in it"),
        (PLAIN, "def broken(:", "SyntaxError"),
        (PLAIN, "import no_such_module", "line 1: ModuleNotFoundError"),
        (PLAIN, "raise SystemExit(3)", "SystemExit: 3"),
        ('name = "fourth-order"', "", "lacks name"),
        ('title = "fourth-order non-linearity"', "", "lacks title"),
        ('"fourth-order"', '"second-order"', "is a built-in effect"),
        ('"fourth-order"', '"Fourth order!"', "small letters"),
        ('("accelerometer",)', '"accelerometer"', "write some of"),
        ('("accelerometer",)', '("thermometer",)', "write some of"),
        ('"orientation"', '"sometimes"', "kind 'sometimes'"),
        ("[:, :, None] * np.eye(3)", "", r"shape \(300, 3\); return \(300, 3, 3\)"),
        ("** 4", "** 4 / 0.0 * 0.0", "NaN or infinity"),
        ("c.gravity", "c.gravitas", "line 17: AttributeError"),
        ("c.force / c.gravity", "1 / 0 * c.force", "line 17: ZeroDivisionError"),
        ('for axis in "xyz"', 'for axis in "xxz"', "two parameters have one name"),
        ('for axis in "xyz"', 'for axis in ""', "no EffectParameter"),
        ("0.01", "0.0", "typical must lie above 0"),
    ],
)
@pytest.mark.filterwarnings("error")
def test_an_effect_file_that_breaks_the_interface_is_refused_by_name(
    tmp_path: Path, old: str, new: str, says: str
) -> None:
    """A usage error names the file and, where one is to blame, the line."""
    path = _file(tmp_path, PLAIN.replace(old, new))
    with pytest.raises(UsageError, match=says) as caught:
        load_effect(path)
    assert str(path) in str(caught.value)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    """As is one that is no Python file."""
    with pytest.raises(UsageError, match=r"absent\.py: no Python file there"):
        load_effect(tmp_path / "absent.py")


def test_a_later_error_names_file_and_line(tmp_path: Path) -> None:
    """An effect that only fails on some data does not end the program with a traceback."""
    late = "if len(c) < 5: raise ValueError('too short')\n        return (("
    path = _file(tmp_path, PLAIN.replace("return ((", late))
    own = load_effect(path)
    with pytest.raises(UsageError, match=r"mine\.py, line 17: ValueError: too short; mend"):
        own.columns("accelerometer", session_poses().select(slice(0, 4)))


def test_the_lesson_of_an_own_effect_is_in_its_authors_words(tmp_path: Path) -> None:
    own = load_effect(_file(tmp_path, PLAIN))
    assert lesson(own, "accelerometer").what == "The fourth power of the force."
    (tmp_path / "silent").mkdir()
    silent = PLAIN.replace('    """The fourth power of the force."""\n', "")
    text = lesson(load_effect(_file(tmp_path / "silent", silent)), "accelerometer").what
    assert text == "Its author gives no description: fourth-order non-linearity."
