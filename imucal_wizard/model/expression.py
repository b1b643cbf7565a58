"""An arithmetic expression typed by a user, over arrays: parsed once, evaluated by simpleeval.

Only numbers, names, ``+ − * / **``, comparisons and the functions below are let through; whatever
else Python knows (attributes, indexing, strings, loops, assignments) is refused before anything is
evaluated. Length, depth and powers are bounded, so that evaluation cannot take long.
"""

import ast
import warnings
from collections.abc import Callable, Mapping

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.core.records import dataclass

MAX_FORMULA_CHARACTERS = 300
"""Characters of an expression."""
MAX_FORMULA_DEPTH = 30
"""Brackets and signs within one another."""
HIGHEST_POWER = 8.0

Value = FloatArray | np.float64
_Function = Callable[..., Value]

_LEAVES = (ast.Name, ast.Constant, ast.Load)
_SIGNS = (ast.UnaryOp, ast.USub, ast.UAdd)
_ARITHMETIC = (ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow)
_COMPARISON = (ast.Compare, ast.Lt, ast.LtE, ast.Gt, ast.GtE)
_ALLOWED = (ast.Expr, ast.Call, *_LEAVES, *_SIGNS, *_ARITHMETIC, *_COMPARISON)


def _power(base: Value, exponent: Value) -> Value:
    if np.ndim(exponent) or abs(float(exponent)) > HIGHEST_POWER:
        raise UsageError(f"a power must be one number from -{HIGHEST_POWER:g} to {HIGHEST_POWER:g}")
    return np.asarray(np.power(base, exponent), np.float64)


def _where(condition: Value, yes: Value, no: Value, /) -> Value:
    return np.asarray(np.where(np.asarray(condition) != 0.0, yes, no), np.float64)


def _truth(comparison: np.ufunc) -> _Function:
    """1 where it is true, 0 elsewhere, so that one can go on calculating with it."""
    return lambda left, right, /: np.asarray(comparison(left, right), np.float64)


def _one(function: _Function) -> _Function:
    """Only its argument: NumPy's own functions would take an array to write into as well."""
    return lambda x, /: function(x)


def _two(function: _Function) -> _Function:
    return lambda x, y, /: function(x, y)


FUNCTIONS: Mapping[str, _Function] = {
    "abs": _one(np.abs),
    "sign": _one(np.sign),
    "sqrt": _one(np.sqrt),
    "exp": _one(np.exp),
    "log": _one(np.log),
    "sin": _one(np.sin),
    "cos": _one(np.cos),
    "tanh": _one(np.tanh),
    "min": _two(np.minimum),
    "max": _two(np.maximum),
    "where": _where,
}
"""Angles in radians; ``where(t > 300, 1, 0)``."""
OPERATORS: Mapping[type[ast.AST], _Function] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: _power,
    ast.USub: np.negative,
    ast.UAdd: np.positive,
    ast.Lt: _truth(np.less),
    ast.LtE: _truth(np.less_equal),
    ast.Gt: _truth(np.greater),
    ast.GtE: _truth(np.greater_equal),
}


@dataclass(frozen=True, eq=False)
class Expression:
    """A checked expression.

    Attributes:
        text: as typed.
        tree: its only statement, of allowed nodes only.
        names: variables and coefficients in it, in the order of their first use.
    """

    text: str
    tree: ast.Expr
    names: tuple[str, ...]

    def value(self, names: Mapping[str, Value]) -> Value:
        """The value where the names are these; NaN and infinity where it has none.

        Raises:
            UsageError: a power too high, or a function with too few or too many arguments.
        """
        from simpleeval import SimpleEval

        evaluator = SimpleEval(dict(OPERATORS), dict(FUNCTIONS), dict(names))
        evaluator.nodes[ast.Constant] = lambda node: np.float64(node.value)
        try:
            with np.errstate(all="ignore"):
                return np.asarray(evaluator.eval(self.text, self.tree), np.float64)
        except UsageError as error:
            raise UsageError(f"formula {self.text!r}: {error}") from None
        except TypeError:
            raise UsageError(
                f"formula {self.text!r}: a function has too few or too many arguments; min and max "
                "take two, where takes three, the others one"
            ) from None
        except OverflowError:
            raise UsageError(f"formula {self.text!r}: a number in it is too large") from None


def parse(text: str) -> Expression:
    """Check an expression, before anything of it is evaluated.

    Raises:
        UsageError: it is no expression, too long or too deep, or has something that is not allowed.
    """
    text = text.strip()
    if not text or len(text) > MAX_FORMULA_CHARACTERS:
        raise UsageError(
            f"a formula has 1 to {MAX_FORMULA_CHARACTERS} characters; this one has {len(text)}"
        )
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # Python would write to the terminal
            body = ast.parse(text).body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise UsageError(f"formula {text!r}: cannot be read; write like k1*ax**2 + k2*T") from None
    if len(body) != 1 or not isinstance(body[0], ast.Expr):
        raise UsageError(f"formula {text!r}: write one expression, without = and without lines")
    tree = body[0]
    _check_depth(text, tree)
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    names = {}
    for node in ast.walk(tree):
        _check_node(text, node)
        if isinstance(node, ast.Name) and id(node) not in called:
            names[node.id] = (node.lineno, node.col_offset)
    return Expression(text, tree, tuple(sorted(names, key=lambda name: names[name])))


def _check_depth(text: str, tree: ast.AST) -> None:
    level: list[ast.AST] = [tree]
    for _ in range(MAX_FORMULA_DEPTH):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
        if not level:
            return
    raise UsageError(f"formula {text!r}: too many brackets within one another; write it flatter")


def _check_node(text: str, node: ast.AST) -> None:
    if not isinstance(node, _ALLOWED):
        raise UsageError(
            f"formula {text!r}: {type(node).__name__} is not allowed; use numbers, names, "
            f"+ - * / ** and {', '.join(FUNCTIONS)}"
        )
    if isinstance(node, ast.Constant) and type(node.value) not in (int, float):
        raise UsageError(f"formula {text!r}: {node.value!r} is no number; take it out")
    if isinstance(node, ast.Compare) and len(node.ops) > 1:
        raise UsageError(f"formula {text!r}: compare two things at a time")
    if isinstance(node, ast.Name) and (node.id.startswith("_") or len(node.id) > 20):
        raise UsageError(f"formula {text!r}: {node.id!r} is no name; begin it with a letter")
    if isinstance(node, ast.Call):
        _check_call(text, node)


def _check_call(text: str, node: ast.Call) -> None:
    known = isinstance(node.func, ast.Name) and node.func.id in FUNCTIONS
    if not known or node.keywords:
        raise UsageError(
            f"formula {text!r}: only these functions are known: {', '.join(FUNCTIONS)}"
        )
