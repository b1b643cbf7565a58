"""Drawings, pictures and firmware that go with the program, and the scripts that draw them."""
