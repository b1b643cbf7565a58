"""Compare the model with the measurements, see where it fails, name what is missing, add it."""
