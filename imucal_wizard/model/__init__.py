"""The sensor model: physical effects, their parameters, columns, signatures and lessons."""
