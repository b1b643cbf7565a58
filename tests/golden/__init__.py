"""What the commands print for a fixed set of recordings, held against recorded outputs.

``cases`` lists recordings and commands, ``figures`` says what is compared and how closely,
``record`` writes the expected figures: ``python -m tests.golden.record``.
"""
