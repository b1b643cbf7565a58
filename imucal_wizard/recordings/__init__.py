"""Files to readings, one file per file format."""
