"""The catalogue of effects: every module of ``effects``, and a user's own Python file.

A user's file defines one class; it is checked before it is used, and what goes wrong in it later is
reported with its line.
"""

import importlib
import inspect
import pkgutil
import re
import sys
import traceback
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TypeVar, get_args

import numpy as np

from imucal_wizard.core.errors import UsageError
from imucal_wizard.core.input import is_file, others_may_write
from imucal_wizard.core.readings import FloatArray
from imucal_wizard.model import effects
from imucal_wizard.model.effect import (
    SENSORS,
    Against,
    Circumstances,
    Effect,
    EffectParameter,
    Kind,
)
from imucal_wizard.model.lesson import session_of
from imucal_wizard.model.unknown_shape import FREE_CURVES, UnknownShape
from imucal_wizard.model.unknown_shape import NAME as UNKNOWN_SHAPE


def classes_in(module: ModuleType) -> list[type[Effect]]:
    """The effects that a module defines itself, in the order of their names."""
    found = [
        value
        for value in vars(module).values()
        if inspect.isclass(value)
        and issubclass(value, Effect)
        and not inspect.isabstract(value)
        and value.__module__ == module.__name__
    ]
    return sorted(set(found), key=lambda cls: cls.__name__)


def effects_in(package: ModuleType) -> tuple[Effect, ...]:
    """One effect per module of a package, the plainest of a family first."""
    modules = pkgutil.iter_modules(package.__path__, f"{package.__name__}.")
    found = [cls() for info in modules for cls in classes_in(importlib.import_module(info.name))]
    return tuple(sorted(found, key=lambda effect: (effect.order, effect.name)))


@cache
def builtin_effects() -> tuple[Effect, ...]:
    """The effects that come with the program, always in the same order."""
    return effects_in(effects)


def effects_for(sensor: str, extra: Iterable[Effect] = ()) -> tuple[Effect, ...]:
    """The effects that this sensor may have, a user's own at the end."""
    return tuple(effect for effect in (*builtin_effects(), *extra) if sensor in effect.sensors)


def free_curves_for(sensor: str) -> tuple[UnknownShape, ...]:
    """The free curves of this sensor, which are offered where no effect explains what is left."""
    return tuple(one for one in FREE_CURVES if sensor in one.sensors)


def effect(name: str, extra: Iterable[Effect] = ()) -> Effect:
    """The effect of this name, or the free curve.

    Raises:
        UsageError: there is none.
    """
    known = {effect.name: effect for effect in (*builtin_effects(), *extra)}
    curves = {effect.name: effect for effect in FREE_CURVES}
    if name not in known | curves:
        raise UsageError(f"there is no effect {name!r}; choose one of {', '.join(known)}")
    return (known | curves)[name]


def sensor_and_term(text: str) -> tuple[str, str]:
    """``gyroscope`` and ``warm-up`` of ``gyroscope/warm-up``; the sensor is "" without one."""
    sensor, slash, term = text.partition("/")
    return (sensor, term) if slash and sensor != UNKNOWN_SHAPE else ("", text)


_T = TypeVar("_T")
_NAME = re.compile(r"[a-z0-9][a-z0-9-]*")


class OwnEffect(Effect):
    """A user's effect behind a guard: a fault in it is reported with its file and line."""

    def __init__(self, path: Path, inner: Effect) -> None:
        self._path = path
        self._inner = inner
        self.__doc__ = type(inner).__doc__
        for word in Effect.__annotations__:  # name, sensors, kind and all else that it may state
            setattr(self, word, getattr(inner, word))

    def parameters(self, sensor: str) -> tuple[EffectParameter, ...]:
        """As the user's class says."""
        return guarded(self._path, lambda: tuple(self._inner.parameters(sensor)))

    def columns(self, sensor: str, c: Circumstances, variant: float | None = None) -> FloatArray:
        """As the user's class says, when the shape is right and all numbers are finite."""
        made = guarded(
            self._path,
            lambda: np.asarray(self._inner.columns(sensor, c, variant), np.float64),
        )
        wanted = (len(c), 3, len(self.parameters(sensor)))
        if made.shape != wanted:
            raise UsageError(
                f"{self._path}: columns() gives the shape {made.shape}; return {wanted}: rows, "
                "axes, parameters"
            )
        if not np.isfinite(made).all():
            raise UsageError(
                f"{self._path}: columns() gives NaN or infinity for the {sensor}; guard against "
                "unknown temperature, no pose before, and division by 0"
            )
        return made

    def typical(self, sensor: str, variant: float | None = None) -> FloatArray:
        """As the user's class says."""
        return guarded(self._path, lambda: self._inner.typical(sensor, variant))

    def hidden(self, sensor: str, c: Circumstances, sizes: FloatArray) -> FloatArray:
        """As the user's class says."""
        return guarded(self._path, lambda: self._inner.hidden(sensor, c, sizes))

    def suited(self, c: Circumstances) -> Effect:
        """As the user's class says."""
        made = guarded(self._path, lambda: self._inner.suited(c))
        return self if made is self._inner else OwnEffect(self._path, made)

    def variants(self, c: Circumstances) -> tuple[float | None, ...]:
        """As the user's class says."""
        return guarded(self._path, lambda: tuple(self._inner.variants(c)))

    def lacking(self, sensor: str, c: Circumstances) -> str | None:
        """As the user's class says."""
        return guarded(self._path, lambda: self._inner.lacking(sensor, c))


