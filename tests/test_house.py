"""Rules that hold the code base together and that no linter knows."""

import ast
import graphlib
import re
import subprocess
import sys
from collections import defaultdict
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import imucal_wizard

PACKAGE = Path(imucal_wizard.__file__).parent
SHOWING = ("cli", "tui")
"""The packages whose messages may name options and keys."""
DISCOVERED = {
    "run": "each command in cli/ has one",
    "parser": "each command in cli/ has one",
}
"""Names that each discovered module of a folder defines, by its folder's convention."""
ASKING = ("estimate/compensated.py",)
"""Modules that judge how each sensor compensates itself."""
KEYS = r"\b(press|hit|key) [`'\"]?([A-Za-z?]|enter|space|tab|esc(ape)?)[`'\"]?(?=[ .,;:)]|$)"
FLAGS = r"(?<![\w-])--[a-z][a-z-]+"


@cache
def modules() -> list[tuple[str, ast.Module]]:
    """Path inside the package and syntax tree of every module."""
    return [
        (path.relative_to(PACKAGE).as_posix(), ast.parse(path.read_text()))
        for path in sorted(PACKAGE.rglob("*.py"))
    ]


def repeated(names: Iterator[tuple[str, str]]) -> dict[str, list[str]]:
    """The names that are defined in more than one module, with the modules."""
    places: dict[str, list[str]] = defaultdict(list)
    for name, place in names:
        places[name].append(place)
    return {name: found for name, found in places.items() if len(found) > 1}


def test_no_public_name_means_two_things() -> None:
    definitions = (
        (node.name, place)
        for place, tree in modules()
        for node in tree.body
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef)
        and not node.name.startswith("_")
        and node.name not in DISCOVERED
    )
    assert repeated(definitions) == {}


def test_a_limit_is_defined_once() -> None:
    constants = (
        (target.id, place)
        for place, tree in modules()
        for node in tree.body
        for target in _targets(node)
        if re.fullmatch(r"_?[A-Z][A-Z0-9_]+", target.id) and _is_number(node)
    )
    assert repeated((name.lstrip("_"), place) for name, place in constants) == {}


def _targets(node: ast.stmt) -> list[ast.Name]:
    targets = node.targets if isinstance(node, ast.Assign) else [getattr(node, "target", None)]
    return [target for target in targets if isinstance(target, ast.Name)]


def _is_number(node: ast.stmt) -> bool:
    value = getattr(node, "value", None)
    if isinstance(value, ast.UnaryOp):
        value = value.operand
    return isinstance(value, ast.Constant) and type(value.value) in (int, float)


def _texts(tree: ast.Module) -> Iterator[tuple[int, str]]:
    """Strings of a module without its docstrings and those that document a constant."""
    silent = {
        id(node.value)
        for node in ast.walk(tree)
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    }
    for node in ast.walk(tree):
        if (
            isinstance(node, ast.Constant)
            and isinstance(node.value, str)
            and id(node) not in silent
        ):
            yield node.lineno, node.value


def test_no_message_of_the_domain_names_a_key_or_an_option() -> None:
    found = [
        f"{place}:{line}: {text!r}"
        for place, tree in modules()
        if place.split("/")[0] not in SHOWING
        for line, text in _texts(tree)
        if re.search(KEYS, text) or re.search(FLAGS, text)
    ]
    assert found == []


SENSORS = {"accelerometer", "gyroscope", "magnetometer"}


SENSOR_TYPES = r"\w*Experiment|GravityMagnitude|RateAtRest|\w*Closure|FieldMagnitude|Dip|\w+Rows"
"""Types of rows and experiments, which have methods for what differs between the sensors."""


def test_only_the_rows_ask_which_sensor_they_deal_with() -> None:
    """Neither by comparing the sensor's name or constant, nor by the type of its rows."""
    found = [
        f"{place}:{node.lineno}: {ast.unparse(node)}"
        for place, tree in modules()
        if place.startswith(("model/", "estimate/", "diagnose/", "report/", "tui/"))
        and not place.startswith("model/rows/")
        and place not in ASKING
        for node in ast.walk(tree)
        if isinstance(node, ast.expr) and (_compares_a_sensor(node) or _asks_for_a_type(node))
    ]
    assert found == []


def _compares_a_sensor(node: ast.AST) -> bool:
    if not isinstance(node, ast.Compare):
        return False
    return any(isinstance(op, ast.Eq | ast.NotEq) for op in node.ops) and any(
        (isinstance(side, ast.Constant) and side.value in SENSORS)
        or (isinstance(side, ast.Name) and side.id.lower() in SENSORS)
        for side in (node.left, *node.comparators)
    )


def _asks_for_a_type(node: ast.AST) -> bool:
    if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Name):
        return False
    names = [
        name.id for one in node.args[1:] for name in ast.walk(one) if isinstance(name, ast.Name)
    ]
    return node.func.id == "isinstance" and any(re.fullmatch(SENSOR_TYPES, one) for one in names)


@pytest.mark.parametrize("heavy", ["numpy", "textual"])
def test_importing_the_package_imports_nothing_heavy(heavy: str) -> None:
    script = f"import sys, imucal_wizard; print({heavy!r} in sys.modules)"
    printed = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True)
    assert printed.stdout.strip() == b"False"


def test_the_list_of_sources_does_not_wait_for_numpy() -> None:
    """Numpy takes a third of the time until the first screen."""
    script = """
import sys
import imucal_wizard.tui.app
from imucal_wizard.cli.main import main
from imucal_wizard.tui import run
run.run_wizard = lambda options: len({"numpy", "scipy"} & set(sys.modules))
print(main(["wizard"]))
"""
    printed = subprocess.run([sys.executable, "-c", script], capture_output=True, check=True)
    assert printed.stdout.strip() == b"0"


def test_no_modules_import_one_another_in_a_circle() -> None:
    """Two threads that import a circle at the same time see modules that are only half made."""
    trees = {
        f"imucal_wizard.{place.removesuffix('.py').replace('/', '.')}".removesuffix(
            ".__init__"
        ): tree
        for place, tree in modules()
    }
    imported: dict[str, set[str]] = {}
    for name, tree in trees.items():
        froms = [node for node in tree.body if isinstance(node, ast.ImportFrom) and node.module]
        wanted = {f"{node.module}.{one.name}" for node in froms for one in node.names}
        wanted |= {str(node.module) for node in froms}
        imported[name] = (wanted & set(trees)) - {name}
    list(graphlib.TopologicalSorter(imported).static_order())  # raises CycleError
