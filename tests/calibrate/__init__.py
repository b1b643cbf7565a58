"""Whole recordings fitted: real ones, simulated ones, spoilt ones."""
