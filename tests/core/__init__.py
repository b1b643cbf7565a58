"""What every package uses: units, quantities."""
