"""A study of hidden effects: simulated hold averages, judged as the program judges them."""