def load_effect(path: Path | str, announce: Callable[[str], None] | None = None) -> Effect:
    """The effect that a Python file of the user defines.

    Args:
        path: the file.
        announce: called with a sentence before the code in the file is run.

    Raises:
        UsageError: the file cannot be run, defines no effect or several, or the effect does not
            keep its promises on a trial session.
    """
    path = Path(path)
    module = _run(path, announce)
    classes = classes_in(module)
    if not classes:
        raise UsageError(f"{path}: no effect in it; define one class that derives from {_BASE}")
    if len(classes) > 1:
        names = ", ".join(cls.__name__ for cls in classes)
        raise UsageError(f"{path}: {len(classes)} effects in it ({names}); leave one in each file")
    inner = guarded(path, classes[0])
    _check_words(path, inner)
    own = OwnEffect(path, inner)
    for sensor in own.sensors:
        _try(path, own, sensor)
    return own


_BASE = "imucal_wizard.model.effect.Effect and has parameters() and columns()"


def guarded(path: Path, work: Callable[[], _T]) -> _T:
    """Do what a user's file asks; what it raises becomes a message with the file's line."""
    try:
        with np.errstate(all="ignore"):  # the guard reports what is not finite
            return work()
    except (Exception, SystemExit) as error:  # a user's file can raise anything; nothing is lost
        places = traceback.extract_tb(error.__traceback__)
        lines = [frame.lineno for frame in places if frame.filename == str(path)]
        where = f"{path}, line {lines[-1]}" if lines else str(path)
        said = " ".join(str(error).split()) or "no message"
        raise UsageError(f"{where}: {type(error).__name__}: {said}; mend the file") from error


def _run(path: Path, announce: Callable[[str], None] | None) -> ModuleType:
    """Run the code of a file, which nobody else may have written."""
    if not is_file(path):
        raise UsageError(f"{path}: no Python file there; give a file that ends in .py")
    try:
        with path.open("rb") as file:
            others, source = others_may_write(file, path), file.read()
    except OSError as error:
        raise UsageError(f"{path} cannot be read: {error.strerror or error}") from error
    if others:
        raise UsageError(
            f"{path} can be written by {others}, and its code would run as you: it was not run."
            " Make it yours alone (chmod go-w), or copy it to a folder of your own"
        )
    if announce is not None:
        announce(f"runs the Python code in {path}")
    module = ModuleType(f"own_effect_{path.stem}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module  # a dataclass in the file looks its module up there
    code = guarded(path, lambda: compile(source, str(path), "exec"))
    guarded(path, lambda: exec(code, module.__dict__))  # noqa: S102 - the user asks for it
    return module


def _check_words(path: Path, effect: Effect) -> None:
    """Name, sensors, kind, title and equation: there, and of the form that screens rely on."""
    for word in ("name", "sensors", "kind", "title", "equation"):
        if not getattr(effect, word, None):
            raise UsageError(f"{path}: the class lacks {word}; write {word} = … in it")
    if not _NAME.fullmatch(str(effect.name)):
        raise UsageError(
            f"{path}: name {effect.name!r}; write small letters, digits and hyphens: my-effect"
        )
    if effect.name in {known.name for known in builtin_effects()}:
        raise UsageError(f"{path}: {effect.name!r} is a built-in effect; choose another name")
    if isinstance(effect.sensors, str) or not set(effect.sensors) <= set(SENSORS):
        raise UsageError(f"{path}: sensors {effect.sensors!r}; write some of {SENSORS}")
    if effect.kind not in get_args(Kind):
        raise UsageError(f"{path}: kind {effect.kind!r}; write one of {get_args(Kind)}")
    if effect.against not in get_args(Against):
        raise UsageError(f"{path}: against {effect.against!r}; write one of {get_args(Against)}")


def _try(path: Path, effect: Effect, sensor: str) -> None:
    """One call of everything, on a session in which everything varies."""
    parameters = effect.parameters(sensor)
    if not parameters or not all(isinstance(one, EffectParameter) for one in parameters):
        raise UsageError(f"{path}: parameters() gives no EffectParameter; return a tuple of them")
    if len({one.name for one in parameters}) < len(parameters):
        raise UsageError(f"{path}: two parameters have one name; give each its own")
    for one in parameters:
        if not one.typical > 0.0:
            raise UsageError(f"{path}: parameter {one.name}: typical must lie above 0")
    c = session_of(sensor)
    for variant in effect.variants(c):
        effect.columns(sensor, c, variant)
    effect.lacking(sensor, c)
