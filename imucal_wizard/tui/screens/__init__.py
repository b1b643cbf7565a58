"""One screen per step of the wizard, one class per file."""
