"""From what was measured to a report: the one road that screens, commands and tests all take."""

from imucal_wizard.fitting.inertial import FitOptions
from imucal_wizard.fitting.magnetometer import with_field
from imucal_wizard.fitting.report import fit_collected, fit_readings

__all__ = ["FitOptions", "fit_collected", "fit_readings", "with_field"]
