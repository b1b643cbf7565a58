"""The magnetometer's step."""
