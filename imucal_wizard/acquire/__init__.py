"""Bytes in: ports, clocks, formats, column names; the readings of a device or a recording."""
