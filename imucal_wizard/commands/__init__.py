"""One file per command: its options, and the call into the house."""
