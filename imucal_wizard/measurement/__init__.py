"""Holds and rotations: stillness, segmentation, resolution and quality of the data."""
