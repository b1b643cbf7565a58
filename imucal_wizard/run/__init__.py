"""From the port to the screen: the thread that reads, stores, decodes and decides."""
