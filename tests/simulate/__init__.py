"""The virtual IMU: its motion, its sensor, its line."""
