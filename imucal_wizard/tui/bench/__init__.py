"""What the bench shows: pure functions from a bench to rows of text, called with or without it."""
