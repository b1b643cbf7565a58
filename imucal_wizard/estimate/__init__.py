"""The fits: accelerometer, gyroscope, their uncertainty, and what the data carry."""
