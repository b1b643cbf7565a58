"""The bench: floors, advice, sentences, statements."""
