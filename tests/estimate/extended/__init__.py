"""Fits with physical effects: exact recovery, honest errors, derivatives, real recordings."""
