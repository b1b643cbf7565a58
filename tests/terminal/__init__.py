"""A real terminal around the real program: a pseudo-terminal, its screen read by pyte."""
