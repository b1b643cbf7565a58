"""An ellipsoid through vectors of one magnitude: four ways to fit it, and how well it is known."""
