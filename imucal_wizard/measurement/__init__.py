"""What was measured: stillness, holds, rotations, and how coarse and noisy the samples are."""
