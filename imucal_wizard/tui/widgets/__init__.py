"""The parts screens are made of, one class per file."""
