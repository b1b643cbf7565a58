"""The magnetometer's calibration: hard and soft iron from a device turned in the Earth's field."""
