"""The operator's procedure; it decides by the samples alone."""
