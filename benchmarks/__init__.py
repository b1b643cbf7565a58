"""Measurements of speed and of statistics: printed tables, never tests."""
