"""What the operator does, decided here from samples alone and never on a screen."""
