"""What counts as rest, as a hold and as a rotation: the same live and offline."""

BLOCK_SECONDS = 0.1
"""Length of the blocks on which stillness is decided, s: well above one sample, well below the
half second in which a hand comes to rest."""
MIN_BLOCK_SAMPLES = 4
"""Fewer samples have no variance worth the name; slow devices get longer blocks."""
WINDOW_BLOCKS = 5
"""Blocks of a window of half a second, over which the standard deviation is taken."""
TIME_TOLERANCE = 1e-6
"""Seconds by which sums of block lengths may miss a whole number."""

MIN_HOLD_SECONDS = 1.0
"""Shorter rests of a recording are as often a slow moment of a rotation as a hold."""
GUARD_BLOCKS = 1
"""Blocks given away at either end of a hold, where the device may already be moving."""
COVARIANCE_BATCHES = 5
"""Batch means from which the covariance of an average is taken: few enough to show slow noise."""
MAX_SETTLING_SIGMA = 4.0
"""Standard deviations of a block's mean from the middle of its hold; beyond it still moves."""
MAX_TRIMMED_BLOCKS = 10
"""Blocks taken off an end of a hold, one second: longer motion is not a matter of ends."""
MIN_BLOCKS_TO_TRIM = 8
"""Blocks below which a hold has no middle to compare its ends with."""

QUIET_BLOCKS = 20
"""Blocks of the quietest two seconds of a recording, which give its noise."""
VARIANCE_FACTORS = (2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64, 96, 128, 192, 256)
"""Limits tried on a recording, as multiples of its quietest variance; doubled from there on."""
MAX_FORCE_LIMIT = 0.05
"""Loosest limit of the accelerometer's standard deviation, in units of gravity: 50 mg, the wildest
of tremors."""
MAX_RATE_LIMIT = 0.2
"""Loosest limit of the gyroscope's, as a share of what the liveliest windows show."""
LIVELY_PERCENTILE = 95.0
"""Windows at this percentile are called the liveliest: single jerks do not count."""

MIN_ROTATION_SECONDS = 2.5
"""No hand turns a device all the way round and back to the same place in less."""
SAME_PLACE = 0.01
"""Share of gravity by which two holds of one place differ at most."""
ROTATION_OVERLAP_SECONDS = 0.05
"""Seconds of each hold at the ends of a rotation, so that no motion is missed."""
MIN_LEVEL_GRAVITY = 0.25
"""Share of gravity in the plane of rotation below which the tilt is not known."""
