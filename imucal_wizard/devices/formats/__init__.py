"""One file per wire format: bytes to rows of samples, without I/O."""
