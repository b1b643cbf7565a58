"""Fits of models that contain physical effects besides bias, scale and non-orthogonality."""
