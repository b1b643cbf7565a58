"""What the procedure decides."""
