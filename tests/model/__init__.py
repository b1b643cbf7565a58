"""What the effects must be."""
