"""A classroom exercise: a recording with one effect that chance hid, and the answer sealed."""

from imucal_wizard.mystery.exercise import make_exercise, reveal

__all__ = ["make_exercise", "reveal"]
