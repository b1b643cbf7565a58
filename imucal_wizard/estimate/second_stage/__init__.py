"""N's second calibration level: parameters that only two sensors together determine."""
