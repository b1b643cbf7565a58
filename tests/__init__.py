"""The specification of imucal_wizard, one sentence per test."""
