"""The operator's procedure, decided from samples alone."""
