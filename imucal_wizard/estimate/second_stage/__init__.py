"""N's second calibration level: what two sensors say of each other that none says of itself."""
