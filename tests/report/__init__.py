"""Text, JSON, calibration files and exports."""
