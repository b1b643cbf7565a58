"""The bench's panels and pages: pure functions from a snapshot to rows of text."""
