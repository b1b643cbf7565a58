"""Bytes in: ports, clocks, formats."""
