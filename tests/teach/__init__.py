"""The classroom exercise: drawn, sealed, guessed."""
