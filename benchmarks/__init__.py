"""Measurements. The linear algebra runs on one thread, as it does in the program (see ``cli``)."""

import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
