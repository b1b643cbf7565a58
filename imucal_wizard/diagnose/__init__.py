"""Comparison of model and measurements: misfit, suspects, verdict, next poses, recheck."""
