"""The magnetometer's step: turned through circles by hand, judged while it turns."""
