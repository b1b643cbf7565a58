"""From the port to the screen, in threads, with real ports and real files."""
