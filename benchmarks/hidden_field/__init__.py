"""A study of hidden effects of a magnetometer: simulated samples, judged as the program does."""
