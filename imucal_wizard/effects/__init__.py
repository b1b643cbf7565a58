"""The physics: what may move a reading besides bias and gain, one small file per effect."""
