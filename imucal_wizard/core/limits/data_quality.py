"""What counts as wrong in the data of a sensor: one set of limits for streams and recordings."""

MIN_CHECKED_SAMPLES = 50
"""Fewer samples show nothing about the device."""
MAX_REPEATED_SHARE = 0.2
"""Share of samples like the one before; with more the device prints faster than it measures."""
MAX_ZERO_RATE_SHARE = 0.3
"""Share of samples with a rate of exactly zero on all axes; with more that is no chance."""
MAX_FORCE_STEP = 0.004
"""m/s²: coarser steps hide the noise of a consumer accelerometer, unless it is larger than them."""
MAX_RATE_STEP = 0.002
"""rad/s: the same of a gyroscope."""
MAX_UNDITHERED_STEPS = 2.0
"""Steps over noise; with less the noise dithers the steps away in the average of a hold."""

MIN_PLATEAU = 4
"""Equal samples at the extreme of a motion, entered with a jump, that are no chance."""
MIN_PLATEAU_JUMP = 5.0
"""Resolution steps at which a clipped peak is entered at once; a smooth peak is not."""
MIN_LONG_PLATEAU, MIN_LONG_PLATEAU_JUMP = 8, 3.0
"""So many equal samples leave no room for noise; a smooth peak as flat falls by a single step."""
MIN_PLATEAU_RATIO = 3.0
"""A clipped axis stands at its extreme so many times longer than anywhere else: coarse readings
stand still in every position of rest."""
MIN_FORCE_RANGE = 1.7 * 9.80665
"""m/s²: the smallest usual range of an accelerometer is ±2 g; two seconds of rest end below it."""
MIN_RATE_RANGE = 2.0
"""rad/s: the smallest usual range of a gyroscope is ±125 °/s, 2.18 rad/s."""
MIN_COUNT_SPAN = 1000.0
"""Counts over which an axis must have moved before its extreme value can be an end."""
MIN_FULL_SCALE_SHARE = 0.995
"""Share of a known full scale from which a reading is clipped."""
COUNT_ENDS = (32767.0, -32768.0, 65535.0)
"""Values at which converters of 16 bits end."""

MIN_GRAVITY = 2.0
"""m/s²: a smaller reading at rest is gravity in no unit that is taken for another."""
MAX_REST_VARIATION = 0.03
"""Share of itself by which the size of gravity varies while the device lies still."""
MAX_GRAVITY_ERROR = 0.2
"""Share of gravity by which no sensor is off whose unit is right."""
GRAVITY_BLOCK_SECONDS = 0.5
"""Length of the blocks in which the size of gravity is looked for, s."""

RESTART_GAP_SECONDS = 1.0
"""Put between two segments of time where the true distance is not known: no hold survives it."""
MAX_STEP_RATIO = 1.75
"""Usual intervals; after a longer step a sample is missing."""
MAX_JITTER_SHARE = 0.05
"""Share of long steps; with more, uneven ones are jitter of the clock and not loss."""
MAX_UNEVEN_PART, MAX_BURST_RATIO = 0.1, 5.0
"""Long steps that are no whole number of intervals, or so long, are pauses between bursts."""

MIN_POSITION_RATIO = 20.0
"""Times its noise by which a sensor that feels its position differs between rests."""
MAX_GRAVITY_SPREAD = 0.25
"""Spread of the size of gravity over all positions, as a share of it, with bias and scale."""
MIN_RESTS = 20
"""Blocks at rest below which nothing is said about which sensor feels gravity."""
MAX_QUIET_RATIO = 3.0
"""Blocks are at rest whose noise is less than so many times that of the quietest tenth."""
MAX_REMOVED_GRAVITY = 0.3
"""Share of gravity; with less the device has taken it out."""

MIN_FLICKER_STEPS = 0.5
"""Noise in resolution steps from which a reading changes all the time; one that does not is at the
end of its range or repeated."""
SILENT_VARIANCE_SHARE = 1e-6
"""Variance of a clipped axis over what the same axis shows in other holds."""
MIN_SILENT_HOLDS = 2
"""Holds that must show one and the same reading without noise: one might have hung."""

MIN_FIELD_SAMPLES = 60
"""Magnetometer samples with which a fit is tried: ten in each of six directions."""
