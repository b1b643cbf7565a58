"""Draws what lies in ``assets/``: the sheet of poses, and the pictures of the screens."""
