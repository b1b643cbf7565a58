"""Exercises for a class: a recording with one randomly hidden effect, and the sealed answer."""

from imucal_wizard.teach.exercise import make_exercise, reveal

__all__ = ["make_exercise", "reveal"]
