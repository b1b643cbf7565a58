"""A guided calibration for MEMS inertial sensors, in the terminal and in Python.

``read``, ``calibrate``, ``diagnose``, ``load`` and ``export`` are described in
``imucal_wizard.api``; nothing heavy is imported before the first of them is used.
"""

from typing import TYPE_CHECKING

from imucal_wizard.core import VERSION

if TYPE_CHECKING:
    from imucal_wizard.api import calibrate, diagnose, export, load, read

__version__ = VERSION
__all__ = ["__version__", "calibrate", "diagnose", "export", "load", "read"]


def __getattr__(name: str) -> object:
    """A public function, imported when it is first used.

    Raises:
        AttributeError: there is no such name.
    """
    if name in __all__:
        from imucal_wizard import api

        return getattr(api, name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
