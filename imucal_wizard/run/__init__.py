"""From the port to the screen: one thread that reads, writes down, decodes and decides."""
