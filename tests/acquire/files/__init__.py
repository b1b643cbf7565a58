"""Files of every format, clean and broken, to readings."""
