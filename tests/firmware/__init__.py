"""The Arduino sketches, compiled for this machine and run against a chip made of registers."""
