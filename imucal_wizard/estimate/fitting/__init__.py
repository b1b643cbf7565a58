"""From what was measured to a report: the one road that screens, commands and tests all take."""

from imucal_wizard.estimate.fitting.inertial import FitOptions
from imucal_wizard.estimate.fitting.report import fit_collected, fit_readings

__all__ = ["FitOptions", "fit_collected", "fit_readings"]
