"""The effects there are: every module of ``terms``, and what a user adds."""

import importlib
import inspect
import pkgutil
from collections.abc import Iterable
from functools import cache
from types import ModuleType

from imucal_wizard.effects import terms
from imucal_wizard.effects.effect import Effect
from imucal_wizard.errors import UsageError


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
    return effects_in(terms)


def effects_for(sensor: str, extra: Iterable[Effect] = ()) -> tuple[Effect, ...]:
    """The effects that this sensor may have, a user's own at the end."""
    return tuple(effect for effect in (*builtin_effects(), *extra) if sensor in effect.sensors)


def effect(name: str, extra: Iterable[Effect] = ()) -> Effect:
    """The effect of this name.

    Raises:
        UsageError: there is none.
    """
    known = {effect.name: effect for effect in (*builtin_effects(), *extra)}
    if name not in known:
        raise UsageError(f"there is no effect {name!r}; choose one of {', '.join(known)}")
    return known[name]
