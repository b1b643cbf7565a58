"""The rows of an experiment: one file for each kind of quantity that is measured and predicted."""
