"""Bytes in: ports and their loss, clocks, and the formats that devices speak."""
