"""Readings, units, poses, rotation algebra, errors: what every other package builds on."""
