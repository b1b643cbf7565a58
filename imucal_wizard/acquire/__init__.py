"""Data acquisition: ports, clocks, formats and column names; readings of devices and recordings."""
