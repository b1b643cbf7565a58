"""The noise of a device at rest."""
